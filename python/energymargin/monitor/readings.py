"""What a monitor says of one state, and of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from energymargin._core import CaptureProbability

__all__ = ["Counters", "Reading", "slope"]


@dataclass(frozen=True)
class Reading:
    """The score of one state of a stream."""

    time: float
    """Of the state, as it was pushed [s]."""
    value: float
    """Probability of staying captured over the problem's horizon; NaN with an `error`, or if more
    than one of its rollouts and more than 1 % of them diverged."""
    interval: tuple[float, float]
    """95 % interval of the value."""
    rollouts: int
    """How many the value is of, without those that diverged."""
    trend: float
    """Slope of the values over the monitor's `trend_window` [1/s]; NaN with fewer than two."""
    alarm: bool
    """Whether the alarm is on."""
    lateness: float
    """From the push to the reading [s], by the machine's clock."""
    late: bool
    """Whether that is more than the monitor's `period`."""
    probability: CaptureProbability | None = field(default=None, repr=False)
    """All that is known, as its curve; None with an `error`."""
    error: Exception | None = None
    """Why the state has no value: what `problem_of` or the score raised."""

    @property
    def diverged(self) -> int:
        """Rollouts that diverged, which do not count."""
        return 0 if self.probability is None else self.probability.diverged


class Counters(NamedTuple):
    """States of a stream since it began."""

    pushed: int
    scored: int
    dropped: int
    """Left out for newer ones, or by `reset` and `close`."""
    late: int
    """Scored, but later than a period after their push."""
    failed: int
    """Without a value."""


def slope(times: Sequence[float], values: Sequence[float]) -> float:
    """Of the line of least squares through values at times [s]; NaN of fewer than two times."""
    t, y = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 2 or np.ptp(t) == 0:
        return float("nan")
    t = t - t.mean()
    return float(t @ (y - y.mean()) / (t @ t))
