"""The undisturbed future of a problem: the states within its horizon without a disturbance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem, World, capture_probability, disturbances

__all__ = ["MOMENTS", "Undisturbed", "undisturbed"]

MOMENTS = 25  # a second of the simulation, about what the eye sees
NOTHING = disturbances.Uniform(strength=0.0)


class Undisturbed(NamedTuple):
    """The robot follows its plan, and no wrench acts on the objects: K moments."""

    times: NDArray[np.float64]
    """From 0 to the horizon [s], shape (K,)."""
    states: NDArray[np.float64]
    """Shape (K, n)."""
    exit: float | None
    """When the objects are first seen outside of the capture set, for long enough [s]; None: they
    stay captured."""

    @property
    def exit_moment(self) -> int | None:
        """The first moment from the exit on; None if there is no exit."""
        if self.exit is None:
            return None
        return min(int(np.searchsorted(self.times, self.exit - 1e-9)), len(self.times) - 1)


def undisturbed(problem: Problem, cancel: Cancel | None = None) -> Undisturbed:
    """Simulates the future of a problem with a horizon.

    Raises ValueError on a problem without one, RuntimeError if the simulation diverges, and
    Cancelled once `cancel` is set.
    """
    found = capture_probability(problem, disturbance=NOTHING, rollouts=1, cancel=cancel)
    step = problem.scene.step
    steps, stride = round(float(found.times[-1]) / step), max(1, round(1.0 / (MOMENTS * step)))
    record = [*range(0, steps, stride), steps]
    start = problem.edge_start(problem.state)
    world = World(problem.scene, problem.plan)
    states = world.simulate(start, steps, record=record, cancel=cancel).states
    leaves = None if found.undisturbed else found.undisturbed_time
    return Undisturbed(np.array(record) * step, states, leaves)
