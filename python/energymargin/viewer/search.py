"""The scores of one state, searched for in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Cancel,
    Cancelled,
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    ForceScore,
    Problem,
    Tree,
    capture_probability,
    capture_score,
    escape_effort,
    force_score,
)
from energymargin.disturbances import Uniform
from energymargin.plots.sets import lost_objects
from energymargin.plots.trees import most_cost
from energymargin.viewer.likelihoods import Memberships
from energymargin.viewer.replay import Replay, replay

__all__ = ["ROLLOUTS", "Live", "Scored", "ShareProgress", "score_state"]

ROLLOUTS = 30  # of a probability, as of `capture_probability`


ShareProgress = Callable[[float], None]  # of the share that is done


@dataclass(frozen=True)
class Scored:
    """The scores of a state, with their trees."""

    problem: Problem
    escape: EscapeEffort
    capture: CaptureScore | None = None
    """None of a problem with a horizon: that score has no clock."""
    force: ForceScore | None = None
    """None if there is no effector, and so no baseline; and of a problem with a horizon."""
    probability: CaptureProbability | None = None
    """None of a problem without a horizon, or if it was stopped before there was any rollout."""
    disturbance: Uniform | None = None
    """Of the probability."""

    @property
    def complete(self) -> bool:
        """Whether no search was stopped."""
        first = self.probability if self.capture is None else self.capture
        return first is not None and first.complete and self.escape.complete

    @property
    def tree(self) -> Tree:
        """The tree that is drawn: of the capture score or, with a horizon, of the escape."""
        return self.escape.tree if self.capture is None else self.capture.tree

    @property
    def grown(self) -> int:
        """Nodes of that tree, besides the root."""
        return len(self.tree) - 1

    @property
    def size(self) -> int:
        """Nodes of all trees."""
        return self.grown + (0 if self.capture is None else self.escape.nodes)

    @property
    def empty(self) -> bool:
        """Whether it was stopped before there was anything."""
        return self.size == 0 and self.probability is None

    def values(self, nodes: int, rate: float) -> dict[str, float]:
        """By metric what can be drawn along a trajectory, each from 0 to 1: of the tree's first
        `nodes` nodes at that lambda [1/J] or, with a horizon, of all rollouts."""
        if self.memberships is not None:
            return self.memberships.scores(min(nodes, self.grown), rate)
        found = self.probability
        if found is None:
            return {}
        values = {"probability": found.captured}
        if found.success is not None:
            values["probability/success"] = found.success
        if found.any is not None:
            values["probability/any"] = found.any.captured
        return values

    @cached_property
    def memberships(self) -> Memberships | None:
        """Which nodes of the capture score's tree are in which set; None without such a tree."""
        return None if self.capture is None else Memberships(self.problem, self.capture.tree)

    @cached_property
    def lost(self) -> NDArray[np.bool_]:
        """Which object is out of its capture set in which node, shape (M + 1, k)."""
        return lost_objects(self.problem, self.tree.states)

    @cached_property
    def way_out(self) -> Replay | None:
        """The rollouts of the cheapest escape; None if none was found."""
        if len(self.escape.path) == 0:
            return None
        return replay(self.problem, self.escape.tree, self.escape.path.tolist())

    @cached_property
    def most(self) -> float:
        """Where the colours of the costs end [J]: at the costliest captured node, or at the effort
        of the way out."""
        effort = self.escape.effort if np.isfinite(self.escape.effort) else 0.0
        return max(most_cost(self.problem, self.tree), effort)

    def read_off(self) -> None:
        """Computes what is read off the trees, which may take a second: where nobody waits."""
        _ = self.memberships, self.lost, self.way_out, self.most


def score_state(
    problem: Problem,
    nodes: int,
    seed: int,
    cancel: Cancel | None = None,
    progress: ShareProgress | None = None,
    *,
    search: str = "improved",
    rollouts: int = ROLLOUTS,
    disturbance: Uniform | None = None,
    rollout_seed: int | None = None,
) -> Scored:
    """Searches with so many nodes for each of the scores; with a horizon, simulates so many
    rollouts for the probability instead of the scores that have no clock, under a disturbance, by
    default Uniform(), from a seed of their own if it is given. progress(share) is told what is
    done.

    Once `cancel` is set it ends with what there is.
    """

    def share_of_nodes(begin: float, most: int) -> Callable[[int], None] | None:
        if progress is None:
            return None
        report = progress
        return lambda made: report(begin + 0.5 * made / most)

    def escape() -> EscapeEffort:
        limits: dict[str, Any] = {"cancel": cancel, "progress": share_of_nodes(0.5, nodes)}
        return escape_effort(problem, nodes=nodes, seed=seed, search=search, **limits)

    if problem.horizon is not None:
        model = disturbance or Uniform()
        drawn = seed if rollout_seed is None else rollout_seed
        limits = {"cancel": cancel, "progress": share_of_nodes(0.0, rollouts)}
        found = _probability(problem, model, rollouts, drawn, **limits)
        return Scored(problem, escape(), probability=found, disturbance=model)
    has_effector = any(body.role == "effector" for body in problem.scene.bodies)
    capture = capture_score(
        problem,
        nodes=nodes,
        seed=seed,
        cancel=cancel,
        progress=share_of_nodes(0.0, nodes),
        warn=False,
    )
    return Scored(problem, escape(), capture, force_score(problem) if has_effector else None)


def _probability(
    problem: Problem, disturbance: Uniform, rollouts: int, seed: int, **limits: Any
) -> CaptureProbability | None:
    """None if it was stopped before the first rollout was done."""
    try:
        return capture_probability(
            problem,
            disturbance=disturbance,
            rollouts=rollouts,
            seed=seed,
            success=problem.succeeded is not None,
            by_object=problem.captured_any is not None,
            **limits,
        )
    except Cancelled:
        return None


class Live:
    """One search at a time, in the background."""

    def __init__(self) -> None:
        """Idle."""
        self._lock = threading.RLock()
        self._cancel = Cancel()
        # Waited for instead of the thread, which Python takes for ended once Ctrl-C ends a join.
        self._done = threading.Event()
        self._done.set()
        self._closed = False

    @property
    def running(self) -> bool:
        """Whether it searches."""
        return not self._done.is_set()

    def start(self, work: Callable[[Cancel], None]) -> None:
        """Stops what runs, and calls `work` with the cancel that ends it; not once it is closed."""
        with self._lock:
            self.stop()
            if self._closed:
                return
            self._cancel, self._done = Cancel(), threading.Event()
            arguments = (work, self._cancel, self._done)
            threading.Thread(target=_do, args=arguments, daemon=True).start()

    def join(self) -> None:
        """Waits until it is done."""
        self._done.wait()

    def stop(self) -> None:
        """Ends the search, and waits for that: within one rollout."""
        with self._lock:
            self._cancel.set()
            self.join()

    def close(self) -> None:
        """Ends the search, and starts no other."""
        self._closed = True
        self.stop()


def _do(work: Callable[[Cancel], None], cancel: Cancel, done: threading.Event) -> None:
    try:
        work(cancel)
    finally:
        done.set()
