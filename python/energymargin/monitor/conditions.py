"""How the scores of a stream are made, and whether two streams are made alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from energymargin import disturbances
from energymargin.arguments import shown
from energymargin.checks import positive_number
from energymargin.monitor.pace import checked_rollouts

__all__ = ["Conditions"]

Rollouts = int | tuple[int, int]


@dataclass(frozen=True)
class Conditions:
    """How the scores of a stream are made: a threshold from such scores holds for others like them.

    Raises ValueError on what cannot be.
    """

    rollouts: Rollouts
    """Of each score, as of Monitor."""
    horizon: float
    """Of each question [s]."""
    period: float
    """Between two states [s]."""
    disturbance: Any = None
    """As of `capture_probability`; None: Uniform()."""

    def __post_init__(self) -> None:
        """Checks them."""
        checked_rollouts(self.rollouts)
        positive_number("horizon", self.horizon)
        positive_number("period", self.period)

    def require(self, rollouts: Rollouts, period: float, disturbance: Any) -> None:
        """Raises ValueError unless a monitor's scores are made like these."""
        if rollouts != self.rollouts:
            self._refuse("rollouts", rollouts, self.rollouts)
        if not _same(period, self.period):
            self._refuse("period", period, self.period)
        if not _is_same_disturbance(disturbance, self.disturbance):
            self._refuse("disturbance", disturbance, self.disturbance)

    def require_horizon(self, horizon: float | None) -> None:
        """Raises ValueError unless a question's horizon [s] is this one."""
        if horizon is None or not _same(horizon, self.horizon):
            self._refuse("the problem's horizon", horizon, self.horizon)

    def _refuse(self, name: str, value: Any, expected: Any) -> None:
        raise ValueError(
            f"{name} is {shown(value)}, but the alarm's threshold holds for {shown(expected)}: "
            f"take that, or calibrate a threshold with scores of {shown(value)}"
        )


def _same(first: float, second: float) -> bool:
    """Whether two times [s] are equal, but for their last digits."""
    return math.isclose(first, second, rel_tol=1e-6)


def _is_same_disturbance(first: Any, second: Any) -> bool:
    """Models are the same that say the same, functions that are one."""
    first, second = (disturbances.Uniform() if one is None else one for one in (first, second))
    if isinstance(first, disturbances.Disturbance):
        return type(first) is type(second) and _said(first) == _said(second)
    return first is second or bool(first == second)


def _said(model: Any) -> list[Any]:
    """The numbers of a model of disturbances."""
    names = [name for name in dir(model) if not name.startswith("_")]
    values = [getattr(model, name) for name in names]
    return [np.asarray(value).tolist() for value in values if not callable(value)]
