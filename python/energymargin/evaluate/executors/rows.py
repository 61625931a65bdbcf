"""Problems that are to be scored, chunks of them on a worker, and rows of their scores."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import groupby
from typing import Any

from energymargin._core import Cancel, Problem, ScoreRow, ScoreRun
from energymargin.base.aliases import Floats
from energymargin.base.metrics import KINDS, METRICS, metric_kind
from energymargin.base.reprs import Record
from energymargin.evaluate.divergence import MOST
from energymargin.evaluate.parallel import POLL
from energymargin.evaluate.searches import SearchSettings

Curve = tuple[Floats, Floats]
"""Times [s] and the probability until each, (T,)."""


@dataclass(frozen=True, eq=False, repr=False)
class Row(Record):
    """The scores of one problem."""

    index: int
    """The problem's stream index."""
    scores: dict[str, float] = field(default_factory=dict)
    """By metric; of a belief the means."""
    times: dict[str, float] = field(default_factory=dict)
    """By metric: computing time [s]; of metrics that share a search, at the first alone."""
    curves: Mapping[str, Curve] = field(default_factory=dict)
    """By metric, of those that have one."""
    steps: int = 0
    """Simulation steps of all of them."""
    unconverged: int = 0
    """Simulation steps whose contact solver did not converge."""
    lost_time: float = 0.0
    """Time in which nothing moved, as bodies would have passed through each other [s]."""
    diverged: int = 0
    """Rollouts of all of them that diverged."""
    warnings: tuple[str, ...] = ()
    """What speaks against the scores."""
    error: str | None = None
    """What went wrong, or None."""
    particles: Mapping[str, Floats] = field(default_factory=dict)
    """By metric, of a belief alone: the scores of its N particles, shape (N,)."""

    @property
    def seconds(self) -> float:
        """Computing time of all of them [s]."""
        return sum(self.times.values(), 0.0)


def counts(rows: Sequence[Row]) -> dict[str, Any]:
    """What rows count, added up, and what speaks against any of them."""
    added = {name: sum(getattr(row, name) for row in rows) for name in _COUNTS}
    return added | {"warnings": tuple(dict.fromkeys(text for row in rows for text in row.warnings))}


_COUNTS = ("steps", "unconverged", "lost_time", "diverged")
_SEARCHED = [one.name for one in fields(Row) if one.name != "particles"]


@dataclass(frozen=True)
class Work:
    """One problem, and the metrics that are asked for."""

    index: int
    """The problem's stream index."""
    problem: Problem
    metrics: tuple[str, ...]

    def __len__(self) -> int:
        """How many searches its metrics take."""
        return sum(map(len, self.searches()))

    def searches(self) -> Iterator[list[Work]]:
        """It in parts of a search each. Metrics of a kind share one, but for efforts; the force
        score takes no time, and goes with the first."""
        searches: dict[str, list[str]] = {}
        for metric in sorted(self.metrics, key=lambda one: metric_kind(one) is KINDS["force"]):
            kind = metric_kind(metric)
            if kind is KINDS["force"] and searches:
                next(iter(searches.values())).append(metric)
            else:
                name = metric if kind in (None, KINDS["effort"]) else kind.title
                searches.setdefault(name, []).append(metric)
        yield [Work(self.index, self.problem, tuple(one)) for one in searches.values()]

    def row(self, rows: Sequence[Row]) -> Row:
        """The row of its searches; its error is that of the first that has one."""
        for row in rows:
            if row.error:
                return row
        named: dict[str, Any] = {
            name: {metric: value for row in rows for metric, value in getattr(row, name).items()}
            for name in ("scores", "times", "curves")
        }
        return Row(self.index, **named, **counts(rows))

    def __reduce__(self) -> tuple[Any, ...]:
        """How to make it where it is unpickled; ValueError for a user's own predicate, and for a
        policy whose code cannot go there."""
        try:
            return _read, (self.index, pickle.dumps(self.problem), self.metrics)
        except ValueError as error:
            raise ValueError(f"problem {self.index}: {error}") from error


def _read(index: int, problem: bytes, metrics: tuple[str, ...]) -> Work:
    return Work(index, pickle.loads(problem), metrics)


def score_chunk(
    settings: SearchSettings, work: Sequence[Work], cancel: Cancel, *, most_diverged: float = MOST
) -> Sequence[Row]:
    """The rows of a chunk, on one thread; once it is cancelled, those that are finished. A
    probability of which more than this share of the rollouts diverge is an error."""
    run = ScoreRun(list(METRICS), threads=1, most_diverged=most_diverged, **settings.all())
    for metrics, group in groupby(work, key=lambda one: one.metrics):
        same = list(group)
        run.add([one.problem for one in same], [one.index for one in same], list(metrics))
    rows: list[ScoreRow] = []
    while not (run.finished or cancel.is_set):
        rows += run.take(POLL)
    run.cancel()
    rows += run.take(0)
    return [Row(**{name: getattr(row, name) for name in _SEARCHED}) for row in rows]
