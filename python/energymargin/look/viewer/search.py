"""The scores of one state with their trees, and what is read off these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats, Mask
from energymargin.base.metrics import is_likelihood
from energymargin.look.plots.scenes import lost_objects
from energymargin.look.plots.trees import most_cost

MOMENTS = 25  # a second of a replay, about what the eye sees

ShareProgress = Callable[[float], None]  # of the share that is done


@dataclass(frozen=True)
class Scored:
    """The scores of a state, with their trees."""

    problem: em.Problem
    escape: em.EscapeEffort
    capture: em.CaptureScore | None = None
    """None of a problem with a horizon: that score has no clock."""
    force: em.ForceScore | None = None
    """None if there is no effector, and so no baseline; and of a problem with a horizon."""
    probability: em.CaptureProbability | None = None
    """None of a problem without a horizon."""
    disturbance: Any = None
    """Disturbance of the probability; of no meaning without one."""

    @property
    def tree(self) -> em.Tree:
        """The tree that is drawn: of the capture score or, with a horizon, of the escape."""
        return self.escape.tree if self.capture is None else self.capture.tree

    @property
    def nodes(self) -> int:
        """Nodes of that tree, without the root."""
        return len(self.tree) - 1

    @property
    def values(self) -> dict[str, float]:
        """By metric the likelihoods or, with a horizon, the probabilities, each from 0 to 1."""
        found = self.capture or self.probability
        if found is None:
            return {}
        there = filter(is_likelihood, em.searches.metrics_of([self.problem]))
        return {name: em.searches.value_of(name, found) for name in there}

    @cached_property
    def lost(self) -> Mask:
        """Which object is out of its capture set in which node, shape (M + 1, k)."""
        return lost_objects(self.problem, self.tree.states)

    @cached_property
    def way_out(self) -> ReplayedWay | None:
        """The rollouts of the cheapest escape; None if none was found."""
        if len(self.escape.path) == 0:
            return None
        return replay(self.problem, self.escape.tree, self.escape.path.tolist())

    @cached_property
    def most(self) -> float:
        """Where the colours of the costs end [J]: at the costliest captured node, or at the effort
        of the way out."""
        return most_cost(self.problem, self.tree, self.escape.effort)


def score_state(
    problem: em.Problem,
    settings: em.searches.SearchSettings,
    number: int | None = None,
    progress: ShareProgress | None = None,
    *,
    disturbance: Any = None,
) -> Scored:
    """All scores of a state; with a horizon, a probability instead of the scores without a clock.

    `number` and `disturbance` are as of `metric_search`. progress(share) has the share that is
    done.
    """

    def search(metric: str, begin: float, most: int, **others: Any) -> Any:
        if progress is not None:
            others["progress"] = lambda done: progress(begin + 0.5 * done / most)
        return em.searches.metric_search(problem, metric, settings, number, warn=False, **others)

    disturbance = disturbance or settings.disturbance
    capture = force = probability = None
    if problem.horizon is None:
        capture = search("capture", 0.0, settings.nodes)
        if any(body.role == "effector" for body in problem.scene.bodies):
            force = em.searches.metric_search(problem, "force", settings)
    else:
        asked: dict[str, Any] = {"disturbance": disturbance}
        asked["success"] = problem.succeeded is not None
        asked["by_object"] = problem.captured_any is not None
        probability = search("probability", 0.0, settings.rollouts, **asked)
    escape = search("effort", 0.5, settings.nodes)
    return Scored(problem, escape, capture, force, probability, disturbance)


class ReplayedWay(NamedTuple):
    """K moments from the root of a tree to one of its nodes."""

    times: Floats
    """Since the root [s], shape (K,)."""
    states: Floats
    """Shape (K, n)."""
    costs: Floats
    """Effort since the root [J], shape (K,)."""


def replay(problem: em.Problem, tree: em.Tree, path: Sequence[int]) -> ReplayedWay:
    """Rolls out again the edges of a path, as `tree.path_to` gives it: its ends are the tree's own
    states, to the last bit. With a plan the robot follows it from each node's time on.

    A path of one node is that node alone. Raises ValueError on an empty path.
    """
    if len(path) == 0:
        raise ValueError("path is empty, expected rows of the tree from its root on")
    world, since_root = em.World(problem.scene, problem.plan), tree.times
    stride = max(1, round(1.0 / (MOMENTS * problem.scene.step)))
    times, states, costs = [0.0], [tree.states[path[0]]], [float(tree.costs[path[0]])]
    for before, node in pairwise(path):
        start, wrench = problem.edge_start(tree.states[before]), tree.controls[node]
        wrench = wrench if len(wrench) == 6 else wrench.reshape(-1, 6)  # of several objects
        begin, base = times[-1], float(tree.costs[before])
        steps = round(float(tree.durations[node]) / problem.scene.step)
        for step in [*range(stride, steps, stride), steps]:
            moment = world.rollout(
                start, wrench, step * problem.scene.step, time=float(since_root[before])
            )
            times.append(begin + step * problem.scene.step)
            states.append(moment.state)
            costs.append(base + moment.effort)
    return ReplayedWay(np.array(times), np.array(states), np.array(costs))
