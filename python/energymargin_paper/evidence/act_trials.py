"""Plans in held-out worlds, in Bullet and in MuJoCo: the same worlds and disturbances for all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem, World as Simulated, capture_probability
from energymargin.mujoco.replay import Edge, EscapePlayer
from energymargin_paper.evidence.act_demo import HOLD, Demo, Values
from energymargin_paper.evidence.engines_states import twin

__all__ = ["ENGINES", "Outcome", "Trial", "duration", "in_bullet", "met", "run"]

ENGINES = ("bullet", "mujoco")
PARTS = 4  # steps of MuJoCo in one of ours
SEEDS = 1_000_000  # held-out seeds begin here: those of the search are small


@dataclass(frozen=True)
class Trial:
    """One plan in one world."""

    demo: str
    method: str
    values: str
    """The plan's parameters, as JSON."""
    engine: str
    seed: int


@dataclass(frozen=True)
class Outcome:
    """What became of it."""

    lost: bool
    success: bool


def run(demo: Demo, values: Values, engine: str, seed: int, cancel: Cancel) -> Outcome:
    """One plan in the world of a seed."""
    problem, rows = met(demo, values, seed)
    found = in_bullet if engine == "bullet" else _in_mujoco
    return found(problem, rows, cancel)


def met(demo: Demo, values: Values, seed: int) -> tuple[Problem, NDArray[np.float64]]:
    """The problem of a plan in the world of a seed, of which each plan meets the same, and the
    wrenches there, shape (steps, 6 k)."""
    random = np.random.default_rng(SEEDS + seed)
    problem = demo.problem(values, demo.draw(random))
    assert problem.horizon is not None
    steps = round(problem.horizon / problem.scene.step)
    times = np.linspace(0.0, problem.horizon, steps, endpoint=False)
    return problem, demo.wrenches(random, times)


def in_bullet(problem: Problem, rows: NDArray[np.float64], cancel: Cancel) -> Outcome:
    """A problem's robot under wrenches, shape (steps, 6 k)."""
    p = capture_probability(
        problem,
        disturbance=lambda random, times: rows,
        rollouts=1,
        success=True,
        undisturbed=False,
        cancel=cancel,
    )
    return Outcome(lost=bool(p.captured < 1), success=bool(p.success))


def _in_mujoco(problem: Problem, rows: NDArray[np.float64], cancel: Cancel) -> Outcome:
    model, data = twin(problem.scene, np.asarray(problem.state), PARTS)
    player = EscapePlayer(problem, problem.captured, model, data, cancel)
    size = round(HOLD / problem.scene.step)
    edges = [
        Edge(rows[first].reshape(-1, 6), len(rows[first : first + size]) * problem.scene.step)
        for first in range(0, len(rows), size)
    ]
    played = player.play(edges)
    assert problem.succeeded is not None
    success = problem.succeeded.contains(problem.scene, played.end)
    return Outcome(lost=played.escaped, success=bool(success))


def duration(problem: Problem) -> float | None:
    """When the undisturbed motion is in the success set for good [s]; None: never."""
    assert problem.horizon is not None and problem.succeeded is not None
    step = problem.scene.step
    steps = round(problem.horizon / step)
    every = range(0, steps + 1, 4)
    plan: Any = problem.plan
    states = Simulated(problem.scene, plan=plan).simulate(problem.state, steps, record=list(every))
    inside = problem.succeeded.contains(problem.scene, states.states)
    if not inside[-1]:
        return None
    outside = np.flatnonzero(~inside)
    return float(states.times[outside[-1] + 1] if len(outside) else 0.0)
