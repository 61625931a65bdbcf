"""The time between the frames of a trajectory whose clock was not recorded."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from energymargin._core import World
from energymargin.published.task import SimulatedTask
from energymargin.tasks.base import Params

__all__ = ["matched_interval"]

LEAST, LONGEST = 10, 120  # steps; the longest trajectories have this interval


def matched_interval(task: SimulatedTask, params: Params, states: NDArray[np.float64]) -> float:
    """The interval [s], in whole steps, after which the script's mean brings each state, shape
    (K, n), nearest to the next recorded one, in the mean of the free bodies' distances."""
    scene = task.scene(params)
    bodies = [body.name for body in scene.bodies if body.mass > 0]
    places = [scene.slice(name).start + axis for name in bodies for axis in range(3)]
    steps = range(LEAST, LONGEST + 1)
    distances = np.zeros(len(steps))
    for state, after in pairwise(states):
        plan = task.plan(state, 0.0, params, LONGEST * task.step)
        reached = World(scene, plan).simulate(state, LONGEST, record=list(steps)).states
        away = (reached - after)[:, places].reshape(len(steps), len(bodies), 3)
        distances += np.linalg.norm(away, axis=2).sum(axis=1)
    return (LEAST + int(distances.argmin())) * task.step
