"""The scores of one state, searched for in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Cancel,
    CaptureScore,
    EscapeEffort,
    ForceScore,
    Problem,
    capture_score,
    escape_effort,
    force_score,
)
from energymargin.plots.sets import lost_objects
from energymargin.plots.trees import most_cost
from energymargin.viewer.likelihoods import Memberships
from energymargin.viewer.replay import Replay, replay

__all__ = ["Live", "Scored", "score_state"]


@dataclass(frozen=True)
class Scored:
    """The scores of a state, with their trees."""

    problem: Problem
    capture: CaptureScore
    escape: EscapeEffort
    force: ForceScore | None
    """None if there is no effector, and so no baseline."""

    @property
    def complete(self) -> bool:
        """Whether no search was stopped."""
        return self.capture.complete and self.escape.complete

    @property
    def size(self) -> int:
        """Nodes of both trees."""
        return self.capture.nodes + self.escape.nodes

    @cached_property
    def memberships(self) -> Memberships:
        """Which nodes of the capture score's tree are in which set."""
        return Memberships(self.problem, self.capture.tree)

    @cached_property
    def lost(self) -> NDArray[np.bool_]:
        """Which object is out of its capture set in which node, shape (M + 1, k)."""
        return lost_objects(self.problem, self.capture.tree.states)

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
        return max(most_cost(self.problem, self.capture.tree), effort)

    def read_off(self) -> None:
        """Computes what is read off the trees, which may take a second: where nobody waits."""
        _ = self.memberships, self.lost, self.way_out, self.most


def score_state(
    problem: Problem,
    nodes: int,
    seed: int,
    cancel: Cancel | None = None,
    progress: Callable[[float], None] | None = None,
) -> Scored:
    """Searches with so many nodes for each of the scores; progress(share) is told what is done.

    Once `cancel` is set it ends with what there is.
    """

    def told(begin: int) -> Callable[[int], None] | None:
        if progress is None:
            return None
        report = progress
        return lambda made: report((begin + made) / (2 * nodes))

    has_effector = any(body.role == "effector" for body in problem.scene.bodies)
    capture = capture_score(
        problem, nodes=nodes, seed=seed, cancel=cancel, progress=told(0), warn=False
    )
    escape = escape_effort(problem, nodes=nodes, seed=seed, cancel=cancel, progress=told(nodes))
    return Scored(problem, capture, escape, force_score(problem) if has_effector else None)


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
