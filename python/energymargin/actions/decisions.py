"""What a guard decided, and how often."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.monitor import Reading
from energymargin.reprs import short_repr

__all__ = ["Decision", "GuardCounters", "Reason", "Source"]

Source = Literal["policy", "candidate", "fallback"]
Reason = Literal["fine", "alarm", "unknown"]


@dataclass(frozen=True, eq=False)
class Decision:
    """One decision of a guard."""

    __repr__ = short_repr

    time: float
    """Of the state [s]."""
    source: Source
    """Whose action it is."""
    reason: Reason
    """Why: the alarm is off ("fine") or on ("alarm"), or the margin is "unknown": no reading, one
    without a value, or one too old; or the policy's action is not finite."""
    action: Any = field(repr=False)
    """The action that the guard returned."""
    reading: Reading | None = field(repr=False)
    """The monitor's, on which it was decided; None if there was none yet."""
    probabilities: NDArray[np.float64] = field(repr=False)
    """Of the policy's action, the candidates, and last the fallback's if there is one; NaN of those
    that were not asked, or of which too many rollouts diverged. Shape (k,), (0,) if none was
    asked."""
    rollouts: int = 0
    """Spent on the actions, without the monitor's."""
    diverged: int = 0
    """Of these, those that diverged and do not count."""
    error: Exception | None = None
    """Why the actions have no probabilities, or what of the policy's action is not finite."""


class GuardCounters(NamedTuple):
    """Decisions since the guard began."""

    decisions: int
    policy: int
    """By source: the policy's action was taken."""
    candidate: int
    fallback: int
    alarm: int
    """By reason: the alarm was on."""
    unknown: int
    rollouts: int
    """Spent on actions, without the monitor's."""

    def after(self, decision: Decision) -> GuardCounters:
        """With one decision more."""
        return GuardCounters(
            self.decisions + 1,
            self.policy + (decision.source == "policy"),
            self.candidate + (decision.source == "candidate"),
            self.fallback + (decision.source == "fallback"),
            self.alarm + (decision.reason == "alarm"),
            self.unknown + (decision.reason == "unknown"),
            self.rollouts + decision.rollouts,
        )
