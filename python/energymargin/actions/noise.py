"""Actions near the policy's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.arguments import shown
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
    """Standard deviation in the action's units, a number above 0; or an array of the action's
    shape, where some may be 0."""
    low: ArrayLike = -np.inf
    """Least action, a number or an array of the action's shape; others are clipped to it."""
    high: ArrayLike = np.inf
    """Greatest action, the same."""

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("count", self.count, 1)
        spread = _numbers("spread", self.spread)
        if not (np.isfinite(spread).all() and (spread >= 0).all() and spread.any()):
            raise ValueError(
                f"spread is {shown(self.spread)}, expected a number above 0, or an array of "
                "numbers of at least 0 that are not all 0"
            )
        low, high = _numbers("low", self.low), _numbers("high", self.high)
        if () not in (low.shape, high.shape) and low.shape != high.shape:
            raise ValueError(f"high has shape {high.shape}, expected that of low, {low.shape}")
        if not (low < high).all():
            raise ValueError(f"low is {shown(self.low)}, expected below high = {shown(self.high)}")

    def __call__(
        self, observation: Any, action: ArrayLike, random: np.random.Generator
    ) -> list[NDArray[np.float64]]:
        """`count` actions, each of the action's shape.

        Raises ValueError on an action without numbers, or of another shape than the spread, low or
        high.
        """
        middle = _numbers("action", action).astype(float)
        for name in ("spread", "low", "high"):
            shape = np.shape(getattr(self, name))
            if shape not in ((), middle.shape):
                raise ValueError(
                    f"{name} has shape {shape}, expected a number or the action's shape "
                    f"{middle.shape}"
                )
        noise = random.normal(size=(self.count, *middle.shape)) * np.asarray(self.spread)
        return list(np.clip(middle + noise, self.low, self.high))


def _numbers(name: str, value: ArrayLike) -> NDArray[Any]:
    """The value as an array; ValueError unless it has real numbers."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of several lengths
        array = np.array(None)
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} is {shown(value)}, expected a number or an array of numbers")
    return array
