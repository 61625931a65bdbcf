"""States before a loss, of our tasks and of the authors' recordings, and their scores: what an
early warning can know. Of every score, higher is safer."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Cancel,
    Problem,
    Scene,
    capture_probability,
    capture_score,
    disturbances,
    stream,
)
from energymargin.datasets import Dataset
from energymargin.monitor import first_loss
from energymargin.tasks.base import Params
from energymargin.tasks.trajectories import Trajectory
from energymargin_paper.evidence.ceiling import scripted
from energymargin_paper.paper import authors
from energymargin_paper.paper.authors.folder import RECORDINGS
from energymargin_paper.paper.published_states import Source, source_of
from energymargin_paper.probabilities import share_by_frame

__all__ = [
    "PROBABILITY",
    "RECORDED",
    "SCORES",
    "THEIRS",
    "Episode",
    "Job",
    "Recordings",
    "StateScores",
    "Trajectories",
    "Watched",
    "recordings_of",
    "run",
]

STRENGTH, OBJECTS = 0.6, 2  # of the disturbance: the one rule of docs/results/foresight.md
PROBABILITY, TIME, CAPTURE = "probability", "mean-time", "capture"
UNDISTURBED, DISTANCE = "undisturbed", "distance"
THEIRS = "theirs"  # the authors' own capture score
SCORES = {
    PROBABILITY: "capture probability, script",
    TIME: "mean time captured, script",
    CAPTURE: "capture score",
    UNDISTURBED: "script alone: when it leaves",
    DISTANCE: "distance of the centres",
    THEIRS: "the authors' capture score",
}
RECORDED = "recordings"
AHEAD, RECORDED_AHEAD = (
    5,
    20,
)  # frames that a score looks ahead: of our tasks, of recordings (2/3 s)


@dataclass(frozen=True)
class Episode:
    """The frames of one trajectory up to its loss."""

    indices: tuple[int | None, ...]
    """Numbers of the frames' states in their dataset; None of a frame that is not scored."""
    lost: int | None
    """Frame of the loss, behind the last of them; None if it holds to its end."""


class Watched(ABC):
    """A group of trajectories, all drawn alike."""

    group: str
    episodes: list[Episode]
    ahead: int
    """Frames that a score looks ahead."""

    @abstractmethod
    def scores(self, index: int, job: Job, cancel: Cancel) -> dict[str, float]:
        """Scores of a state."""

    @property
    def scored(self) -> Iterator[int]:
        """States that have scores."""
        return (i for episode in self.episodes for i in episode.indices if i is not None)


class Trajectories(Watched):
    """Trajectories of a task of ours, whose robot follows its script."""

    ahead = AHEAD

    def __init__(self, group: str, dataset: Dataset, believed: Params | None = None) -> None:
        """`believed`: parameters that the model has in place of the trajectory's own."""
        self.group, self._dataset, self._believed = group, dataset, dict(believed or {})
        self._task = scripted(dataset)
        self._places = dataset.frames()
        self.episodes, first = [], 0
        for trajectory in dataset.trajectories:
            lost = self._lost(trajectory)
            last = len(trajectory) - 1 if lost is None else lost  # the last frame has no future
            self.episodes.append(Episode(tuple(range(first, first + last)), lost))
            first += len(trajectory)

    def _lost(self, trajectory: Trajectory) -> int | None:
        """The first frame by which it was outside.

        The labels are of the frames alone: what leaves between two of them and comes back is lost
        to a score, which looks more often, and has to be to them.
        """
        seen, times = first_loss(trajectory.captured), trajectory.times
        begin, whole = float(times[0]), float(times[-1] - times[0])
        future = self._task.future(trajectory.states[0], begin, trajectory.params, whole, "script")
        alone = capture_probability(future, rollouts=1, seed=0)
        if alone.undisturbed:
            return seen
        left = int(np.searchsorted(times - begin, alone.undisturbed_time - 1e-9))
        return left if seen is None else min(left, seen)

    def scores(self, index: int, job: Job, cancel: Cancel) -> dict[str, float]:
        """Scores of a state."""
        t, k = self._places[index]
        trajectory, task = self._dataset.trajectories[t], self._task
        state, params = trajectory.states[k], {**trajectory.params, **self._believed}
        now = float(trajectory.times[k])
        later = trajectory.times[k + 1 : k + 1 + self.ahead] - now
        whole = self.ahead * float(trajectory.times[1] - trajectory.times[0])
        horizon = round(float(later[-1]) / task.step) * task.step
        future = task.future(state, now, params, horizon, "script")
        plain = task.problem(state, params, trajectory.contacts[k])
        return _scores(_Asked(plain, future, later, horizon, whole), job, cancel)


class Recordings(Watched):
    """Recordings of one half of the authors': of each the longest time in which it is captured, by
    labels from velocities over half a second. The tool goes on as it did."""

    ahead = RECORDED_AHEAD

    def __init__(self, group: str, sources: Sequence[Source], half: int) -> None:
        """`half`: of the recordings of each combination, 0 or 1."""
        self.group, self._sources = group, sources
        self._first = np.cumsum([0, *(len(source.places) for source in sources)])
        self.episodes = [
            episode
            for number, source in enumerate(sources)
            for episode in _episodes(source, int(self._first[number]))[half::2]
        ]

    def scores(self, index: int, job: Job, cancel: Cancel) -> dict[str, float]:
        """Scores of a state."""
        number = int(np.searchsorted(self._first, index, side="right")) - 1
        source, own = self._sources[number], index - int(self._first[number])
        asked = source.asked(own)
        assert asked.ahead is not None  # the last frame of a recording is not scored
        horizon, whole = asked.ahead.horizon, float(asked.later[0]) * self.ahead
        assert horizon is not None  # as every problem with a plan here has one
        found = _scores(_Asked(asked.now, asked.ahead, asked.later, horizon, whole), job, cancel)
        return {**found, THEIRS: float(source.theirs.scores["capture"][own])}


def recordings_of(data: Path, every: int) -> list[Recordings]:
    """Both halves of the recordings in a folder; ValueError if it has none."""
    names = [name for name in authors.parts(data) if name in RECORDINGS]
    if not names:
        raise ValueError(f"data is {str(data)!r}, which has no recordings")
    sources = [source_of(data, name, (RECORDED_AHEAD,), every) for name in names]
    return [Recordings(f"{RECORDED}, {word} half", sources, k) for k, word in enumerate(HALVES)]


HALVES = ("one", "other")


def _episodes(source: Source, first: int) -> list[Episode]:
    assert source.smoothed is not None  # as all recordings have
    scored, begin, found = set(source.numbers), 0, []
    for trajectory in source.dataset.trajectories:
        frames = len(trajectory)
        start, stop = _longest(source.smoothed[begin : begin + frames])
        last = min(stop, frames - 1)
        places = [begin + k for k in range(start, last)]
        indices = tuple(first + place if place in scored else None for place in places)
        found.append(Episode(indices, None if stop == frames else stop - start))
        begin += frames
    return found


def _longest(captured: NDArray[np.bool_]) -> tuple[int, int]:
    """The longest run of frames that are captured: its first frame, and the one behind it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], captured, [False]]).astype(int)))
    starts, stops = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best])


@dataclass(frozen=True, eq=False)
class _Asked:
    """The questions about one state."""

    now: Problem
    """Without a clock."""
    ahead: Problem
    """With a clock and what the robot does."""
    later: NDArray[np.float64]
    """Times of the frames ahead [s]."""
    horizon: float
    """How far the one with a clock looks [s]."""
    whole: float
    """How far it would if there were frames enough [s]: a rollout that stays captured counts as 1,
    one that leaves as its time by this."""


def _scores(asked: _Asked, job: Job, cancel: Cancel) -> dict[str, float]:
    """Scores of a state, but for the authors'."""
    seed = stream(job.seed, job.index)
    objects = [body.name for body in asked.now.scene.bodies if body.role == "object"]
    p = capture_probability(
        asked.ahead,
        disturbance=disturbances.Uniform(strength=STRENGTH, objects=min(OBJECTS, len(objects))),
        rollouts=job.rollouts,
        seed=seed,
        cancel=cancel,
    )
    tree = capture_score(asked.now, nodes=job.nodes, seed=seed, cancel=cancel, warn=False)
    return {
        PROBABILITY: share_by_frame(p.times, p.curve, asked.later)[-1],
        TIME: min(p.captured + (p.mean_time - p.captured * asked.horizon) / asked.whole, 1.0),
        CAPTURE: float(tree.capture),
        UNDISTURBED: 1.0 if p.undisturbed else min(p.undisturbed_time / asked.whole, 1.0),
        DISTANCE: -_distance(asked.now.scene, asked.now.state),
    }


def _distance(scene: Scene, state: NDArray[np.float64]) -> float:
    """Between the mean centre of the objects and that of the effector's moving bodies [m]."""
    bodies, centres = scene.unpack(state), []
    for role in ("object", "effector"):
        own = [body.name for body in scene.bodies if body.role == role and body.name in bodies]
        centres.append(np.mean([bodies[name]["position"] for name in own], axis=0))
    return float(np.linalg.norm(centres[0] - centres[1]))


@dataclass(frozen=True)
class Job:
    """One state."""

    version: str
    task: str
    group: str
    trajectories: int
    index: int
    """Number of the state in its dataset."""
    rollouts: int
    nodes: int
    seed: int


@dataclass(frozen=True, eq=False)
class StateScores:
    """What came out of a job."""

    scores: dict[str, float]
    """By name; none if it failed."""
    seconds: float
    error: str | None = None


def run(watched: Mapping[tuple[str, str], Watched], job: Job, cancel: Cancel) -> StateScores:
    """All scores of a state; `watched` by task and group."""
    begun = time.perf_counter()
    try:
        scores = watched[job.task, job.group].scores(job.index, job, cancel)
    except (ValueError, RuntimeError) as error:
        return StateScores({}, time.perf_counter() - begun, str(error))
    return StateScores(scores, time.perf_counter() - begun)
