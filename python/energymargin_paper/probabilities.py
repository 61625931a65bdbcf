"""Probabilities that a state stays captured: under disturbances, of the plan alone, and learned.

Of each state they are shares by frame: captured throughout until 1, 2, ... frames later.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Cancel,
    Problem,
    World,
    capture_probability,
    disturbances,
    stream,
)
from energymargin.datasets import Dataset
from energymargin.tasks.scripted import Following, ScriptedTask
from energymargin.tasks.trajectories import Trajectory
from energymargin_paper.evidence.ceiling import scripted

__all__ = [
    "FRESH",
    "HORIZONS",
    "LEARNED",
    "NOMINAL",
    "SCRIPT",
    "Job",
    "Method",
    "Shares",
    "jobs",
    "learned",
    "nominal",
    "run",
    "share_by_frame",
]

HORIZONS = range(1, 6)  # frames
LOOK = 4  # steps between two looks at the nominal rollout, as of a problem's `check`
FOLDS = 5  # of the learned probability
SCRIPT, NOMINAL, FRESH, LEARNED = "script", "nominal", "fresh", "learned"

# What the robot does, by the name of a probability.
PLANS: dict[str, Following | None] = {
    "coast": None,
    "hold": "hold",
    SCRIPT: "script",
    "default": "script",
    FRESH: "script",
    NOMINAL: "script",
}


@dataclass(frozen=True)
class Method:
    """How a probability is estimated."""

    rollouts: int
    strength: float
    objects: int | None
    seed: int


@dataclass(frozen=True)
class Job:
    """One probability of one state."""

    version: str
    task: str
    trajectories: int
    index: int
    """Number of the state in its dataset."""
    method: str
    rollouts: int
    strength: float
    objects: int | None
    seed: int


@dataclass(frozen=True, eq=False)
class Shares:
    """What came out of a job."""

    shares: list[float]
    """Captured throughout until h frames later, for h = 1, 2, ... as far as the trajectory goes."""
    steps: int
    """Steps of the simulation."""
    seconds: float
    """It took, on one thread [s]."""
    error: str | None = None
    """Why there are no shares."""


def jobs(dataset: Dataset, trajectories: int, methods: Mapping[str, Method]) -> Iterator[Job]:
    """Jobs of the states that are captured now, with a frame after them."""
    program, frames, most = version("energymargin"), dataset.frames(), _objects(dataset)
    for name, method in methods.items():
        objects = None if method.objects is None else min(method.objects, most)
        for index, (t, k) in enumerate(frames):
            trajectory = dataset.trajectories[t]
            if trajectory.captured[k] and k + 1 < len(trajectory):
                yield Job(
                    *(program, dataset.task, trajectories, index, name),
                    *(method.rollouts, method.strength, objects, method.seed),
                )


def _objects(dataset: Dataset) -> int:
    """How many a task has."""
    scene = scripted(dataset).scene(dataset.trajectories[0].params)
    return sum(body.role == "object" for body in scene.bodies)


def run(
    parts: Mapping[str, Dataset], robots: Mapping[str, ScriptedTask], job: Job, cancel: Cancel
) -> Shares:
    """The shares of a state of its task's dataset."""
    dataset = parts[job.task]
    t, k = dataset.frames()[job.index]
    begun = time.perf_counter()
    try:
        shares, steps = _shares(robots[job.task], dataset.trajectories[t], k, job, cancel)
    except (ValueError, RuntimeError) as error:
        return Shares([], 0, time.perf_counter() - begun, str(error))
    return Shares(shares, steps, time.perf_counter() - begun)


def _shares(
    task: ScriptedTask, trajectory: Trajectory, frame: int, job: Job, cancel: Cancel
) -> tuple[list[float], int]:
    """Shares by frame, and how many steps they took."""
    now = float(trajectory.times[frame])
    later = trajectory.times[frame + 1 : frame + 1 + max(HORIZONS)] - now
    horizon = round(later[-1] / task.step) * task.step
    plan = PLANS[job.method]
    problem = task.future(trajectory.states[frame], now, trajectory.params, horizon, plan)
    if job.method == NOMINAL:
        return nominal(problem, later, cancel)
    p = capture_probability(
        problem,
        disturbance=disturbances.Uniform(strength=job.strength, objects=job.objects),
        rollouts=job.rollouts,
        seed=stream(job.seed, job.index),
        cancel=cancel,
    )
    return share_by_frame(p.times, p.curve, later), p.steps


def nominal(
    problem: Problem, later: NDArray[np.float64], cancel: Cancel | None = None
) -> tuple[list[float], int]:
    """Whether the undisturbed future stays captured until `later` [s], shape (H,): 1 or 0 each, and
    the steps that it took."""
    step = problem.scene.step
    ends = np.round(later / step).astype(int)
    looks = sorted({*range(0, int(ends[-1]), LOOK), *ends.tolist()})
    world = World(problem.scene) if problem.plan is None else World(problem.scene, problem.plan)
    states = world.simulate(problem.state, looks[-1], record=looks, cancel=cancel).states
    inside = np.logical_and.accumulate(problem.captured.contains(problem.scene, states))
    return share_by_frame(np.array(looks) * step, inside.astype(float), later), int(ends[-1])


def share_by_frame(
    times: NDArray[np.float64], curve: NDArray[np.float64], later: NDArray[np.float64]
) -> list[float]:
    """A curve over `times` [s] at the latest one that is not after each of `later` [s]."""
    at = np.searchsorted(times, np.asarray(later) + 1e-9, side="right") - 1
    return [float(share) for share in np.asarray(curve)[at]]


def learned(
    states: NDArray[np.float64],
    labels: NDArray[np.bool_],
    trajectory: NDArray[np.int64],
    counts: NDArray[np.bool_],
    seed: int,
) -> NDArray[np.float64]:
    """A plain classifier's probability of each state that counts, shape (N,); NaN for others.

    Gradient-boosted trees on the raw states, shape (N, n). Each fifth of the trajectories is
    foreseen by a classifier that learned from the others.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.model_selection import GroupKFold
    from threadpoolctl import threadpool_limits  # of scikit-learn

    found = np.full(len(labels), np.nan)
    chosen = np.flatnonzero(counts)
    groups = trajectory[chosen]
    folds = min(FOLDS, len(np.unique(groups)))
    if folds < 2:
        return found
    for train, test in GroupKFold(folds).split(chosen, groups=groups):
        known = labels[chosen[train]]
        if known.all() or not known.any():  # nothing to tell apart
            found[chosen[test]] = float(known[0])
            continue
        classifier = HistGradientBoostingClassifier(random_state=seed)
        with threadpool_limits(1):  # so few states: threads that wait for each other take longer
            classifier.fit(states[chosen[train]], known)
            found[chosen[test]] = classifier.predict_proba(states[chosen[test]])[:, 1]
    return found
