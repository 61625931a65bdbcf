"""What a demonstration of acting on the margin is: a plan with parameters, and the worlds it meets.

A plan is chosen once, for the world as it is believed to be. Then it runs in worlds that nobody has
seen: with other frictions, other errors of the start, and another kind of disturbance.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform

__all__ = ["Demo", "Values", "World", "held", "noise"]

Values = Mapping[str, float]
"""The parameters of a plan, by name."""
World = Mapping[str, float]
"""What is drawn of a world: frictions, masses, errors of the start; empty: as it is believed."""

HOLD = 1 / 24  # s; a held-out disturbance is constant for so long


class Demo(ABC):
    """One task, its plan's parameters, what is believed, and what is held out."""

    name: str
    parameters: ClassVar[dict[str, tuple[float, float, float]]]
    """By name (low, start, high); the start is the nominal script."""
    objective: str = "probability"
    """What is improved, as of `em.improve`."""
    disturbance: Uniform
    """Under which plans are chosen."""
    uncertainty: Uncertainty
    """What is believed."""
    budget: int = 6_000_000
    """Simulation steps for choosing a plan."""
    plane: tuple[str, str] = ("x", "y")
    """Plane of pictures."""

    @property
    def nominal(self) -> dict[str, float]:
        """The parameters of the nominal script."""
        return {name: start for name, (_, start, _) in self.parameters.items()}

    @property
    def constraints(self) -> tuple[Callable[[dict[str, float]], float], ...]:
        """As of `em.improve`."""
        return ()

    @abstractmethod
    def problem(self, values: Values, world: World | None = None) -> Problem:
        """The question about a plan in a world, None: the believed one. Its horizon is the whole
        motion; captured throughout is not to be lost, and the success set is that of its end.

        The plan depends on the values alone: the robot does not know the world.
        """

    @abstractmethod
    def draw(self, random: np.random.Generator) -> World:
        """A held-out world."""

    @abstractmethod
    def wrenches(
        self, random: np.random.Generator, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """A held-out disturbance at the times of the steps, shape (steps, 6 k) [N, N m]; constant
        for HOLD, so that MuJoCo is played in few edges."""


def held(
    times: NDArray[np.float64], rows: Callable[[int], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Rows, shape (pieces, 6 k), each held for HOLD; `rows(pieces)` makes them."""
    piece = np.floor(times / HOLD + 1e-6).astype(int)
    return np.asarray(rows(int(piece[-1]) + 1)[piece])


def noise(
    random: np.random.Generator, pieces: int, deviations: NDArray[np.float64], correlation: float
) -> NDArray[np.float64]:
    """Normal noise that forgets with a time constant [s], in pieces of HOLD, shape (pieces, D)."""
    keep = np.exp(-HOLD / correlation)
    rows = np.empty((pieces, len(deviations)))
    rows[0] = random.normal(size=len(deviations))
    for piece in range(1, pieces):
        fresh = random.normal(size=len(deviations))
        rows[piece] = keep * rows[piece - 1] + np.sqrt(1 - keep**2) * fresh
    return np.asarray(rows * deviations)
