"""Instants of a scene on the steps of a MuJoCo model, whatever its timestep is."""

from __future__ import annotations

import math

__all__ = ["Ticks"]


class Ticks:
    """The multiples of a period, each rounded to a step by itself.

    A period that is no whole number of steps so keeps its length in the mean.
    """

    def __init__(self, period: float, timestep: float) -> None:
        """Both in [s]."""
        self._steps = period / timestep

    def step(self, number: int) -> int:
        """The step of an instant."""
        return math.floor(number * self._steps + 0.5)

    def last(self, step: int) -> int:
        """The number of the last instant that is not after a step."""
        number = int(step / self._steps)
        while self.step(number + 1) <= step:
            number += 1
        return number

    def next(self, step: int) -> int:
        """The step of the first instant after a step."""
        return self.step(self.last(step) + 1)
