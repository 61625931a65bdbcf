"""How the scores of a stream are made, and whether two streams are made alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from energymargin.base.checks import positive_number, require, shown, whole_number
from energymargin.disturbances import Disturbance, Uniform, text_of

SHARE = 0.7  # of a period that a score takes; the rest is for what else the machine does
MEMORY = 0.8  # of the mean cost, from one score to the next
FASTEST = 2.0  # times as many rollouts as before, at most

Rollouts = int | tuple[int, int]


class Pace:
    """The number of rollouts of the next score: fixed, or as many as fit into a period.

    It is chosen before a score begins, from what those before it took. A score that was cut short
    in its course would count too few of the rollouts that last long, those that stay captured.
    """

    def __init__(self, rollouts: Rollouts, period: float) -> None:
        """`rollouts`: a number, or the least and the most; `period` [s].

        Raises ValueError on others.
        """
        self._least, self._most = _checked_rollouts(rollouts)
        self._budget = SHARE * period
        self._cost: float | None = None  # s, of a rollout, a running mean
        self.rollouts = self._least
        """Number of rollouts of the next score."""

    def note(self, rollouts: int, asking: float, scoring: float) -> None:
        """What a score took [s]: `asking` for the problem, and `scoring` its `rollouts`."""
        cost = scoring / max(rollouts, 1)
        mean = cost if self._cost is None else MEMORY * self._cost + (1 - MEMORY) * cost
        self._cost = mean
        fitting = int(max(self._budget - asking, 0.0) / max(mean, cost, 1e-9))
        wanted = min(fitting, int(FASTEST * self.rollouts))
        self.rollouts = min(max(wanted, self._least), self._most)


@dataclass(frozen=True)
class Conditions:
    """How the scores of a stream are made: a threshold from such scores holds for others like them.

    Raises ValueError on what cannot be.
    """

    rollouts: Rollouts
    """Rollouts of each score, as in Monitor."""
    horizon: float
    """Horizon of each question [s]."""
    period: float
    """Time between two states [s]."""
    disturbance: Any = None
    """Disturbance, as in `capture_probability`; None: Uniform()."""

    def __post_init__(self) -> None:
        """Checks them."""
        _checked_rollouts(self.rollouts)
        positive_number("horizon", self.horizon)
        positive_number("period", self.period)

    def require(self, rollouts: Rollouts, period: float, disturbance: Any) -> None:
        """Raises ValueError unless a monitor's scores are made like these."""
        self._require("rollouts", rollouts, rollouts == self.rollouts)
        self._require("period", period, _same(period, self.period))
        alike = _is_same_disturbance(disturbance, self.disturbance)
        self._require("disturbance", disturbance, alike)

    def require_horizon(self, horizon: float | None) -> None:
        """Raises ValueError unless a question's horizon [s] is this one."""
        alike = horizon is not None and _same(horizon, self.horizon)
        self._require("horizon", horizon, alike, of="the problem's ")

    def _require(self, name: str, value: Any, alike: bool, of: str = "") -> None:
        if not alike:
            holds = f"but the alarm's threshold holds for {shown(getattr(self, name))}"
            way = f"take that, or calibrate a threshold with scores of {shown(value)}"
            raise ValueError(f"{of}{name} is {shown(value)}, {holds}: {way}")


def _same(first: float, second: float) -> bool:
    """Whether two times [s] are equal, but for their last digits."""
    return math.isclose(first, second, rel_tol=1e-6)


def _is_same_disturbance(first: Any, second: Any) -> bool:
    """Models are the same that say the same, functions that are one."""
    first, second = (Uniform() if one is None else one for one in (first, second))
    if isinstance(first, Disturbance) and isinstance(second, Disturbance):
        return text_of(first) == text_of(second)
    return first is second or bool(first == second)


def _checked_rollouts(rollouts: Rollouts) -> tuple[int, int]:
    """(least, most) of a number of rollouts, or of these two; ValueError on others."""
    ends = rollouts if isinstance(rollouts, tuple) else (rollouts, rollouts)
    require(len(ends) == 2, "rollouts", rollouts, "a number, or (least, most)")
    least = whole_number("rollouts", ends[0], 1)
    return least, whole_number("rollouts", ends[1], least)
