"""The scores of many problems as a table, and the error that has those that could be computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from energymargin.errors import EnergyMarginError
from energymargin.executors import Row
from energymargin.notebook import shown_by
from energymargin.reprs import short_repr

__all__ = ["ScoreError", "ScoreTable", "score_table"]


@dataclass(frozen=True, eq=False)
class ScoreTable:
    """One row a problem: `table["capture"]` is the capture score of each, shape (N,)."""

    _repr_html_ = shown_by("score_table")
    __repr__ = short_repr

    index: NDArray[np.int64]
    """Which problem, shape (N,), rising."""
    seconds: NDArray[np.float64]
    """Computing time of each, that of its searches on their threads added up [s], shape (N,)."""
    scores: dict[str, NDArray[np.float64]]
    """By metric, (N,): capture, success in 0..1; effort [J], inf if there is no escape; force."""
    steps: NDArray[np.int64]
    """Simulation steps of each, shape (N,)."""
    unconverged: NDArray[np.int64]
    """Of these, steps whose contact solver did not converge, shape (N,)."""
    lost_time: NDArray[np.float64]
    """Time of each in which nothing moved, as bodies would have passed through each other [s],
    shape (N,)."""
    warnings: dict[int, tuple[str, ...]] = field(default_factory=dict)
    """What speaks against the scores of a problem, by its index."""
    complete: bool = True
    """Whether every problem is there: False if the timeout or the cancel came first."""

    def __len__(self) -> int:
        """How many problems."""
        return len(self.index)

    def __getitem__(self, metric: str) -> NDArray[np.float64]:
        """The scores of one metric, shape (N,); KeyError if it was not computed."""
        if metric not in self.scores:
            raise KeyError(f"{metric!r} was not computed; there are: {', '.join(self.scores)}")
        return self.scores[metric]

    def to_rows(self) -> list[dict[str, float]]:
        """One dictionary a problem: index, seconds, the counts of steps, and each metric."""
        columns = {
            "index": self.index,
            "seconds": self.seconds,
            "steps": self.steps,
            "unconverged": self.unconverged,
            "lost_time": self.lost_time,
            **self.scores,
        }
        names = list(columns)
        return [
            dict(zip(names, row, strict=True))
            for row in zip(*(c.tolist() for c in columns.values()), strict=True)
        ]


class ScoreError(EnergyMarginError, ValueError):
    """Some problems could not be scored."""

    def __init__(self, errors: dict[int, str], problems: int, table: ScoreTable | None = None):
        """`errors`: what went wrong, by the problem's index; `table`: those that could, if there
        is no store that has them."""
        first = min(errors)
        many = f"{len(errors)} of {problems} problems could not be scored"
        super().__init__(f"{many}; problem {first}: {errors[first]}")
        self.errors = errors
        self.table = table


def score_table(rows: Iterable[Row], metrics: Sequence[str], *, complete: bool) -> ScoreTable:
    """The table of these rows, by rising index."""
    rows = sorted(rows, key=lambda row: row.index)
    return ScoreTable(
        index=np.array([row.index for row in rows], dtype=np.int64),
        seconds=np.array([row.seconds for row in rows], dtype=float),
        scores={m: np.array([row.scores[m] for row in rows], dtype=float) for m in metrics},
        steps=np.array([row.steps for row in rows], dtype=np.int64),
        unconverged=np.array([row.unconverged for row in rows], dtype=np.int64),
        lost_time=np.array([row.lost_time for row in rows], dtype=float),
        warnings={row.index: row.warnings for row in rows if row.warnings},
        complete=complete,
    )
