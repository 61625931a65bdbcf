"""From settings to the search behind one metric of one problem: the only place.

`em.score` does the same for many problems and keeps their scores alone. Who also wants a tree, a
path or rollouts asks here, so that a state with the same settings has the same bits everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict

import energymargin._core as core
from energymargin.base import checks
from energymargin.base.metrics import (
    ANY,
    CLOCKLESS,
    KINDS,
    LEAST_EFFORT,
    METRICS,
    TIMED,
    check_metrics,
    metric_kind,
    settings_of,
)
from energymargin.base.settings import setting
from energymargin.disturbances import Disturbance, Uniform

if TYPE_CHECKING:
    from typing_extensions import Unpack

ALGORITHM = "0.15.4"
"""The version of energymargin since which the same settings give the same bits. A change that moves
any score sets it to the version that has the change, together with the golden values."""

ALGORITHM_IMPROVED = "0.15.4"
"""The version since which the metrics of LEAST_EFFORT have the same bits: more changes may move
them than the others."""

MOST_NODES = 10**9

# Settings that came later: with these values, a question is the one that it was without them.
LATER: dict[str, Any] = {"strength": 1.0, "objects": None, "common_random_numbers": False}


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the searches and rollouts behind the scores. Raises ValueError on bad values."""

    nodes: int = setting(1000, "Nodes of each search tree: more make scores finer, and slower.")
    """Nodes of each search tree."""
    seed: int = setting(0, "The same seed gives the same numbers, to the last bit.")
    """Each problem has a stream of its own: the tree of problem i has the seed stream(seed, i)."""
    nodes_per_edge: int = setting(
        1,
        "Capture and success: the most states of a rollout that are nodes. More of them take "
        "fewer rollouts.",
    )
    """Most nodes of a rollout in the trees of capture and success, as in `capture_score`."""
    least_likelihood: float = setting(
        0.0,
        "Capture and success: a rollout ends where its likelihood falls to this share of the "
        "root's.",
    )
    """Likelihood at which a rollout ends, as a share of the root's, as in `capture_score`."""
    stop_at_escape: bool = setting(
        False, "Efforts: a rollout ends where it is seen outside of the capture set."
    )
    """Whether rollouts of the efforts end at an escape, as in `escape_effort`."""
    rollouts: int = setting(30, "Rollouts of each probability: more make its interval narrower.")
    """Rollouts of each probability, as in `capture_probability`."""
    strength: float = setting(
        1.0, "Strength of the probabilities' disturbance, a share of the task's bounds.", shown="1"
    )
    """Strength of the disturbance of the probabilities, as in `em.disturbances.Uniform`."""
    objects: int | None = setting(None, "Objects that are disturbed at a time; all if not given.")
    """Number of objects that the disturbance meets at a time; None: all."""
    common_random_numbers: bool = setting(
        False,
        "All states meet the same disturbances (common random numbers), to be compared.",
        flag="--common",
    )
    """Whether every problem draws the disturbances of its probability from the seed itself, and not
    from its own stream, so that problems are compared under the same disturbances."""

    def __post_init__(self) -> None:
        """Checks each of them, and brings it to one type, so that stores know 0 and 0.0 as one."""
        counts = ["nodes", "nodes_per_edge", "rollouts", *["objects"] * (self.objects is not None)]
        check: dict[str, Callable[[str, Any], Any]] = {
            **dict.fromkeys(counts, partial(checks.whole_number, least=1, most=MOST_NODES)),
            **dict.fromkeys(("stop_at_escape", "common_random_numbers"), checks.yes_or_no),
            "seed": lambda _, seed: checks.seed_number(seed),
            "least_likelihood": checks.share,
            "strength": checks.not_negative_number,
        }
        for name, checked in check.items():
            object.__setattr__(self, name, checked(name, getattr(self, name)))

    def of(self, metric: str) -> dict[str, Any]:
        """Those that change the value of one metric, by which stores know its question."""
        known = [(name, getattr(self, name)) for name in settings_of(metric)]
        return {name: own for name, own in known if name not in LATER or own != LATER[name]}

    @property
    def disturbance(self) -> Uniform:
        """The disturbance of the probabilities."""
        return Uniform(self.strength, self.objects)

    def all(self) -> dict[str, Any]:
        """All of them, by name."""
        return asdict(self)


class LooseSettings(TypedDict, total=False):
    """The fields of SearchSettings as keywords of a function."""

    nodes: int
    seed: int
    nodes_per_edge: int
    least_likelihood: float
    stop_at_escape: bool
    rollouts: int
    strength: float
    objects: int | None
    common_random_numbers: bool


def chosen_settings(
    settings: SearchSettings | None, **loose: Unpack[LooseSettings]
) -> SearchSettings:
    """`settings`, or those that are given one by one; ValueError on both, or on bad values."""
    if settings is None:
        return SearchSettings(**loose)
    if not isinstance(settings, SearchSettings):
        raise ValueError(f"settings is {settings!r}, expected SearchSettings(...)")
    if loose:
        text = f"settings and {next(iter(loose))} are given, expected one of them"
        raise ValueError(f"{text}: dataclasses.replace(settings, ...) changes some")
    return settings


def algorithm_of(metric: str) -> str:
    """The version of energymargin since which a metric of the same settings has the same bits."""
    return ALGORITHM_IMPROVED if metric in LEAST_EFFORT else ALGORITHM


def algorithm() -> str:
    """ALGORITHM and ALGORITHM_IMPROVED, as a worker elsewhere is asked for them."""
    return ALGORITHM if ALGORITHM == ALGORITHM_IMPROVED else f"{ALGORITHM}/{ALGORITHM_IMPROVED}"


Found = core.CaptureScore | core.EscapeEffort | core.ForceScore | core.CaptureProbability


def metric_search(
    problem: core.Problem,
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
        return core.force_score(problem)
    common = settings.common_random_numbers and metric in TIMED
    seed = settings.seed if number is None or common else core.stream(settings.seed, number)
    if metric in TIMED:
        wanted = {"success": metric == "probability/success", "by_object": metric.endswith(ANY)}
        return core.capture_probability(
            problem,
            disturbance=disturbance or settings.disturbance,
            rollouts=settings.rollouts,
            seed=seed,
            threads=threads,
            **wanted | keywords,
        )
    chosen = {name: getattr(settings, name) for name in settings_of(metric)} | {"seed": seed}
    if metric_kind(metric) is KINDS["effort"]:
        chosen["captured"] = "any" if metric.endswith(ANY) else "all"
        if metric not in LEAST_EFFORT:
            chosen |= {"planner": metric.split("/")[1], "search": "published"}
        return core.escape_effort(problem, **chosen, **keywords)
    return core.capture_score(problem, **chosen, **keywords)


def value_of(metric: str, found: Found) -> float:
    """What a metric is of what `metric_search` found for it."""
    if isinstance(found, core.EscapeEffort):
        return found.effort
    if isinstance(found, core.ForceScore):
        return found.force
    if isinstance(found, core.CaptureScore):
        return float(getattr(found, metric.replace("/", "_")))
    of_metric = {"probability/success": found.success, "probability/any": found.any}
    value: Any = of_metric.get(metric, found)
    return float(value if isinstance(value, float) else value.captured)


def metrics_of(problems: Sequence[core.Problem]) -> tuple[str, ...]:
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


def chosen_metrics(
    problems: Sequence[core.Problem],
    metrics: Sequence[str] | None,
    settings: SearchSettings | None = None,
) -> Sequence[str]:
    """`metrics`, or for None all that the problems have.

    Raises ValueError on an unknown one, or none, and on one that the problems lack, or do not have
    with these settings.
    """
    strange = [problem for problem in problems if not isinstance(problem, core.Problem)]
    if strange:
        raise ValueError(f"problems has {strange[0]!r}, expected Problems alone")
    there = metrics_of(problems)
    lacking = [metric for metric in metrics or () if metric in METRICS and metric not in there]
    if lacking:
        timed = lacking[0] in TIMED
        others = [problem for problem in problems if (problem.horizon is None) == timed]
        if lacking[0] in (*TIMED, *CLOCKLESS) and others:
            has = "has a" if timed else "is without"
            way = "horizon=..." if timed else "horizon=None, plan=None"
            text = f"metrics has {lacking[0]!r}, but not every problem {has} horizon"
            raise ValueError(f"{text}: problem.replace({way})")
        of_each = " for each object" if lacking[0].endswith(ANY) else ""
        kind = "success" if lacking[0].startswith("success") else "capture"
        text = f"metrics has {lacking[0]!r}, but not every problem has a {kind} set{of_each}"
        raise ValueError(text)
    chosen = there if metrics is None else metrics
    check_metrics(chosen)
    if settings is not None:
        _require_objects(problems, chosen, settings)
    return chosen


def _require_objects(
    problems: Iterable[core.Problem], metrics: Sequence[str], settings: SearchSettings
) -> None:
    """Raises ValueError if a disturbance is to meet more objects than a problem has."""
    if settings.objects is None or not set(metrics) & set(TIMED):
        return
    for problem in problems:
        there = sum(body.role == "object" for body in problem.scene.bodies)
        if settings.objects > there:
            text = f"objects is {settings.objects}, expected from 1 to the scene's {there}"
            raise ValueError(text)
