"""The states of the authors' data, what is asked about them, and what scores answer: what holds for
the next frames, and, long before the end of a recorded push, whether it will succeed."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Cancel,
    CaptureScore,
    Plan,
    Problem,
    Scene,
    World,
    capture_probability,
    capture_score,
    disturbances,
    escape_effort,
    force_score,
    stream,
)
from energymargin_paper.paper import authors
from energymargin_paper.paper.authors.folder import SIMULATED, of_part
from energymargin_paper.paper.authors.reading import (
    Track,
    measured_states,
    recent_rates,
    recorded_dataset,
    recorded_task,
    separated,
    simulated_task,
    steady,
    tracks,
)
from energymargin_paper.paper.authors.recorded import PublishedRecorded
from energymargin_paper.paper.published_agreement import AGAIN, DEFINED
from energymargin_paper.probabilities import share_by_frame

__all__ = [
    "EARLY",
    "OBJECTS",
    "STRENGTH",
    "Asked",
    "Job",
    "Source",
    "StateScores",
    "early_success",
    "run",
    "source_of",
]

STRENGTH, OBJECTS = 0.6, 1  # of the disturbance: the one rule of docs/results/foresight.md
EARLY = tuple(range(9, 100, 10))  # frames of a recording's last 100
FRAME = 8 / 240  # s, of a recording
# The errors of a push that goes on: of the tool's speed and of its direction, as shares of the
# speed, and of its turn.
SPEED_ERROR, SIDE_ERROR, TURN_ERROR = 0.3, 0.1, 0.1  # -, -, rad/s
TAG_ERROR = 0.01  # m, of the tag's last place as against the observer's eye
STOP_Y = -0.1  # m: no tool of a recording is pushed on much nearer to the wall
ARM = (3.0, 1.0)  # N, N m, with which the arm holds the tool's velocity


@dataclass(frozen=True, eq=False)
class Asked:
    """The questions about one state."""

    now: Problem
    """As the authors' search asks it, without a clock."""
    defined: Problem
    """Capture as the paper defines it: with the set of the labels, where it was recorded."""
    effort: Problem
    """Problem of which the efforts are asked."""
    ahead: Problem | None
    """With a clock and what the robot does; None at the last frame."""
    later: NDArray[np.float64]
    """When the frames after it come [s]."""


class Source(ABC):
    """A part of the data."""

    simulated: bool
    tracks: tuple[Track, ...] = ()
    """Tracks of recordings."""
    smoothed: NDArray[np.bool_] | None = None
    """Labels from smoothed velocities, of recordings, shape (N,)."""

    def __init__(self, data: Path, name: str, horizons: Sequence[int], every: int) -> None:
        """Reads it, and the authors' scores. `horizons`: in frames; `every`: scored frame of a
        recording, all states of a simulation are scored."""
        self.name = name
        self.theirs = authors.labelled_scores(data, name)
        self.dataset = authors.dataset(data, name)
        self.places = self.dataset.frames()
        self.most = max(horizons)
        apart = 1 if self.simulated else every
        self.numbers = [n for n, (_, k) in enumerate(self.places) if k % apart == apart - 1]
        """Numbers of the states that are scored."""

    def later(self, index: int) -> NDArray[np.float64]:
        """When the frames after a state come [s]."""
        t, k = self.places[index]
        times = self.dataset.trajectories[t].times
        return np.asarray(times[k + 1 : k + 1 + self.most] - times[k])

    @abstractmethod
    def asked(self, index: int) -> Asked:
        """The questions about a state."""

    def early(self, index: int, rollouts: int, seed: int, cancel: Cancel) -> float | None:
        """Probability of success at the last frame, of every tenth frame of a recording."""
        return None


class Simulated(Source):
    """A source of Table I: the robot follows the mean of the authors' script."""

    simulated = True

    def __init__(self, data: Path, name: str, horizons: Sequence[int], every: int) -> None:
        """Reads it."""
        super().__init__(data, name, horizons, every)
        self._task = simulated_task(data, name)

    def asked(self, index: int) -> Asked:
        """The questions about a state."""
        t, k = self.places[index]
        trajectory, task, later = self.dataset.trajectories[t], self._task, self.later(index)
        state, params = trajectory.states[k], trajectory.params
        contacts = trajectory.contacts[k]
        now = task.problem(state, params, contacts)
        defined = task.recorded_problem(state, params, contacts)
        force, torque = task.effort_bounds(params)
        effort = now.replace(force=force, torque=torque)
        if not len(later):
            return Asked(now, defined, effort, None, later)
        horizon = round(float(later[-1]) / now.scene.step) * now.scene.step
        ahead = defined.replace(
            horizon=horizon,
            plan=task.plan(state, float(trajectory.times[k]), params, horizon),
            effector="coast",
            captured=task.captured_throughout(params),
            check=float(later[0]),  # the labels look at the frames alone
        )
        return Asked(now, defined, effort, ahead, later)


class Recorded(Source):
    """A source of Table II: the tool goes on as it did in the last half second."""

    simulated = False

    def __init__(self, data: Path, name: str, horizons: Sequence[int], every: int) -> None:
        """Reads it."""
        super().__init__(data, name, horizons, every)
        own = of_part(data, name)
        self.tracks = tuple(tracks(own))
        smoothed = recorded_dataset(data, own, smoothed=True)
        self.smoothed = np.concatenate([t.captured for t in smoothed.trajectories])
        self._task = recorded_task(data, name)
        self._scene = self._task.scene({})
        self._measured = [self._states(track, track.velocities) for track in self.tracks]
        self._recent = [
            self._states(track, {body: recent_rates(track, body) for body in track.poses})
            for track in self.tracks
        ]

    def _states(
        self, track: Track, rates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        return measured_states(self._scene, track, rates)

    def asked(self, index: int) -> Asked:
        """The questions about a state; its capture set is that of the poses as measured."""
        t, k = self.places[index]
        measured, later = self._measured[t][k], self.later(index)
        state = self.dataset.trajectories[t].states[k]
        task = self._task
        now = task.problem(state, {}).replace(captured=task.search_set(measured, {}))
        defined = now.replace(captured=task.captured(measured, {}))
        return Asked(now, defined, now, self._ahead(self._held(t, k), later), later)

    def early(self, index: int, rollouts: int, seed: int, cancel: Cancel) -> float | None:
        """Probability of success at the last frame, of every tenth frame."""
        t, k = self.places[index]
        if k not in EARLY:
            return None
        return early_success(
            *(self._task, self.tracks[t], k, self._held(t, k)),
            rollouts=rollouts,
            seed=seed,
            cancel=cancel,
        )

    def _held(self, t: int, k: int) -> NDArray[np.float64]:
        """The state with the velocities of the last half second."""
        return separated(World(self._scene), self._recent[t][k])

    def _ahead(self, state: NDArray[np.float64], later: NDArray[np.float64]) -> Problem | None:
        if not len(later):
            return None
        step = self._scene.step
        horizon = max(1, round(float(later[-1]) / step)) * step
        ahead: Problem = self._task.recorded_problem(state, {}).replace(
            horizon=horizon,
            plan=Plan.hold(self._scene, state, horizon),
            effector="coast",
            captured=self._task.captured_throughout({}),
            check=FRAME,
        )
        return ahead


def source_of(data: Path, name: str, horizons: Sequence[int], every: int) -> Source:
    """A part by its name."""
    return (Simulated if name in SIMULATED else Recorded)(data, name, horizons, every)


def early_success(
    task: PublishedRecorded,
    track: Track,
    frame: int,
    state: NDArray[np.float64],
    *,
    rollouts: int,
    seed: int,
    cancel: Cancel | None = None,
) -> float:
    """Probability that a recording ends well, at one of its frames with its state, shape (n,).

    The tool goes on to the last frame at its mean velocity since it began to move, with an error in
    each of the rollouts but the first. Of where the object then lies, the chance that the observer
    sees a success is a logistic of the distance to it, of the scale TAG_ERROR.
    """
    scene = task.scene({})
    steps = round((track.times[-1] - track.times[frame]) / scene.step)
    random = np.random.default_rng(stream(seed, 1000 * track.number + frame))
    mean = steady(track, frame)
    last = []
    for number in range(rollouts):
        rate = _with_error(mean, random) if number else mean
        reached = _pushed(scene, state, rate, steps, cancel)
        body = scene.unpack(reached)["object"]
        last.append((*body["position"][:2], body["yaw"]))
    margins = task.margin(np.array(last))
    return float(np.mean(1 / (1 + np.exp(np.minimum(margins / TAG_ERROR, 500.0)))))


def _with_error(rate: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.float64]:
    """A velocity x, y [m/s] and turn [rad/s]. Pushes go along y, so a side error is along x."""
    along, side, turn = random.standard_normal(3)
    speed = float(np.hypot(*rate[:2]))
    x, y = rate[:2] * (1 + SPEED_ERROR * along)
    return np.array([x + SIDE_ERROR * speed * side, y, TURN_ERROR * turn])


def _pushed(
    scene: Scene,
    state: NDArray[np.float64],
    rate: NDArray[np.float64],
    steps: int,
    cancel: Cancel | None,
) -> NDArray[np.float64]:
    """The state after so many steps of a tool that keeps its velocity until it is near the wall."""
    if steps < 1:
        return state
    start = state[scene.slice("effector").start + 1]
    y = start + rate[1] * scene.step * np.arange(steps)
    twists = np.zeros((steps, 6))
    twists[:, :2], twists[:, 5] = rate[:2], rate[2]
    twists[y < STOP_Y] = 0.0
    plan = Plan(scene.step, velocities={"effector": twists}, limits={"effector": ARM})
    return np.asarray(World(scene, plan).simulate(state, steps, cancel=cancel).states[-1])


@dataclass(frozen=True)
class Job:
    """One state."""

    version: str
    part: str
    index: int
    """Number among all states of the part."""
    nodes: int
    rollouts: int
    seed: int


@dataclass(frozen=True, eq=False)
class StateScores:
    """What came out of a job."""

    scores: dict[str, float]
    shares: list[float]
    """Captured throughout until h = 1, 2, ... frames later, as far as the trajectory goes."""
    replayed: list[float]
    """Captured until then by what the robot does without a disturbance, 0 or 1."""
    early: float | None
    """Probability of success at the last frame; of every tenth frame of a recording."""
    seconds: float
    error: str | None = None


def run(sources: Mapping[str, Source], job: Job, cancel: Cancel) -> StateScores:
    """All scores of a state."""
    begun = time.perf_counter()
    source = sources[job.part]
    seed = stream(job.seed, job.index)
    try:
        asked = source.asked(job.index)
        scores = _clockless(asked, job.nodes, seed, cancel)
        shares, replayed = [], []
        if asked.ahead is not None:
            p = capture_probability(
                asked.ahead,
                disturbance=disturbances.Uniform(strength=STRENGTH, objects=OBJECTS),
                rollouts=job.rollouts,
                seed=seed,
                cancel=cancel,
            )
            shares = share_by_frame(p.times, p.curve, asked.later)
            stays = p.undisturbed_time if not p.undisturbed else math.inf
            replayed = [float(stays > time) for time in asked.later]
        early = source.early(job.index, job.rollouts, job.seed, cancel)
    except (ValueError, RuntimeError) as error:
        return StateScores({}, [], [], None, time.perf_counter() - begun, str(error))
    return StateScores(scores, shares, replayed, early, time.perf_counter() - begun)


def _clockless(asked: Asked, nodes: int, seed: int, cancel: Cancel) -> dict[str, float]:
    """The scores of the paper, as published."""

    def field(problem: Problem, seed: int) -> CaptureScore:
        return capture_score(problem, nodes=nodes, seed=seed, cancel=cancel, warn=False)

    found = field(asked.now, seed)
    scores = {"capture": found.capture, "success": found.success}
    scores[AGAIN] = field(asked.now, stream(seed, 1)).capture
    scores[DEFINED] = field(asked.defined, seed).capture
    for planner in ("est", "rrt"):
        scores[f"effort/{planner}"] = escape_effort(
            asked.effort,
            planner=planner,
            nodes=nodes,
            seed=seed,
            search="published",
            cancel=cancel,
        ).effort
    scores["force"] = force_score(asked.now).force
    return {name: float(value) for name, value in scores.items() if value is not None}
