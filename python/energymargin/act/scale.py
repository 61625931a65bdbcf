"""The range of a quantity as numbers from 0 to 1, by differences or by ratios."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

from energymargin.base.checks import shown

DECADE = 10.0  # a range of a larger ratio is searched by ratios


@dataclass(frozen=True)
class Scale:
    """Values of a range as numbers from 0 to 1."""

    ends: tuple[float, float]

    @classmethod
    def of(cls, given: tuple[float, float]) -> Scale:
        """Raises ValueError unless it is two finite numbers that rise."""
        try:
            low, high = map(float, given)
        except (TypeError, ValueError):
            low = high = nan
        if not (np.isfinite([low, high]).all() and low < high):
            raise ValueError(f"range is {shown(given)}, expected (low, high), which rise")
        return cls((low, high))

    def apart(self, u: float, other: float) -> float:
        """How far two values are apart, as a share of the larger one; infinite beyond the range."""
        if not np.isfinite([u, other]).all():
            return np.inf
        a, b = self.value(u), self.value(other)
        least = 0.0 if self.by_ratio else (self.ends[1] - self.ends[0]) / 50.0
        return abs(a - b) / max(abs(a), abs(b), least)

    def value(self, u: float) -> float:
        """The value at a number from 0 to 1."""
        low, high = self.ends
        ratio = self.by_ratio
        value = low ** (1.0 - u) * high**u if ratio else (1.0 - u) * low + u * high
        return min(max(value, low), high)

    @property
    def by_ratio(self) -> bool:
        """Whether values are searched by ratios."""
        return self.ends[0] > 0.0 and self.ends[1] / DECADE > self.ends[0]
