"""Problems that are to be scored, chunks of them on a worker, and rows of their scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem, ScoreRun
from energymargin.metrics import METRICS
from energymargin.parallel import POLL
from energymargin.searches import SearchSettings

__all__ = ["PlainRow", "Row", "Work", "score_chunk"]

Curve = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times [s] and the probability until each, (T,)."""


class Row(Protocol):
    """The scores of one problem."""

    @property
    def index(self) -> int:
        """The problem's stream index."""
        ...

    @property
    def scores(self) -> dict[str, float]:
        """By metric."""
        ...

    @property
    def times(self) -> dict[str, float]:
        """By metric: computing time [s]; of metrics that share a search, at the first alone."""
        ...

    @property
    def seconds(self) -> float:
        """Computing time of all of them [s]."""
        ...

    @property
    def curves(self) -> Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """By metric, of those that have one: times [s] and the probability until each, (T,)."""
        ...

    @property
    def steps(self) -> int:
        """Simulation steps of all of them."""
        ...

    @property
    def unconverged(self) -> int:
        """Of these, steps whose contact solver did not converge."""
        ...

    @property
    def lost_time(self) -> float:
        """Time in which nothing moved, as bodies would have passed through each other [s]."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the scores."""
        ...

    @property
    def error(self) -> str | None:
        """What went wrong, or None."""
        ...


@dataclass(frozen=True, eq=False)
class PlainRow:
    """A Row that is not of a search here: of a problem that could not be scored, or of scores from
    elsewhere."""

    index: int
    scores: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    error: str | None = None
    steps: int = 0
    unconverged: int = 0
    lost_time: float = 0.0
    warnings: tuple[str, ...] = ()
    curves: dict[str, Curve] = field(default_factory=dict)

    @property
    def times(self) -> dict[str, float]:
        """The first score has all of the time."""
        return dict.fromkeys(list(self.scores)[:1], self.seconds)


@dataclass(frozen=True)
class Work:
    """One problem, and the metrics that are asked for. It is pickled as JSON."""

    index: int
    """The problem's stream index."""
    problem: Problem
    metrics: tuple[str, ...]
    written: str | None = None
    """The problem as JSON, if it is known already."""

    @cached_property
    def text(self) -> str:
        """The problem as JSON; ValueError for a region made of a user's own predicate."""
        return self.problem.to_json() if self.written is None else self.written

    def __reduce__(self) -> tuple[Any, ...]:
        """How to make it where it is unpickled."""
        try:
            return _read, (self.index, self.text, self.metrics)
        except ValueError as error:
            raise ValueError(f"problem {self.index}: {error}") from error


def _read(index: int, text: str, metrics: tuple[str, ...]) -> Work:
    return Work(index, Problem.from_json(text), metrics)


def score_chunk(settings: SearchSettings, work: Sequence[Work], cancel: Cancel) -> Sequence[Row]:
    """The rows of a chunk, on one thread; once it is cancelled, those that are finished."""
    run = ScoreRun(list(METRICS), threads=1, **settings.all())
    for metrics, group in groupby(work, key=lambda one: one.metrics):
        same = list(group)
        run.add([one.problem for one in same], [one.index for one in same], list(metrics))
    rows: list[Row] = []
    while not (run.finished or cancel.is_set):
        rows += run.take(POLL)
    run.cancel()
    return [*rows, *run.take(0)]
