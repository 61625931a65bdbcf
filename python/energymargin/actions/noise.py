"""Actions near the policy's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.checks import whole_number

__all__ = ["Noise"]


@dataclass(frozen=True)
class Noise:
    """The policy's action with normal noise; raises ValueError on numbers that cannot be.

    A function (observation, action, random), as `em.Guard` takes for its candidates.
    """

    count: int
    """How many actions."""
    spread: ArrayLike
    """Standard deviation in the action's units, a number or an array of the action's shape."""
    low: ArrayLike = -np.inf
    """Least action; others are clipped to it."""
    high: ArrayLike = np.inf
    """Greatest action."""

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("count", self.count, 1)
        spread = np.asarray(self.spread, dtype=float)
        if not (np.isfinite(spread).all() and (spread >= 0).all() and spread.any()):
            raise ValueError(f"spread is {self.spread!r}, expected numbers of at least 0")
        if not (np.asarray(self.low) < np.asarray(self.high)).all():
            raise ValueError(f"low is {self.low!r}, expected below high = {self.high!r}")

    def __call__(
        self, observation: Any, action: ArrayLike, random: np.random.Generator
    ) -> list[NDArray[np.float64]]:
        """`count` actions, each of the action's shape."""
        middle = np.asarray(action, dtype=float)
        noise = random.normal(size=(self.count, *middle.shape)) * np.asarray(self.spread)
        return list(np.clip(middle + noise, self.low, self.high))
