"""One trajectory of a task in both engines: its labels, and escapes and probabilities of states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin import tasks
from energymargin._core import (
    Cancel,
    Cancelled,
    Plan,
    Problem,
    Scene,
    World,
    capture_probability,
    escape_effort,
    stream,
)
from energymargin.base.aliases import Floats
from energymargin.model.scenes.mjcf_model import engine
from energymargin.mujoco import model_of, replay
from energymargin.mujoco.replay import Edge, EscapePlayer
from energymargin.mujoco.simulation import Simulation
from energymargin.tasks.scripted import ScriptedTask
from energymargin.tasks.trajectories import Trajectory

__all__ = [
    "AHEAD",
    "FRAMES",
    "QUESTIONS",
    "Both",
    "Escape",
    "Job",
    "Label",
    "Probability",
    "run",
    "twin",
]


FRAMES = 10  # of a trajectory
AHEAD = 5  # frames of a horizon
STILL, SCRIPT = "no clock", "script"
QUESTIONS = (STILL, SCRIPT)
LARGEST_SCALE = 1.2  # as the search's own finer simulation


@dataclass(frozen=True)
class Job:
    """One trajectory."""

    version: str
    task: str
    seed: int
    nodes: int
    rollouts: int
    strength: float
    parts: int
    """Number of MuJoCo's steps in one of ours."""


@dataclass(frozen=True)
class Label:
    """A frame of the script from the same start."""

    frame: int
    captured: bool
    captured_there: bool
    """In MuJoCo."""
    captured_coarse: bool
    """There, with steps as long as ours."""
    apart: float
    """The object here and there [m]."""


@dataclass(frozen=True)
class Escape:
    """A state that is captured now."""

    frame: int
    question: str
    effort: float | None
    """None: there is no escape."""
    escaped: bool
    """There, unchanged."""
    effort_there: float | None
    scale: float | None
    """The least one with which it leads out."""
    moved: float
    """How far the object goes here [m]."""
    apart: float
    """How far the object is there from where it is here [m]."""


@dataclass(frozen=True)
class Probability:
    """A state that is captured now, over a horizon of its script, under the same disturbances."""

    frame: int
    captured: float
    captured_there: float
    alike: float
    """Share of the rollouts with the same end."""


@dataclass(frozen=True, eq=False)
class Both:
    """What came out of a job."""

    success: bool
    success_there: bool
    labels: list[Label] = field(default_factory=list)
    escapes: list[Escape] = field(default_factory=list)
    probabilities: list[Probability] = field(default_factory=list)


def run(job: Job, cancel: Cancel) -> Both:
    """Both engines on one trajectory."""
    task = tasks.make(job.task)
    assert isinstance(task, ScriptedTask)
    trajectory = task.rollout(job.seed, FRAMES, cancel=cancel)
    there, coarse = (_script(task, job, parts, cancel) for parts in (job.parts, 1))
    captured, succeeded = task.labels(there, trajectory.params)
    of_coarse, _ = task.labels(coarse, trajectory.params)
    apart = _distances(task, trajectory, there)
    labels = [
        Label(k, bool(here), bool(captured[k]), bool(of_coarse[k]), apart[k])
        for k, here in enumerate(trajectory.captured)
    ]
    both = Both(bool(trajectory.success), bool(succeeded[-1]), labels)
    for frame in np.flatnonzero(trajectory.captured[:-1]):
        still = task.problem(trajectory.states[frame], trajectory.params)
        both.escapes.append(_escape(STILL, int(frame), still, job, cancel))
        if frame + AHEAD < FRAMES:
            future = _future(task, trajectory, int(frame))
            both.escapes.append(_escape(SCRIPT, int(frame), future, job, cancel))
            both.probabilities.append(_probability(int(frame), future, job, cancel))
    return both


def _script(task: ScriptedTask, job: Job, parts: int, cancel: Cancel) -> Floats:
    """The states of the frames in MuJoCo, shape (FRAMES, n), from the draws of `task.rollout`."""
    random = np.random.default_rng(job.seed)
    params = task.draw(random)
    world = World(task.scene(params))
    start = task.start(world, params, random)
    drive = task.drive(params, random)
    plan = Plan(task.step, wrenches=drive.wrenches, targets=drive.targets)
    simulation = Simulation(world.scene, *twin(world.scene, start, parts), plan)
    states = [start]
    for last in np.round(np.linspace(0, task.steps, FRAMES)).astype(int)[1:]:
        if cancel.is_set:
            raise Cancelled("cancelled while a script was played in MuJoCo")
        simulation.advance(last * parts - simulation.steps)
        states.append(simulation.state())
    return np.array(states)


def twin(scene: Scene, state: Floats, parts: int) -> tuple[Any, Any]:
    """Its model, and the data at the state."""
    mujoco = engine()
    model = model_of(scene, state, step=scene.step / parts)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def _distances(task: ScriptedTask, trajectory: Trajectory, there: Floats) -> list[float]:
    """Between the objects here and there [m], by frame."""
    at = task.scene(trajectory.params).slice("object").start
    ways = (trajectory.states - there)[:, at : at + 3]
    return [float(way) for way in np.linalg.norm(ways, axis=1)]


def _future(task: ScriptedTask, trajectory: Trajectory, frame: int) -> Problem:
    """The next AHEAD frames of the script."""
    times = np.round(trajectory.times / task.step) * task.step
    horizon = float(times[frame + AHEAD] - times[frame])
    state, params = trajectory.states[frame], trajectory.params
    return task.future(state, float(times[frame]), params, round(horizon / task.step) * task.step)


def _escape(question: str, frame: int, problem: Problem, job: Job, cancel: Cancel) -> Escape:
    seed = stream(job.seed, frame)
    escape = escape_effort(problem, nodes=job.nodes, seed=seed, cancel=cancel)
    if cancel.is_set:
        raise Cancelled("cancelled while an escape was searched")
    if not len(escape.path):
        return Escape(frame, question, None, False, None, None, 0.0, 0.0)
    model, data = twin(problem.scene, problem.state, job.parts)
    found = replay(model, data, problem, escape, largest_scale=LARGEST_SCALE, cancel=cancel)
    at = problem.scene.slice("object").start
    end = escape.tree.states[escape.path[-1]]
    moved = float(np.linalg.norm((end - problem.state)[at : at + 3]))
    out = found.effort if found.escaped else None
    seen = (found.escaped, out, found.least_scale)
    return Escape(frame, question, escape.effort, *seen, moved, found.distance)


def _probability(frame: int, problem: Problem, job: Job, cancel: Cancel) -> Probability:
    random = np.random.default_rng(stream(job.seed, frame))
    player = EscapePlayer(
        problem, problem.captured, *twin(problem.scene, problem.state, job.parts), cancel
    )
    here, there = [], []
    for _ in range(job.rollouts):
        pieces = list(_pieces(random, problem, job.strength))
        here.append(_stays(problem, pieces, cancel))
        there.append(not player.play(pieces).escaped)
    alike = np.mean(np.array(here) == np.array(there))
    return Probability(frame, float(np.mean(here)), float(np.mean(there)), float(alike))


def _pieces(random: np.random.Generator, problem: Problem, strength: float) -> Iterator[Edge]:
    """Pieces of a disturbance: even within a share of the bounds, each held for an even time."""
    step, bounds = problem.scene.step, strength * np.concatenate([problem.force, problem.torque])
    left, longest = round((problem.horizon or 0.0) / step), round(problem.duration / step)
    while left > 0:
        steps = min(left, int(random.integers(1, longest + 1)))
        yield Edge(random.uniform(-1.0, 1.0, (1, 6)) * bounds, steps * step)
        left -= steps


def _stays(problem: Problem, pieces: list[Edge], cancel: Cancel) -> bool:
    """Whether the object stays captured here."""
    steps = [round(piece.duration / problem.scene.step) for piece in pieces]
    rows = np.repeat([piece.wrenches[0] for piece in pieces], steps, axis=0)
    found = capture_probability(
        problem, disturbance=lambda random, times: rows, rollouts=1, cancel=cancel
    )
    return bool(found.captured)
