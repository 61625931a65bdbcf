"""A state's search tree grown again, as it was for the scores in the file: the same problem, nodes
and seed give the same bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energymargin import tasks
from energymargin._core import (
    CaptureScore,
    EscapeEffort,
    Problem,
    capture_score,
    escape_effort,
    force_score,
    stream,
)
from energymargin.datasets import Dataset
from energymargin.metrics import ANY
from energymargin.settings import SearchSettings
from energymargin.tasks.base import plane_of

__all__ = ["Grower", "Grown"]


@dataclass(frozen=True)
class Grown:
    """A state's problem, the search for one of its scores, and that score."""

    problem: Problem
    search: CaptureScore | EscapeEffort | None
    """None for the force score, which needs no search."""
    score: float


class Grower:
    """Grows the searches of a dataset's states, each once."""

    def __init__(self, dataset: Dataset, settings: dict[str, Any]) -> None:
        """`settings`: of the run. Raises ValueError if they are not those of a search, or if the
        task cannot be made."""
        try:
            self._settings = SearchSettings(**settings)
        except TypeError:
            raise ValueError(
                f"the run's settings are those of another program: {settings}"
            ) from None
        self._dataset = dataset
        self.plane = plane_of(tasks.make(dataset.task, **dataset.parameters))
        """In which pictures show the task."""
        self._kept: dict[tuple[int, str], tuple[Problem, Any]] = {}

    def grow(self, number: int, metric: str) -> Grown:
        """The search behind a metric of the state of this number. Raises ValueError if its problem
        cannot be made."""
        kind = _kind(metric)
        if (number, kind) not in self._kept:
            (problem,) = self._dataset.problems([number])
            self._kept[number, kind] = problem, self._search(problem, number, metric)
        problem, found = self._kept[number, kind]
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
            metric.split("/")[1],
            **grown,
            captured="any" if metric.endswith(ANY) else "all",
            sampling="uniform",
            shorten=False,
            stop_at_escape=settings.stop_at_escape,
        )


def _kind(metric: str) -> str:
    """Metrics of one kind have one search."""
    if metric.startswith("effort"):
        return metric
    return "force" if metric.startswith("force") else "tree"
