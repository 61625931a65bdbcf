"""What is known of the states of a stream: a reading of each that was scored, and counts of all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from energymargin._core import CaptureProbability


@dataclass(frozen=True)
class Reading:
    """The score of one state of a stream."""

    time: float
    """Time of the state, as it was pushed [s]."""
    value: float
    """Probability of staying captured, or in the success set, over the problem's horizon; NaN with
    an `error`, or if more than one of its rollouts and more than 1 % of them diverged."""
    interval: tuple[float, float]
    """95 % interval of the value."""
    rollouts: int
    """Number of rollouts behind the value, without those that diverged; 0 of a first look."""
    trend: float
    """Slope of the values over the monitor's `trend_window` [1/s]; NaN with fewer than two."""
    alarm: bool
    """Whether the alarm is on."""
    lateness: float
    """From the push to the reading [s], by the machine's clock."""
    late: bool
    """Whether that is more than the monitor's `period`."""
    probability: CaptureProbability | None = field(default=None, repr=False)
    """The probability with its curve over time; None with an `error`, and of a first look."""
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
    foreseen: int = 0
    """Scored by the first look alone."""
    refused: int = 0
    """Unlike the states that the first look learned from, and left to rollouts."""
