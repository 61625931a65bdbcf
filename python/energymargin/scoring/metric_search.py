"""From settings to the search behind one metric of one problem, with all that it found.

`em.score` does the same for many problems and keeps their scores alone. Who also wants a tree, a
path or rollouts asks here, so that a state with the same settings has the same bits everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    ForceScore,
    Problem,
    capture_probability,
    capture_score,
    escape_effort,
    force_score,
    stream,
)
from energymargin.disturbances import Disturbance
from energymargin.metrics import ANY, KINDS, TIMED, metric_kind, settings_of
from energymargin.scoring.settings import SearchSettings

__all__ = ["metric_search", "value_of"]

Found = CaptureScore | EscapeEffort | ForceScore | CaptureProbability


def metric_search(
    problem: Problem,
    metric: str,
    settings: SearchSettings,
    number: int | None = None,
    *,
    disturbance: Disturbance | Callable[[Any, Any], Any] | None = None,
    threads: int = 1,
    **keywords: Any,
) -> Any:
    """The CaptureScore, EscapeEffort, CaptureProbability or ForceScore behind a metric.

    Args:
        problem: the question.
        metric: of METRICS.
        settings: those of the metric count.
        number: of the problem in a batch, whose stream `em.score` gives it; None: the search has
            the seed of the settings itself, as if `em.capture_score` was called with it.
        disturbance: of a probability, in place of the Uniform of the settings.
        threads: of rollouts; the result does not depend on them.
        keywords: others of the function behind, such as cancel, progress and warn; a force score,
            which is no search, leaves them aside.

    Raises what that function raises.
    """
    if metric_kind(metric) is KINDS["force"]:
        return force_score(problem)
    seed = _seed(metric, settings, number)
    if metric in TIMED:
        wanted = {"success": metric == "probability/success", "by_object": metric.endswith(ANY)}
        return capture_probability(
            problem,
            disturbance=disturbance or settings.disturbance,
            rollouts=settings.rollouts,
            seed=seed,
            threads=threads,
            **wanted | keywords,
        )
    chosen = {name: getattr(settings, name) for name in settings_of(metric)} | {"seed": seed}
    if metric_kind(metric) is KINDS["effort"]:
        objects = "any" if metric.endswith(ANY) else "all"
        planner = metric.split("/")[1]
        return escape_effort(problem, planner=planner, captured=objects, **chosen, **keywords)
    return capture_score(problem, **chosen, **keywords)


def value_of(metric: str, found: Found) -> float:
    """What a metric is of what `metric_search` found for it."""
    if isinstance(found, EscapeEffort):
        return found.effort
    if isinstance(found, ForceScore):
        return found.force
    if isinstance(found, CaptureScore):
        return float(getattr(found, metric.replace("/", "_")))
    of_metric = {"probability/success": found.success, "probability/any": found.any}
    value: Any = of_metric.get(metric, found)
    return float(value if isinstance(value, float) else value.captured)


def _seed(metric: str, settings: SearchSettings, number: int | None) -> int:
    """Of the search of a batch's problem of this number."""
    common = settings.common_random_numbers and metric in TIMED
    return settings.seed if number is None or common else stream(settings.seed, number)
