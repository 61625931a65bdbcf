"""What an executor is: it takes problems on, and gives their scores as they are done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem
from energymargin.executors.pool import Pool
from energymargin.searches import SearchSettings

__all__ = ["Executor", "Failed", "Pace", "Row", "Session", "Work"]


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


@dataclass(frozen=True)
class Failed:
    """The row of a problem that could not be scored."""

    index: int
    error: str
    seconds: float = 0.0
    steps: int = 0
    unconverged: int = 0
    lost_time: float = 0.0
    warnings: tuple[str, ...] = ()

    @property
    def scores(self) -> dict[str, float]:
        """There are none."""
        return {}

    @property
    def times(self) -> dict[str, float]:
        """There are none."""
        return {}

    @property
    def curves(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """There are none."""
        return {}


@dataclass(frozen=True)
class Work:
    """One problem, and the metrics that are asked for."""

    index: int
    """The problem's stream index."""
    problem: Problem
    metrics: tuple[str, ...]
    written: str | None = None
    """The problem as JSON, if it is known already."""

    @property
    def text(self) -> str:
        """The problem as JSON; ValueError for a region made of a user's own predicate."""
        return self.problem.to_json() if self.written is None else self.written


class Session(Protocol):
    """An executor at work. Use it in a `with` statement, at whose end all that runs is dropped."""

    def room(self) -> int:
        """How many more problems keep its workers busy; 0 if it has enough."""
        ...

    def add(self, work: Sequence[Work]) -> None:
        """Takes on these problems."""
        ...

    @property
    def pending(self) -> int:
        """Problems that were added and whose rows were not taken yet."""
        ...

    def take(self, timeout: float) -> Sequence[Row]:
        """Rows that came since the last call; waits up to `timeout` [s] for the first."""
        ...

    def stop(self) -> Sequence[Row]:
        """Ends what runs within 0.1 s, and takes the rows that are finished."""
        ...

    def __enter__(self) -> Session:
        """The session itself."""
        ...

    def __exit__(self, *error: object) -> None:
        """Drops all that runs."""
        ...


class Executor(Protocol):
    """Where problems are scored: `Threads`, `Processes` or `Dask`."""

    def pool(self) -> Pool:
        """Starts its workers, for jobs of any kind."""
        ...

    def session(self, settings: SearchSettings) -> Session:
        """Starts its workers."""
        ...


class Pace:
    """How long a problem takes, from those that were scored last."""

    _WEIGHT = 0.2  # of the newest

    def __init__(self) -> None:
        """Nothing is known yet."""
        self._seconds: float | None = None

    def saw(self, problems: int, seconds: float) -> None:
        """One worker took `seconds` for so many problems."""
        if problems > 0:
            newest = seconds / problems
            old = newest if self._seconds is None else self._seconds
            self._seconds = old + self._WEIGHT * (newest - old)

    def problems(self, seconds: float, most: int) -> int:
        """How many problems one worker scores in this time [s], from 1 (before anything is known)
        to `most`."""
        if self._seconds is None:
            return 1
        return max(1, min(most, int(seconds / max(self._seconds, 1e-9))))
