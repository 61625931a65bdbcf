"""When an alarm goes on, and when it goes off again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.checks import whole_number
from energymargin.monitor.conditions import Conditions

__all__ = ["Alarm", "values_of"]


@dataclass(frozen=True)
class Alarm:
    """An alarm with hysteresis; raises ValueError on numbers that cannot be.

    It goes on once `count` of the last `window` values are below `on`, and off once as many are at
    least `off`.
    """

    on: float
    """The threshold."""
    off: float | None = None
    """At least `on`, which it is if not given."""
    count: int = 1
    window: int = 1
    from_data: bool = False
    """Whether `on` is a threshold from data, which holds under the `conditions` alone."""
    conditions: Conditions | None = None
    """Those; None is not known, or `on` is a number of yours."""

    def __post_init__(self) -> None:
        """Checks them."""
        for name, value in (("on", self.on), ("off", self.on if self.off is None else self.off)):
            number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            if not number or math.isnan(value):
                raise ValueError(f"{name} is {value!r}, expected a number")
        if self.off is not None and self.off < self.on:
            raise ValueError(f"off is {self.off:g}, expected at least on = {self.on:g}")
        whole_number("window", self.window, 1)
        whole_number("count", self.count, 1, self.window)

    def after(self, recent: Sequence[float], *, is_on: bool) -> bool:
        """Whether it is on after the `recent` values, the last one last, if it was `is_on` before.

        Only the last `window` of them count.
        """
        last = np.asarray(recent, dtype=float)[-self.window :]
        off = self.on if self.off is None else self.off
        if np.count_nonzero(last < self.on) >= self.count:
            return True
        return is_on and int(np.count_nonzero(last >= off)) < self.count

    def follow(self, values: ArrayLike) -> NDArray[np.bool_]:
        """Whether it is on at each of K values, shape (K,), one after the other.

        NaN is a frame without a value: the alarm stays as it was.
        """
        numbers = values_of("values", values)
        states, is_on, seen = np.zeros(len(numbers), dtype=bool), False, list[float]()
        for k, value in enumerate(numbers.tolist()):
            if not math.isnan(value):
                seen = [*seen, value][-self.window :]
                is_on = self.after(seen, is_on=is_on)
            states[k] = is_on
        return states


def values_of(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Values of K frames, shape (K,); ValueError with `name` on anything else."""
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {values!r}, expected numbers, one a frame") from None
    if numbers.ndim != 1:
        raise ValueError(f"{name} has shape {numbers.shape}, expected (K,), one a frame")
    return numbers
