"""The authors' own data: their scores and ours on the same states.

The simulated trajectories of Table I and the recordings of Table II, from a folder that a user has
cloned (`energymargin.published`). Every state is one line of runs.jsonl in the output folder,
written as soon as it is scored: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from energymargin_paper.foresight import learned, share_by_frame
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.published_sources import Source, source_of
from energymargin_paper.published_text import (
    EARLY,
    OBJECTS,
    PROBABILITY,
    STRENGTH,
    Early,
    Part,
    Published,
    Settings,
)
from energymargin_paper.study import Progress, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from energymargin.plots.styles import LineStyle

__all__ = ["STUDY", "figure_published"]

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


class PublishedStudy(Study[Settings, Published]):
    """The authors' own data: their scores and ours on the same states, cell by cell.

    The folder gets published.md, published.csv, published.png and runs.jsonl. The half of the data
    takes half an hour on two cores; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce published --data dynamicCageForMPPI-data --parts push,balance`
    """

    name = "published"
    title, unit = "Scoring", "states"
    settings = Settings()
    quick = Settings(nodes=20, rollouts=8, every=10)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Published:
        """Scores what is missing. Raises ValueError on a folder that has none of the data."""
        data = Path(settings.data)
        every = published.parts(data)
        wrong = [name for name in settings.parts if name not in every]
        if wrong:
            raise ValueError(f"parts has {wrong[0]!r}, expected some of {', '.join(every)}")
        parts = [name for name in every if not settings.parts or name in settings.parts]
        sources = {name: source_of(data, name, settings) for name in parts}
        jobs = [job for source in sources.values() for job in _jobs(source, settings)]
        path, run = folder / RUNS_FILE, partial(_run, sources)
        rows = resumed(path, jobs, run, threads, lines=pairs(Job, Row), progress=progress)
        return Published(settings, [_part(source, settings, rows) for source in sources.values()])

    def figures(self, result: Published) -> Iterator[tuple[str, Figure]]:
        """AUC by horizon, theirs and ours, and how early success is known."""
        yield "published.png", figure_published(result)


STUDY = PublishedStudy()


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
            planner,
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


LINES = (
    ("theirs", "capture", "capture, theirs"),
    ("ours", "capture", "capture, ours"),
    ("ours", PROBABILITY, "probability, ours"),
)


def figure_published(result: Published) -> Figure:
    """A panel for each simulated part, one for the recordings, one for early success: states that
    are captured now."""
    from matplotlib.figure import Figure

    panels: list[tuple[str, list[Part]]] = [(part.name, [part]) for part in result.simulated]
    if result.recorded:
        panels.append(("recordings, smoothed labels", result.recorded))
    columns = len(panels) + bool(result.recorded)
    figure = Figure(figsize=(2.6 * columns + 0.6, 3.2), dpi=200, layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False, sharey=True)[0]
    for ax, (title, parts) in zip(axes, panels, strict=False):
        _draw(ax, title, parts)
    if result.recorded:
        _draw_early(axes[-1], result)
    axes[0].set_ylabel("AUC, captured now")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(ax: Axes, title: str, parts: list[Part]) -> None:
    from energymargin.plots.styles import PALETTE

    kind = "recorded" if parts[0].simulated else "smoothed"
    horizons = [h for h in parts[0].horizons if h > 0]
    for (side, score, label), style in zip(LINES, PALETTE, strict=False):
        values = [_mean(parts, side, score, h, kind) for h in horizons]
        ax.plot(horizons, values, label=label, **_look(style))
    _finish(ax, title, "horizon [frames]")


def _draw_early(ax: Axes, result: Published) -> None:
    from energymargin.plots.styles import PALETTE

    places = range(len(EARLY))
    for name, style in (("success", PALETTE[0]), (PROBABILITY, PALETTE[2])):
        ax.plot(EARLY, [result.early_auc(name, place) for place in places], **_look(style))
    _finish(ax, "recordings: success known early", "frame of the last 100")


def _mean(parts: list[Part], side: str, score: str, horizon: int, kind: str) -> float:
    cells = [part.cell(side, score, horizon, "captured", kind) for part in parts]
    aucs = [cell[0] for cell in cells if cell is not None]
    return float(np.mean(aucs)) if aucs else float("nan")


def _finish(ax: Axes, title: str, xlabel: str) -> None:
    from energymargin.plots.styles import CHANCE_COLOR, light_grid

    ax.axhline(0.5, color=CHANCE_COLOR, linestyle=":", linewidth=1.0)
    ax.set(xlabel=xlabel, ylim=(0.4, 1.02))
    ax.set_title(title, fontsize=9)
    light_grid(ax)


def _look(style: LineStyle) -> dict[str, Any]:
    return {
        "color": style.color,
        "linestyle": style.dashes,
        "marker": style.marker,
        "markersize": 4,
    }
