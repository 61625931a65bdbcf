"""The parameters of a plan: a box of numbers, and the unit cube in which they are varied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.arguments import shown

__all__ = ["Parameters"]

EXPECTED = "expected (low, high) or (low, start, high), rising"


class Parameters:
    """D numbers between bounds, each with the value that it starts from."""

    def __init__(self, given: Mapping[str, Sequence[float]]) -> None:
        """By name (low, high), which starts in the middle, or (low, start, high).

        Raises ValueError on others, and on none.
        """
        if not isinstance(given, Mapping) or not given:
            raise ValueError(f"parameters is {shown(given)}, expected a dict: name -> (low, high)")
        _check_names(given)
        bounds = np.array([_bounds(str(name), value) for name, value in given.items()])
        self.names = tuple(map(str, given))
        self._low, self._start, self._high = bounds.T

    def __len__(self) -> int:
        """D."""
        return len(self.names)

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """By name (low, high)."""
        ends = zip(self._low.tolist(), self._high.tolist(), strict=True)
        return dict(zip(self.names, ends, strict=True))

    @property
    def start(self) -> NDArray[np.float64]:
        """In the unit cube, shape (D,)."""
        return np.asarray((self._start - self._low) / (self._high - self._low))

    def values(self, point: NDArray[np.float64]) -> dict[str, float]:
        """By name, of a point in the unit cube, shape (D,). The start is met to the bit."""
        exact = np.array_equal(point, self.start)
        found = self._start if exact else self._low + point * (self._high - self._low)
        return dict(zip(self.names, found.tolist(), strict=True))

    def to_plain(self) -> dict[str, list[float]]:
        """As (low, start, high), for a file."""
        rows = np.array([self._low, self._start, self._high]).T.tolist()
        return dict(zip(self.names, rows, strict=True))


def _check_names(given: Mapping[str, Any]) -> None:
    for name in given:
        if not isinstance(name, str):
            raise ValueError(f"parameters has the name {shown(name)}, expected a str")


def _bounds(name: str, value: Any) -> tuple[float, float, float]:
    try:
        numbers = [] if isinstance(value, str) else [float(one) for one in value]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) == 2:
        numbers.insert(1, sum(numbers) / 2)
    good = len(numbers) == 3 and np.isfinite(numbers).all()
    if not (good and numbers[0] <= numbers[1] <= numbers[2] and numbers[0] < numbers[2]):
        raise ValueError(f"parameters[{name!r}] is {shown(value)}, {EXPECTED}")
    return numbers[0], numbers[1], numbers[2]
