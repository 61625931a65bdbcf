"""The rollouts along a path of a search tree, moment by moment."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem, Tree, World
from energymargin.undisturbed import MOMENTS

__all__ = ["Replay", "replay"]


class Replay(NamedTuple):
    """K moments from the root of a tree to one of its nodes."""

    times: NDArray[np.float64]
    """Since the root [s], shape (K,)."""
    states: NDArray[np.float64]
    """Shape (K, n)."""
    costs: NDArray[np.float64]
    """Effort since the root [J], shape (K,)."""


def replay(problem: Problem, tree: Tree, path: Sequence[int]) -> Replay:
    """Rolls out again the edges of a path, as `tree.path_to` gives it: its ends are the tree's own
    states, to the last bit. With a plan the robot follows it from each node's time on.

    A path of one node is that node alone. Raises ValueError on an empty path.
    """
    if len(path) == 0:
        raise ValueError("path is empty, expected rows of the tree from its root on")
    world, since_root = World(problem.scene, problem.plan), tree.times
    stride = max(1, round(1.0 / (MOMENTS * problem.scene.step)))
    times, states, costs = [0.0], [tree.states[path[0]]], [float(tree.costs[path[0]])]
    for before, node in pairwise(path):
        start, wrench = problem.edge_start(tree.states[before]), _wrench(tree.controls[node])
        begin, base = times[-1], float(tree.costs[before])
        steps = round(float(tree.durations[node]) / problem.scene.step)
        for step in [*range(stride, steps, stride), steps]:
            moment = world.rollout(
                start, wrench, step * problem.scene.step, time=float(since_root[before])
            )
            times.append(begin + step * problem.scene.step)
            states.append(moment.state)
            costs.append(base + moment.effort)
    return Replay(np.array(times), np.array(states), np.array(costs))


def _wrench(control: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of one object (6,), of k objects (k, 6)."""
    return control if len(control) == 6 else control.reshape(-1, 6)
