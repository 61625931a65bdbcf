"""Which metrics problems have: those that their sets, their horizon and their objects allow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from energymargin._core import Problem
from energymargin.metrics import ANY, CLOCKLESS, METRICS, TIMED
from energymargin.scoring.settings import SearchSettings

__all__ = ["chosen_metrics", "metrics_of", "require_objects"]


def metrics_of(problems: Sequence[Problem]) -> tuple[str, ...]:
    """The metrics that every one of the problems has, in the order of METRICS."""
    there = set(METRICS)
    for problem in problems:
        there -= set(TIMED if problem.horizon is None else CLOCKLESS)
        if problem.succeeded is None:
            there -= {"success", "probability/success"}
        if problem.succeeded_any is None:
            there.discard("success" + ANY)
        if problem.captured_any is None:
            there -= {metric for metric in METRICS if metric.endswith(ANY)} - {"success" + ANY}
    return tuple(metric for metric in METRICS if metric in there)


def chosen_metrics(problems: Sequence[Problem], metrics: Sequence[str] | None) -> Sequence[str]:
    """`metrics`, or for None all that the problems have; ValueError on one that they lack."""
    strange = [problem for problem in problems if not isinstance(problem, Problem)]
    if strange:
        raise ValueError(f"problems has {strange[0]!r}, expected Problems alone")
    there = metrics_of(problems)
    lacking = [metric for metric in metrics or () if metric in METRICS and metric not in there]
    if lacking:
        timed = lacking[0] in TIMED
        if lacking[0] in (*TIMED, *CLOCKLESS) and any(
            (problem.horizon is None) == timed for problem in problems
        ):
            has = "has a" if timed else "is without"
            way = "horizon=..." if timed else "horizon=None, plan=None"
            raise ValueError(
                f"metrics has {lacking[0]!r}, but not every problem {has} horizon: "
                f"problem.replace({way})"
            )
        of_each = " for each object" if lacking[0].endswith(ANY) else ""
        kind = "success" if lacking[0].startswith("success") else "capture"
        raise ValueError(
            f"metrics has {lacking[0]!r}, but not every problem has a {kind} set{of_each}"
        )
    return there if metrics is None else metrics


def require_objects(
    problems: Iterable[Problem], metrics: Sequence[str], settings: SearchSettings
) -> None:
    """Raises ValueError if a disturbance is to meet more objects than a problem has."""
    if settings.objects is None or not set(metrics) & set(TIMED):
        return
    for problem in problems:
        there = sum(body.role == "object" for body in problem.scene.bodies)
        if settings.objects > there:
            raise ValueError(
                f"objects is {settings.objects}, expected from 1 to the scene's {there}"
            )
