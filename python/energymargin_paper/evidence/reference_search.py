"""A second search for the least effort of escape, to measure `escape_effort` against.

It shares the physics with the library, and nothing else: CMA-ES (Hansen 2016) over paths of a few
constant wrenches, restarted until its rollouts are spent. As in the library an escape counts if it
leads out in a finer simulation too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem, World
from energymargin_paper.evidence.audit import stepped

__all__ = ["Piece", "Reference", "least_effort", "leaves_by_itself"]

WAITS = 10  # longest edges without a wrench that a path may end with
PIECES = (1, 2, 3)  # of a path; 1 is a constant wrench
DRAWS = 100  # random paths from which a restart begins
RESTARTS = 8  # at least, as far as the rollouts go
HOPELESS = 0.2  # of the rollouts without an escape end the search
WEAKEST = 1e-3  # of the wrenches drawn, as a share of their bounds
STEP_SIZE = 0.3  # of CMA-ES at first, in units of the path from which it starts
FINER = 4  # steps of the simulation that confirms an escape, for one
STRENGTHS = (1.0, 1.1, 1.2)  # of the wrenches there, until one leads out
LOOK = 4  # steps between two looks there, in those of the scene
FAR = 1e9  # J, of a path that does not lead out; less the farther the objects have come

Piece = tuple[NDArray[np.float64], float]
"""A wrench on each object, shape (k, 6) [N, N m], and its duration [s]."""


@dataclass(eq=False)
class Reference:
    """What the search found."""

    effort: float = math.inf
    """Effort of the cheapest escape [J]; inf if there is none."""
    path: list[Piece] = field(default_factory=list)
    """Its pieces, the waits among them."""
    rollouts: int = 0
    """Number of rollouts, of at most one longest edge each, as the nodes of a search."""


def least_effort(problem: Problem, rollouts: int, seed: int, cancel: Cancel | None) -> Reference:
    """The cheapest escape of so many rollouts, waits alone first."""
    paths = _Paths(problem, cancel)
    paths.effort([], WAITS)
    random = np.random.default_rng(seed)
    for restart in range(rollouts):
        found = paths.best
        share = 1.0 if found.effort < math.inf else HOPELESS
        if found.rollouts >= share * rollouts or found.effort == 0.0:
            break
        left = rollouts - paths.best.rollouts
        _restart(paths, restart, min(left, rollouts // RESTARTS), random)
    return paths.best


def leaves_by_itself(problem: Problem) -> bool:
    """Whether a state leaves its capture set without a wrench, at the end of one of the waits."""
    return _Paths(problem).effort([], WAITS) == 0.0


class _Paths:
    """Plays paths, and keeps the cheapest escape."""

    def __init__(self, problem: Problem, cancel: Cancel | None = None) -> None:
        self.problem, self.cancel = problem, cancel
        self.world = World(problem.scene)
        self.finer = stepped(problem, step=problem.scene.step / FINER)
        self.finer_world = World(self.finer.scene)
        self.rest = np.zeros_like(_bounds(problem))
        self.best = Reference()

    def effort(self, pieces: Sequence[Piece], waits: int) -> float:
        """Effort of a path up to where a piece ends outside [J]; without one FAR less the way."""
        problem, effort, state = self.problem, 0.0, self.problem.state
        path = [*pieces, *[(self.rest, problem.duration)] * waits]
        for i, (wrench, duration) in enumerate(path):
            start = problem.edge_start(state)
            rollout = self.world.rollout(start, _of_objects(wrench), duration, cancel=self.cancel)
            self.best.rollouts += 1
            state, effort = rollout.state, effort + rollout.effort
            if not problem.captured.contains(problem.scene, state):
                if effort < self.best.effort:
                    if not self.is_confirmed(path[: i + 1]):
                        break
                    self.best.effort, self.best.path = effort, path[: i + 1]
                return effort
        return FAR - float(np.linalg.norm(state - problem.state))

    def is_confirmed(self, path: Sequence[Piece]) -> bool:
        """Whether it leads out in the finer simulation, with a wait at the end."""
        ending = [*path, (self.rest, self.problem.duration)]
        return any(
            self._leads_out((strength * wrench, duration) for wrench, duration in ending)
            for strength in STRENGTHS
        )

    def _leads_out(self, path: Iterable[Piece]) -> bool:
        problem, state = self.finer, self.problem.state
        longest = LOOK * self.problem.scene.step
        for wrench, duration in path:
            looks = math.ceil(duration / longest - 1e-9)
            for look in range(looks):
                held = max(min(longest, duration - look * longest), problem.scene.step)
                start = problem.edge_start(state) if look == 0 else state
                state = self.finer_world.rollout(
                    start, _of_objects(wrench), held, cancel=self.cancel
                ).state
                if not problem.captured.contains(problem.scene, state):
                    return True
        return False


def _bounds(problem: Problem) -> NDArray[np.float64]:
    """Bounds of the wrench on each object, shape (k, 6)."""
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    return np.tile(np.concatenate((problem.force, problem.torque)), (objects, 1))


def _of_objects(wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
    """As a world takes them: that of a single object is flat."""
    return wrenches if len(wrenches) > 1 else wrenches[0]


def _restart(paths: _Paths, restart: int, rollouts: int, random: np.random.Generator) -> None:
    """CMA-ES from the best of some random paths, over the axes of all objects or of one."""
    from cma import CMAEvolutionStrategy

    problem, bounds = paths.problem, _bounds(paths.problem)
    if restart % 2:
        bounds[np.arange(len(bounds)) != random.integers(len(bounds))] = 0.0
    axes = np.flatnonzero(bounds)
    pieces = PIECES[restart % len(PIECES)]
    waits = (WAITS, 1)[restart // len(PIECES) % 2]

    def effort(x: NDArray[np.float64]) -> float:
        return paths.effort(_pieces(x.reshape(pieces, -1), bounds, axes, problem), waits)

    end = paths.best.rollouts + rollouts
    draws = [_draw(pieces, len(axes), random) for _ in range(DRAWS)]
    start = min(draws, key=effort)
    wrenches = np.abs(start.reshape(pieces, -1)[:, :-1]).max()
    scales = np.full((pieces, len(axes) + 1), wrenches)
    scales[:, -1] = 1.0
    options: dict[str, Any] = {
        "CMA_stds": scales.ravel(),
        "seed": int(random.integers(1, 2**31)),
        "verbose": -9,
    }
    search = CMAEvolutionStrategy(start, STEP_SIZE, options)
    while not search.stop() and paths.best.rollouts < end and paths.best.effort > 0.0:
        xs = search.ask()
        search.tell(xs, [effort(x) for x in xs])


def _draw(pieces: int, axes: int, random: np.random.Generator) -> NDArray[np.float64]:
    """Wrenches as shares of their bounds, of any order of magnitude, and their share of the longest
    duration; flat, shape (pieces x (axes + 1),)."""
    strengths = np.exp(random.uniform(np.log(WEAKEST), 0.0, (pieces, 1)))
    wrenches = strengths * random.uniform(-1.0, 1.0, (pieces, axes))
    return np.hstack((wrenches, random.uniform(0.0, 1.0, (pieces, 1)))).ravel()


def _pieces(
    x: NDArray[np.float64], bounds: NDArray[np.float64], axes: NDArray[np.intp], problem: Problem
) -> list[Piece]:
    """Pieces of the rows of x, which are shares of the bounds, cut there."""
    pieces = []
    for row in x:
        wrench = np.zeros_like(bounds)
        wrench.flat[axes] = np.clip(row[:-1], -1.0, 1.0) * bounds.flat[axes]
        duration = float(np.clip(row[-1], 0.0, 1.0)) * problem.duration
        pieces.append((wrench, max(duration, problem.scene.step)))
    return pieces
