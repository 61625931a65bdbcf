"""What happens within a problem's horizon if nothing disturbs it, moment by moment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from energymargin._core import Cancel, Problem, World, capture_probability, disturbances
from energymargin.viewer.replay import MOMENTS, Replay

__all__ = ["Future", "undisturbed_future"]

NOTHING = disturbances.Uniform(strength=0.0)


class Future(NamedTuple):
    """The robot follows its plan, and no wrench acts on the objects."""

    way: Replay
    """From the problem's state to its horizon; costs are 0."""
    exit: float | None
    """When the objects are first seen outside of the capture set, for long enough [s]; None: they
    stay captured."""

    def exit_moment(self) -> int | None:
        """The first moment from the exit on; None if there is no exit."""
        if self.exit is None:
            return None
        return min(int(np.searchsorted(self.way.times, self.exit - 1e-9)), len(self.way.times) - 1)


def undisturbed_future(problem: Problem, cancel: Cancel | None = None) -> Future:
    """Simulates it, for a problem with a horizon.

    Raises ValueError on a problem without one, RuntimeError if the simulation diverges, and
    Cancelled once `cancel` is set.
    """
    found = capture_probability(problem, disturbance=NOTHING, rollouts=1, cancel=cancel)
    step = problem.scene.step
    steps, stride = round(float(found.times[-1]) / step), max(1, round(1.0 / (MOMENTS * step)))
    record = [*range(0, steps, stride), steps]
    start = problem.edge_start(problem.state)
    world = World(problem.scene, problem.plan)
    recorded = world.simulate(start, steps, record=record, cancel=cancel)
    way = Replay(np.array(record) * step, recorded.states, np.zeros(len(record)))
    return Future(way, None if found.undisturbed else found.undisturbed_time)
