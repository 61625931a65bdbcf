"""How a plan is chosen: the nominal one, by the force score, over random models, by the margin."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from energymargin._core import Cancel, Problem, World, force_score
from energymargin.act.parameters import Parameters
from energymargin.actions import improve
from energymargin.disturbances import Uniform
from energymargin_paper.evidence.act_demo import Demo

__all__ = ["METHODS", "Choice", "Chosen", "choose"]

METHODS = ("nominal", "force score", "randomization", "margin")

# The force score is that of the undisturbed motion.
POINTS = 64  # of the box of parameters
MOMENTS = 10


@dataclass(frozen=True)
class Choice:
    """A job: a plan for a demonstration, by one of METHODS."""

    version: str
    demo: str
    method: str
    budget: int
    seed: int


@dataclass(frozen=True, eq=False)
class Chosen:
    """The plan."""

    values: dict[str, float]
    steps: int
    """Simulation steps that it took to choose."""
    seconds: float


def choose(demo: Demo, choice: Choice, folder: Path, threads: int, cancel: Cancel) -> Chosen:
    """The plan of a method. What a search has done so far is kept in the folder."""
    begun = time.monotonic()
    if choice.method == "nominal":
        values, steps = demo.nominal, 0
    elif choice.method == "force score":
        values, steps = _by_force(demo, choice.seed)
    else:
        values, steps = _improved(demo, choice, folder, threads, cancel)
    return Chosen(values, steps, time.monotonic() - begun)


def _improved(
    demo: Demo, choice: Choice, folder: Path, threads: int, cancel: Cancel
) -> tuple[dict[str, float], int]:
    """By the margin; by domain randomization it is the same search of the same budget over the same
    models, but without a disturbance."""
    margin = choice.method == "margin"
    found = improve(
        demo.problem(demo.nominal),
        demo.parameters,
        demo.problem,
        metric=demo.objective,
        disturbance=demo.disturbance if margin else Uniform(0.0),
        uncertainty=demo.uncertainty,
        constraints=demo.constraints,
        budget=choice.budget,
        harden=margin,
        seed=choice.seed,
        store=folder / f"{demo.name}-{choice.method}-{choice.budget}-{choice.seed}.db",
        threads=threads,
        cancel=cancel,
    )
    return found.values, found.steps


def _by_force(demo: Demo, seed: int) -> tuple[dict[str, float], int]:
    """The best mean force score along the undisturbed motion, of the start and of points spread
    over the box whose motion succeeds."""
    box = Parameters(demo.parameters)
    spread = qmc.Sobol(len(box), seed=np.random.default_rng(seed)).random(POINTS)
    best, highest, steps = demo.nominal, -np.inf, 0
    for point in [box.start, *spread]:
        values = box.values(point)
        if any(constraint(values) < 0 for constraint in demo.constraints):
            continue
        problem = demo.problem(values)
        score, taken = _along(problem)
        steps += taken
        if score > highest:
            best, highest = values, score
    return best, steps


def _along(problem: Problem) -> tuple[float, int]:
    """The mean force score of an undisturbed motion, -inf if that fails; and its steps."""
    assert problem.horizon is not None and problem.succeeded is not None
    steps = round(problem.horizon / problem.scene.step)
    moments = np.linspace(0, steps, MOMENTS).astype(int)
    world = World(problem.scene, plan=problem.plan)
    states = world.simulate(problem.state, steps, record=moments.tolist()).states
    if not problem.succeeded.contains(problem.scene, states[-1]):
        return -np.inf, steps
    still = problem.replace(horizon=None, plan=None, within=None)
    scores = [force_score(still.with_state(state)).force for state in states]
    return float(np.mean(scores)), steps
