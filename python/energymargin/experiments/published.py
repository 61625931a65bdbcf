"""The authors' own data: their scores and ours on the same states.

The simulated trajectories of Table I and the recordings of Table II, from a folder that a user has
cloned (`energymargin.published`). Every state is one line of runs.jsonl in the output folder,
written as soon as it is scored: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import published
from energymargin._core import (
    Cancel,
    Plan,
    Problem,
    World,
    capture_probability,
    capture_score,
    disturbances,
    escape_effort,
    force_score,
    stream,
)
from energymargin.evaluation import LabelledScores
from energymargin.executors.threads import thread_count
from energymargin.experiments.foresight import learned, share_by_frame
from energymargin.experiments.jobs import complete_lines, finished
from energymargin.experiments.published_early import early_success
from energymargin.experiments.published_text import (
    EARLY,
    OBJECTS,
    PROBABILITY,
    STRENGTH,
    Early,
    Part,
    Published,
    Settings,
)
from energymargin.published.folder import SIMULATED, of_part
from energymargin.published.recordings import (
    Track,
    recent_rates,
    recorded_dataset,
    recorded_task,
    states_of,
    tracks,
)
from energymargin.tasks.base import Task

__all__ = ["reproduce"]

RUNS_FILE = "runs.jsonl"
FRAME = 8 / 240  # s, of a recording


@dataclass(frozen=True)
class Job:
    """One state."""

    version: str
    part: str
    index: int
    """Of all states of the part."""
    nodes: int
    rollouts: int
    seed: int


@dataclass(frozen=True)
class Row:
    """What came out of a job."""

    scores: dict[str, float]
    shares: list[float]
    """Captured throughout until h = 1, 2, ... frames later, as far as the trajectory goes."""
    early: float | None
    """Probability of success at the last frame; of every tenth frame of a recording."""
    seconds: float
    error: str | None = None


@dataclass(frozen=True)
class Asked:
    """The questions about one state."""

    now: Problem
    """As the authors ask it, without a clock."""
    ahead: Problem | None
    """With a clock and what the robot does; None at the last frame."""
    later: NDArray[np.float64]
    """When the frames after it come [s]."""


Asking = Callable[[int], Asked]


def reproduce(
    settings: Settings,
    data: Path,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Published:
    """Scores what is missing, and writes published.md and published.csv. `progress(done, total)`
    counts states. Raises ValueError on a folder `data` that has none of the data."""
    parts = [name for name in published.parts(data) if not settings.parts or name in settings.parts]
    wrong = [name for name in settings.parts if name not in parts]
    if wrong:
        raise ValueError(
            f"parts has {wrong[0]!r}, expected some of {', '.join(published.parts(data))}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    sources = {name: _Source(data, name, settings) for name in parts}
    jobs = [job for source in sources.values() for job in source.jobs()]
    rows = _rows(jobs, sources, folder, thread_count(threads), progress or (lambda _d, _t: None))
    result = Published(settings, [_part(source, rows) for source in sources.values()])
    (folder / "published.md").write_text(result.to_markdown())
    (folder / "published.csv").write_text(result.to_csv())
    return result


class _Source:
    """One part of the data: its states, the questions about them, and the authors' scores."""

    def __init__(self, data: Path, name: str, settings: Settings) -> None:
        self.name, self.settings = name, settings
        self.theirs = published.labelled_scores(data, name)
        self.simulated = name in SIMULATED
        if self.simulated:
            self.dataset = published.dataset(data, name)
            self.tracks: list[Track] = []
            self._task: Task = self.dataset._made
        else:
            own = of_part(data, name)
            self.dataset = recorded_dataset(data, own)
            self.smoothed = recorded_dataset(data, own, smoothed=True)
            self.tracks = tracks(own)
            self.recorded = recorded_task(data, name)
            world = World(self.recorded.scene({}))
            self._raw = [states_of(world, track, track.velocities) for track in self.tracks]
            self._held = [
                states_of(world, t, {b: recent_rates(t, b) for b in t.poses})[1]
                for t in self.tracks
            ]
        self.places = self.dataset.frames()
        self.numbers = [
            index
            for index, (_, k) in enumerate(self.places)
            if self.simulated or k % settings.every == settings.every - 1
        ]

    def jobs(self) -> list[Job]:
        """One a state that is scored."""
        s, program = self.settings, version("energymargin")
        return [Job(program, self.name, i, s.nodes, s.rollouts, s.seed) for i in self.numbers]

    def asked(self, index: int) -> Asked:
        """The questions about a state."""
        t, k = self.places[index]
        trajectory = self.dataset.trajectories[t]
        most = max(self.settings.horizons(self.simulated))
        later = np.asarray(trajectory.times[k + 1 : k + 1 + most] - trajectory.times[k])
        if self.simulated:
            return self._simulated(t, k, later)
        measured, parted = self._raw[t]
        now = self.recorded.problem(parted[k], {}).replace(
            captured=self.recorded.captured(measured[k], {})
        )
        return Asked(now, self._ahead(self._held[t][k], later), later)

    def _simulated(self, t: int, k: int, later: NDArray[np.float64]) -> Asked:
        trajectory, task = self.dataset.trajectories[t], self._task
        state, params = trajectory.states[k], trajectory.params
        now = task.problem(state, params, trajectory.contacts[k])
        if not len(later):
            return Asked(now, None, later)
        horizon = round(float(later[-1]) / now.scene.step) * now.scene.step
        ahead = now.replace(
            horizon=horizon,
            plan=task.plan(state, float(trajectory.times[k]), params, horizon),  # type: ignore[attr-defined]
            effector="coast",
            captured=task.captured_throughout(params),  # type: ignore[attr-defined]
            check=float(later[0]),  # the labels look at the frames alone
        )
        return Asked(now, ahead, later)

    def _ahead(self, state: NDArray[np.float64], later: NDArray[np.float64]) -> Problem | None:
        """Of a recording: the tool goes on as it did in the last half second."""
        if not len(later):
            return None
        scene = self.recorded.scene({})
        horizon = max(1, round(float(later[-1]) / scene.step)) * scene.step
        found: Problem = self.recorded.problem(state, {}).replace(
            horizon=horizon,
            plan=Plan.hold(scene, state, horizon),
            effector="coast",
            captured=self.recorded.captured_throughout({}),
            check=FRAME,
        )
        return found

    def early(self, index: int, cancel: Cancel) -> float | None:
        """Probability of success at the last frame, of every tenth frame of a recording."""
        t, k = self.places[index]
        if self.simulated or k not in EARLY:
            return None
        return early_success(
            *(self.recorded, self.tracks[t], k, self._held[t][k]),
            rollouts=self.settings.rollouts,
            seed=self.settings.seed,
            cancel=cancel,
        )


def _rows(
    jobs: Sequence[Job],
    sources: Mapping[str, _Source],
    folder: Path,
    threads: int,
    advance: Callable[[int, int], None],
) -> dict[Job, Row]:
    """Those of the file, and what was missing, which is added to it."""
    path = folder / RUNS_FILE
    rows = {}
    for line in complete_lines(path):
        job, row = json.loads(line)
        rows[Job(**job)] = Row(**row)
    missing = [job for job in jobs if job not in rows]
    done = len(jobs) - len(missing)
    advance(done, len(jobs))
    with path.open("a") as file:
        for job, row in finished(missing, partial(_run, sources), threads):
            file.write(json.dumps([asdict(job), asdict(row)]) + "\n")
            file.flush()
            rows[job] = row
            done += 1
            advance(done, len(jobs))
    return {job: rows[job] for job in jobs}


def _run(sources: Mapping[str, _Source], job: Job, cancel: Cancel) -> tuple[Job, Row]:
    begun = time.perf_counter()
    source = sources[job.part]
    seed = stream(job.seed, job.index)
    try:
        asked = source.asked(job.index)
        scores = _clockless(asked.now, job.nodes, seed, cancel)
        shares = []
        if asked.ahead is not None:
            p = capture_probability(
                asked.ahead,
                disturbance=disturbances.Uniform(strength=STRENGTH, objects=OBJECTS),
                rollouts=job.rollouts,
                seed=seed,
                cancel=cancel,
            )
            shares = share_by_frame(p.times, p.curve, asked.later)
        early = source.early(job.index, cancel)
    except (ValueError, RuntimeError) as error:
        return job, Row({}, [], None, time.perf_counter() - begun, str(error))
    return job, Row(scores, shares, early, time.perf_counter() - begun)


def _clockless(problem: Problem, nodes: int, seed: int, cancel: Cancel) -> dict[str, float]:
    """The scores of the paper, as published."""
    found = capture_score(problem, nodes=nodes, seed=seed, cancel=cancel, warn=False)
    scores = {"capture": found.capture, "success": found.success}
    for planner in ("est", "rrt"):
        scores[f"effort/{planner}"] = escape_effort(
            problem,
            planner,
            nodes=nodes,
            seed=seed,
            sampling="uniform",
            shorten=False,
            cancel=cancel,
        ).effort
    scores["force"] = force_score(problem).force
    return {name: float(value) for name, value in scores.items() if value is not None}


def _part(source: _Source, rows: Mapping[Job, Row]) -> Part:
    """What came out of a part, both sides on the same states."""
    own = {job.index: row for job, row in rows.items() if job.part == source.name}
    horizons = source.settings.horizons(source.simulated)
    states = source.dataset.size
    ours: dict[str, NDArray[np.float64]] = {}
    shares = {h: np.full(states, np.nan) for h in horizons if h > 0}
    for index, row in own.items():
        for name, value in row.scores.items():
            ours.setdefault(name, np.full(states, np.nan))[index] = value
        for h, of_horizon in shares.items():
            if len(row.shares) >= h:
                of_horizon[index] = row.shares[h - 1]
    lacking = np.ones(states, dtype=bool)
    lacking[[index for index, row in own.items() if row.error is None]] = False
    theirs = _without(source.theirs, lacking)
    labels = {"recorded": source.theirs}
    if not source.simulated:
        captured = np.concatenate([t.captured for t in source.smoothed.trajectories])
        labels["smoothed"] = _labelled(source.theirs, captured)
    return Part(
        name=source.name,
        horizons=tuple(horizons),
        complete=source.theirs,
        theirs=theirs.scores,
        ours=ours,
        probability=shares,
        labels=labels,
        learned={kind: _learned(source, of_kind, lacking) for kind, of_kind in labels.items()},
        early=_early_scores(source, own),
        failed=sum(row.error is not None for row in own.values()),
        seconds=float(np.mean([row.seconds for row in own.values()])) if own else math.nan,
    )


def _without(labelled: LabelledScores, lacking: NDArray[np.bool_]) -> LabelledScores:
    """The scores of those states alone that both sides have."""
    scores = {name: np.where(lacking, np.nan, values) for name, values in labelled.scores.items()}
    return LabelledScores(
        labelled.task, labelled.trajectory, labelled.captured, labelled.success, scores
    )


def _labelled(labelled: LabelledScores, captured: NDArray[np.bool_]) -> LabelledScores:
    """The same with other labels."""
    return LabelledScores(
        labelled.task, labelled.trajectory, captured, labelled.success, labelled.scores
    )


def _learned(
    source: _Source, labelled: LabelledScores, lacking: NDArray[np.bool_]
) -> dict[int, NDArray[np.float64]]:
    """By horizon, a plain classifier of the raw states, five-fold by trajectory."""
    trajectories = source.dataset.trajectories
    states = np.concatenate([trajectory.states for trajectory in trajectories])
    found = {}
    for horizon in source.settings.horizons(source.simulated):
        if horizon == 0:
            continue
        stays, whole = [], []
        for own in labelled.by_trajectory():
            captured = labelled.captured[own]
            ends = np.arange(len(own)) + horizon
            whole.append((ends < len(own)) & captured)
            stays.append([bool(captured[k : k + horizon + 1].all()) for k in range(len(own))])
        counts = np.concatenate(whole) & ~lacking
        found[horizon] = learned(
            states, np.concatenate(stays).astype(bool), labelled.trajectory, counts, 0
        )
    return found


def _early_scores(source: _Source, rows: Mapping[int, Row]) -> Early | None:
    """Scores of success by frame, of each recording; None of simulated data."""
    if source.simulated:
        return None
    members = source.theirs.by_trajectory()
    shape = (len(members), len(EARLY))
    found = {name: np.full(shape, np.nan) for name in (PROBABILITY, "success", "nearness")}
    for t, own in enumerate(members):
        for place, frame in enumerate(EARLY):
            if frame >= len(own):
                continue
            row = rows.get(int(own[frame]))
            if row is not None and row.early is not None:
                found[PROBABILITY][t, place] = row.early
            last = source.theirs.scores["success"][own[max(0, frame - 4) : frame + 1]]
            found["success"][t, place] = np.average(last, weights=np.arange(1, len(last) + 1))
            found["nearness"][t, place] = -source.tracks[t].poses["object"][frame, 1]
    return Early(np.array([track.success for track in source.tracks]), found)
