"""The authors' own data: their scores and ours on the same states.

The simulated trajectories of Table I and the recordings of Table II, from a folder that a user has
cloned (`energymargin.published`). Every state is one line of runs.jsonl in the output folder,
written as soon as it is scored: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import published
from energymargin._core import (
    Cancel,
    Problem,
    capture_probability,
    capture_score,
    disturbances,
    escape_effort,
    force_score,
    stream,
)
from energymargin.evaluation import LabelledScores
from energymargin.evaluation.labelled import compared_states
from energymargin.executors.threads import thread_count
from energymargin.experiments.foresight import learned, share_by_frame
from energymargin.experiments.jobs import pairs, resumed
from energymargin.experiments.published_sources import Source, source_of
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

__all__ = ["reproduce"]

RUNS_FILE = "runs.jsonl"


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
    sources = {name: source_of(data, name, settings) for name in parts}
    jobs = [job for source in sources.values() for job in _jobs(source, settings)]
    rows = resumed(
        folder / RUNS_FILE,
        jobs,
        partial(_run, sources),
        thread_count(threads),
        lines=pairs(Job, Row),
        progress=progress,
    )
    result = Published(settings, [_part(source, settings, rows) for source in sources.values()])
    (folder / "published.md").write_text(result.to_markdown())
    (folder / "published.csv").write_text(result.to_csv())
    return result


def _jobs(source: Source, settings: Settings) -> Iterator[Job]:
    """One a state that is scored."""
    program = version("energymargin")
    for index in source.numbers:
        yield Job(program, source.name, index, settings.nodes, settings.rollouts, settings.seed)


def _run(sources: Mapping[str, Source], job: Job, cancel: Cancel) -> tuple[Job, Row]:
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
        early = source.early(job.index, job.rollouts, job.seed, cancel)
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
            planner=planner,
            nodes=nodes,
            seed=seed,
            search="published",
            cancel=cancel,
        ).effort
    scores["force"] = force_score(problem).force
    return {name: float(value) for name, value in scores.items() if value is not None}


def _part(source: Source, settings: Settings, rows: Mapping[Job, Row]) -> Part:
    """What came out of a part, both sides on the same states."""
    own = {job.index: row for job, row in rows.items() if job.part == source.name}
    horizons = settings.horizons(source.simulated)
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
    theirs = {n: np.where(lacking, np.nan, own) for n, own in source.theirs.scores.items()}
    labels = {"recorded": source.theirs}
    if source.smoothed is not None:
        labels["smoothed"] = replace(source.theirs, captured=source.smoothed)
    return Part(
        name=source.name,
        horizons=tuple(horizons),
        complete=source.theirs,
        theirs=theirs,
        ours=ours,
        probability=shares,
        labels=labels,
        learned={
            kind: _learned(source, own_labels, lacking, horizons)
            for kind, own_labels in labels.items()
        },
        early=_early_scores(source, own),
        failed=sum(row.error is not None for row in own.values()),
        seconds=float(np.mean([row.seconds for row in own.values()])) if own else math.nan,
    )


def _learned(
    source: Source,
    labelled: LabelledScores,
    lacking: NDArray[np.bool_],
    horizons: Sequence[int],
) -> dict[int, NDArray[np.float64]]:
    """By horizon, a plain classifier of the raw states, five-fold by trajectory."""
    trajectories = source.dataset.trajectories
    states = np.concatenate([trajectory.states for trajectory in trajectories])
    everyone = replace(labelled, scores={"one": np.zeros(len(states))})
    found = {}
    for horizon in horizons:
        if horizon == 0:
            continue
        compared = compared_states(everyone, "one", horizon, among="captured")
        counts, stays = np.zeros(len(states), dtype=bool), np.zeros(len(states), dtype=bool)
        counts[compared.number], stays[compared.number] = True, compared.labels
        found[horizon] = learned(states, stays, labelled.trajectory, counts & ~lacking, 0)
    return found


def _early_scores(source: Source, rows: Mapping[int, Row]) -> Early | None:
    """Scores of success by frame, of each recording; None of simulated data."""
    tracks = source.tracks
    if not tracks:
        return None
    members = source.theirs.by_trajectory()
    shape = (len(members), len(EARLY))
    found = {name: np.full(shape, np.nan) for name in (PROBABILITY, "success", "nearness")}
    for t, own in enumerate(members):
        for place, frame in enumerate(EARLY):
            if frame >= len(own):
                break
            row = rows.get(int(own[frame]))
            if row is not None and row.early is not None:
                found[PROBABILITY][t, place] = row.early
            last = source.theirs.scores["success"][own[max(0, frame - 4) : frame + 1]]
            found["success"][t, place] = np.average(last, weights=np.arange(1, len(last) + 1))
            found["nearness"][t, place] = -tracks[t].poses["object"][frame, 1]
    return Early(np.array([track.success for track in tracks]), found)
