"""A state's search tree grown again, as it was for the scores in the file: the same problem, nodes
and seed give the same bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energymargin import tasks
from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    Problem,
    capture_probability,
    capture_score,
    disturbances,
    escape_effort,
    force_score,
    stream,
)
from energymargin.datasets import Dataset, Future
from energymargin.metrics import ANY, TIMED
from energymargin.settings import SearchSettings
from energymargin.tasks.base import plane_of

__all__ = ["Grower", "Grown"]


@dataclass(frozen=True)
class Grown:
    """A state's problem, the search for one of its scores, and that score."""

    problem: Problem
    search: CaptureScore | EscapeEffort | CaptureProbability | None
    """None for the force score, which needs no search."""
    score: float


class Grower:
    """Grows the searches of a dataset's states, each once."""

    def __init__(
        self, dataset: Dataset, settings: dict[str, Any], future: Future | None = None
    ) -> None:
        """`settings` and `future`: of the run. Raises ValueError if the settings are not those of a
        search, or if the task cannot be made."""
        try:
            self._settings = SearchSettings(**settings)
        except TypeError:
            raise ValueError(
                f"the run's settings are those of another program: {settings}"
            ) from None
        self._dataset, self._future = dataset, future
        self.plane = plane_of(tasks.make(dataset.task, **dataset.parameters))
        """In which pictures show the task."""
        self._kept: dict[tuple[int, str], tuple[Problem, Any]] = {}

    def grow(self, number: int, metric: str) -> Grown:
        """The search behind a metric of the state of this number. Raises ValueError if its problem
        cannot be made."""
        kind = _kind(metric)
        if (number, kind) not in self._kept:
            (problem,) = self._dataset.problems([number], self._future)
            self._kept[number, kind] = problem, self._search(problem, number, metric)
        problem, found = self._kept[number, kind]
        if kind in TIMED:
            return Grown(problem, found, _probability(found, metric))
        if kind == "force":
            return Grown(problem, None, found.force)
        if kind == "tree":
            return Grown(problem, found, getattr(found, metric.replace("/", "_")))
        return Grown(problem, found, found.effort)

    def _search(self, problem: Problem, number: int, metric: str) -> Any:
        """As a scorer of the file does it."""
        settings = self._settings
        grown: dict[str, Any] = {"nodes": settings.nodes, "seed": stream(settings.seed, number)}
        kind = _kind(metric)
        if kind in TIMED:
            return capture_probability(
                problem,
                disturbance=disturbances.Uniform(settings.strength, settings.objects),
                rollouts=settings.rollouts,
                seed=settings.seed if settings.common_random_numbers else grown["seed"],
                success=metric == "probability/success",
                by_object=metric == "probability/any",
            )
        if kind == "force":
            return force_score(problem)
        if kind == "tree":
            return capture_score(
                problem,
                **grown,
                nodes_per_edge=settings.nodes_per_edge,
                least_likelihood=settings.least_likelihood,
                warn=False,
            )
        return escape_effort(
            problem,
            planner=metric.split("/")[1],
            **grown,
            captured="any" if metric.endswith(ANY) else "all",
            search=settings.search,
            stop_at_escape=settings.stop_at_escape,
        )


def _kind(metric: str) -> str:
    """Metrics of one kind have one search."""
    if metric.startswith("effort") or metric in TIMED:
        return metric
    return "force" if metric.startswith("force") else "tree"


def _probability(found: CaptureProbability, metric: str) -> float:
    """What a metric is of what `_search` found for it."""
    if metric == "probability/success":
        assert found.success is not None  # it was asked for
        return found.success
    survival = found.any if metric == "probability/any" else None
    return found.captured if survival is None else survival.captured
