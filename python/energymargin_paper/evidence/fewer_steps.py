"""What it gains to use more of the simulation that is paid for: AUC and AP against computing time.

Each option is a way to score the states of a trajectory, compared with the plain way of its metric.
Every size and seed of an option is one file in the folder, written as soon as it is finished:
stopped and started again, the study goes on.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import (
    Cancel,
    CaptureScore,
    Problem,
    Tree,
    capture_score,
    escape_effort,
    stream,
)
from energymargin.checks import whole_number
from energymargin.datasets import Dataset
from energymargin.datasets.generation import load_or_generate
from energymargin.evaluation import LabelledScores
from energymargin.evaluation.labelled import HORIZON
from energymargin.limits import Limit
from energymargin.replacing import replace_text
from energymargin.results import collect
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.jobs import Jobs
from energymargin_paper.paper.quality import quality
from energymargin_paper.paper.table1 import check_tasks
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STUDY", "FewerSteps", "Measurement", "Point", "Settings", "figure_fewer_steps"]

FRAMES = 10
HEADER = ("score", "option", "rollouts", "ms", "steps", "AUC", "gain", "AP", "gain")


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on tasks that Table I lacks, or bad numbers."""

    tasks: tuple[str, ...] = setting(("push", "balance", "topple"), "Tasks, separated by commas.")
    trajectories: int = setting(50, "Trajectories of each task.")
    rollouts: tuple[int, ...] = setting(
        (10, 30, 100, 300), "Rollouts of each search, separated by commas."
    )
    seeds: int = setting(3, "Searches of each state.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        check_tasks(self.tasks)
        whole_number("trajectories", self.trajectories, 2)
        whole_number("seeds", self.seeds, 1)
        for rollouts in self.rollouts:
            whole_number("rollouts", rollouts, 1)


@dataclass(frozen=True)
class Job:
    """The states of one dataset, to be scored in one way."""

    version: str
    task: str
    trajectories: int
    option: str
    rollouts: int
    seed: int

    def path(self, folder: Path) -> Path:
        """Where it is kept."""
        option = self.option.replace(",", "").replace(" %", "").replace(" ", "-")
        return folder / "scores" / f"{self.task}-{option}-{self.rollouts}-{self.seed}.json"


@dataclass(frozen=True)
class Measurement:
    """A job that is done."""

    job: Job
    seconds: float
    """Computing time of a state, in the mean [s]."""
    steps: float
    """Simulation steps of a state, in the mean."""
    quality: dict[str, tuple[float, float]]
    """AUC and AP by metric, where there are both labels."""
    scores: dict[str, list[float]]
    """By metric, of each state."""


@dataclass(frozen=True)
class Point:
    """One size of one option: what its searches come to."""

    task: str
    metric: str
    option: str
    rollouts: int
    seconds: float
    steps: float
    quality: NDArray[np.float64]
    """AUC and AP of each seed, shape (seeds, 2)."""


@dataclass(frozen=True)
class FewerSteps:
    """The result."""

    settings: Settings
    runs: list[Measurement]

    def curve(self, task: str, metric: str, option: str) -> list[Point]:
        """The points of one option, by size."""
        points = []
        for rollouts in sorted(self.settings.rollouts):
            wanted = (task, option, rollouts)
            runs = [
                run
                for run in self.runs
                if (run.job.task, run.job.option, run.job.rollouts) == wanted
                and metric in run.quality
            ]
            if runs:
                seconds, steps = np.mean([(run.seconds, run.steps) for run in runs], axis=0)
                quality = np.array([run.quality[metric] for run in runs])
                points.append(
                    Point(task, metric, option, rollouts, float(seconds), float(steps), quality)
                )
        return points

    def points(self) -> Iterator[Point]:
        """All, in the order of the tables."""
        for task, metric, option in product(self.settings.tasks, PLAIN, OPTIONS):
            yield from self.curve(task, metric, option)

    def gain(self, point: Point) -> NDArray[np.float64]:
        """How far a point's AUC and AP lie above the plain curve of the same seed at as many
        simulation steps, shape (seeds, 2).

        The curve is straight over the logarithm of the steps, and level beyond its ends.
        """
        plain = self.curve(point.task, point.metric, PLAIN[point.metric])
        steps = np.log([other.steps for other in plain])
        return np.array(
            [
                [
                    own - np.interp(np.log(point.steps), steps, [o.quality[seed, i] for o in plain])
                    for i, own in enumerate(values)
                ]
                for seed, values in enumerate(point.quality)
            ]
        )

    def to_csv(self) -> str:
        """One line a point."""
        header = (
            *("task", "score", "option", "rollouts", "seconds", "steps"),
            *(f"{q}{what}" for q in ("auc", "ap") for what in ("", "_sd", "_gain", "_gain_sd")),
        )
        rows = []
        for p in self.points():
            numbers = [
                number
                for value, gain in zip(p.quality.T, self.gain(p).T, strict=True)
                for number in (value.mean(), _deviation(value), gain.mean(), _deviation(gain))
            ]
            rows.append((p.task, p.metric, p.option, p.rollouts, p.seconds, p.steps, *numbers))
        return csv_text(header, rows)

    def to_markdown(self) -> str:
        """One table a task."""
        s = self.settings
        parts = [
            f"AUC and AP of {s.trajectories} trajectories of {FRAMES} states (captured over the "
            f"next {HORIZON} frames; success of the trajectory), means of {s.seeds} seeds. Gain: "
            "over the plain search of the same seed at as many simulation steps, ± standard "
            "deviation over the seeds."
        ]
        for task in s.tasks:
            rows = [self._line(point) for point in self.points() if point.task == task]
            parts += [f"**{task}**", markdown_table(HEADER, rows)]
        return "\n\n".join(parts) + "\n"

    def _line(self, p: Point) -> list[str]:
        cells = [p.metric, p.option, str(p.rollouts), f"{1e3 * p.seconds:.2f}", f"{p.steps:.0f}"]
        for value, gain in zip(p.quality.T, self.gain(p).T, strict=True):
            plain = p.option == PLAIN[p.metric]
            cells += [
                f"{value.mean():.3f}",
                "" if plain else f"{gain.mean():+.3f} ± {_deviation(gain):.3f}",
            ]
        return cells


class FewerStepsStudy(Study[Settings, FewerSteps]):
    """What it gains to use more of each rollout: AUC and AP against computing time.

    States on the way of a rollout as nodes; the tree of the frame before; rollouts that end at the
    escape. Each is compared with the plain search at as many simulation steps.

    The folder gets fewer_steps.md, fewer_steps.csv, fewer_steps.png, the trajectories (TASK.h5) and
    all scores (scores/*.json). It takes half an hour; stop it with Ctrl-C: the same command goes on
    from there.

    Example: `energymargin reproduce fewer-steps --tasks topple --rollouts 10,30`
    """

    name = "fewer-steps"
    title, unit = "Scoring", "runs"
    settings = Settings()
    quick = Settings(trajectories=20, rollouts=(10, 30), seeds=2)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> FewerSteps:
        """Makes every run that is not in the folder yet, each on one thread of a process of its
        own. Raises ValueError on a folder of other settings."""
        (folder / "scores").mkdir(exist_ok=True)
        for task in settings.tasks:
            _dataset(folder, task, settings.trajectories)
        jobs = list(_jobs(settings))
        runs = {job: run for job in jobs if (run := _kept(job, folder)) is not None}
        progress(len(runs), len(jobs))
        missing = [job for job in jobs if job not in runs]

        def add(finished: Sequence[Measurement]) -> None:
            runs.update({run.job: run for run in finished})
            progress(len(runs), len(jobs))

        pool = ProcessPoolExecutor(threads, multiprocessing.get_context("spawn"))
        workers = Jobs(pool, threads, partial(_run, folder=folder), missing, Cancel())
        collect(workers, add, Limit())
        return FewerSteps(settings, [runs[job] for job in jobs])

    def figures(self, result: FewerSteps) -> Iterator[tuple[str, Figure]]:
        """AUC and AP against the computing time of a state."""
        yield "fewer_steps.png", figure_fewer_steps(result)


STUDY = FewerStepsStudy()


def _jobs(settings: Settings) -> Iterator[Job]:
    made_by = version("energymargin")
    for seed, task, rollouts, option in product(
        range(settings.seeds), settings.tasks, settings.rollouts, OPTIONS
    ):
        yield Job(made_by, task, settings.trajectories, option, rollouts, seed)


def _dataset(folder: Path, task: str, trajectories: int) -> Dataset:
    path = folder / f"{task}.h5"
    return load_or_generate(path, tasks.make(task), trajectories, FRAMES, seed=0)


def _kept(job: Job, folder: Path) -> Measurement | None:
    path = job.path(folder)
    if not path.exists():
        return None
    kept = json.loads(path.read_text())
    if kept.pop("job") != asdict(job):
        raise ValueError(f"{path} holds other scores: remove it, or choose another folder")
    quality = {metric: (auc, ap) for metric, (auc, ap) in kept.pop("quality").items()}
    return Measurement(job, quality=quality, **kept)


def _run(job: Job, folder: Path) -> Measurement:
    """Scores all states, and keeps the file. The process does nothing else meanwhile, so that its
    time is the searches'."""
    dataset = _dataset(folder, job.task, job.trajectories)
    problems, score = dataset.problems(), OPTIONS[job.option]
    found = []
    start = time.process_time()
    for first in range(0, len(problems), FRAMES):
        own = range(first, first + FRAMES)
        seeds = [stream(job.seed, i) for i in own]
        found += score([problems[i] for i in own], job.rollouts, seeds)
    seconds = time.process_time() - start
    scores = {metric: [state.scores[metric] for state in found] for metric in found[0].scores}
    run = Measurement(
        job,
        seconds=seconds / len(found),
        steps=float(np.mean([state.steps for state in found])),
        quality=_quality(dataset, scores),
        scores=scores,
    )
    replace_text(job.path(folder), json.dumps(asdict(run)))
    return run


def _quality(dataset: Dataset, scores: dict[str, list[float]]) -> dict[str, tuple[float, float]]:
    """AUC and AP of each score against its label."""
    trajectories = dataset.trajectories
    labelled = LabelledScores(
        task=dataset.task,
        trajectory=np.repeat(np.arange(len(trajectories)), FRAMES),
        captured=np.concatenate([t.captured for t in trajectories]),
        success=np.repeat([t.success for t in trajectories], FRAMES),
        scores={metric: np.array(values) for metric, values in scores.items()},
    )
    return quality(labelled)


def _deviation(values: NDArray[np.float64]) -> float:
    """Standard deviation; 0 of a single value."""
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


# The ways to score the states of a trajectory that are compared.
TREES = 4  # of `several_trees`
SHARE = 0.5  # of the frame before, beside the state's own tree


@dataclass(frozen=True)
class StateScores:
    """The scores of one state."""

    scores: dict[str, float]
    """By metric."""
    steps: int
    """How many simulation steps they took."""


TrajectoryScores = list[StateScores]
Score = Callable[[Sequence[Problem], int, Sequence[int]], TrajectoryScores]
"""Of the states of one trajectory, with so many rollouts and a seed for each."""


def capture(nodes_per_edge: int = 1, least_likelihood: float = 0.0) -> Score:
    """Capture and success score, with so many nodes of each rollout, up to where they matter."""

    def score(problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]) -> TrajectoryScores:
        return [
            _state_scores(
                problem, _grown(problem, rollouts, seed, nodes_per_edge, least_likelihood)
            )
            for problem, seed in zip(problems, seeds, strict=True)
        ]

    return score


def with_frame_before(
    problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]
) -> TrajectoryScores:
    """Capture and success score, in part of the tree of the frame before in the sets of now."""
    grown = [_grown(p, rollouts, seed) for p, seed in zip(problems, seeds, strict=True)]
    found = [_state_scores(problems[0], grown[0])]
    for problem, own, before in zip(problems[1:], grown[1:], grown, strict=False):
        now, old = _state_scores(problem, own), _inside(problem, before)
        scores = {
            metric: (value + SHARE * old[metric]) / (1 + SHARE)
            for metric, value in now.scores.items()
        }
        found.append(StateScores(scores, now.steps))
    return found


def several_trees(
    problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]
) -> TrajectoryScores:
    """Mean scores of trees that share the rollouts, as threads grow them at once."""
    found = []
    for problem, seed in zip(problems, seeds, strict=True):
        trees = [
            _state_scores(problem, _grown(problem, max(rollouts // TREES, 1), stream(seed, i)))
            for i in range(TREES)
        ]
        scores = {
            metric: sum(tree.scores[metric] for tree in trees) / TREES for metric in trees[0].scores
        }
        found.append(StateScores(scores, sum(tree.steps for tree in trees)))
    return found


def effort(*, shorten: bool, stop_at_escape: bool) -> Score:
    """Effort of escape by AO-EST; without `shorten`, as published."""

    def score(problems: Sequence[Problem], rollouts: int, seeds: Sequence[int]) -> TrajectoryScores:
        found = []
        for problem, seed in zip(problems, seeds, strict=True):
            escape = escape_effort(
                problem,
                nodes=rollouts,
                seed=seed,
                search="improved" if shorten else "published",
                stop_at_escape=stop_at_escape,
            )
            found.append(
                StateScores({"effort/est": escape.effort}, int(_steps(escape.tree, problem).sum()))
            )
        return found

    return score


OPTIONS: dict[str, Score] = {
    "ends alone": capture(),
    "four trees": several_trees,
    "2 nodes an edge": capture(2),
    "4 nodes an edge": capture(4),
    "8 nodes an edge": capture(8),
    "likely 1 %": capture(least_likelihood=0.01),
    "likely 10 %": capture(least_likelihood=0.1),
    "likely 10 %, 4 nodes": capture(4, 0.1),
    "frame before": with_frame_before,
    "as published": effort(shorten=False, stop_at_escape=False),
    "stop at escape": effort(shorten=False, stop_at_escape=True),
    "shortened": effort(shorten=True, stop_at_escape=False),
    "shortened, stop at escape": effort(shorten=True, stop_at_escape=True),
}
PLAIN = {"capture": "ends alone", "success": "ends alone", "effort/est": "as published"}
"""By metric, the option that the others are compared with."""


def _grown(
    problem: Problem,
    rollouts: int,
    seed: int,
    nodes_per_edge: int = 1,
    least_likelihood: float = 0.0,
) -> CaptureScore:
    return capture_score(
        problem,
        nodes=nodes_per_edge * rollouts,
        seed=seed,
        nodes_per_edge=nodes_per_edge,
        least_likelihood=least_likelihood,
        warn=False,
    )


def _state_scores(problem: Problem, score: CaptureScore) -> StateScores:
    assert score.success is not None  # every task has a success set
    steps, tree = _steps(score.tree, problem), score.tree
    on_the_way = (tree.parents[1:] == tree.parents[:-1]) & (
        tree.controls[1:] == tree.controls[:-1]
    ).all(axis=1)
    own = int(steps.sum() - steps[:-1][on_the_way].sum())
    return StateScores({"capture": score.capture, "success": score.success}, own)


def _inside(problem: Problem, score: CaptureScore) -> dict[str, float]:
    """The scores that a tree has in a problem's sets."""
    assert problem.succeeded is not None
    sets = {"capture": problem.captured, "success": problem.succeeded}
    return {
        metric: float(score.likelihoods @ region.contains(problem.scene, score.tree.states))
        for metric, region in sets.items()
    }


def _steps(tree: Tree, problem: Problem) -> NDArray[np.int64]:
    """Of the edge that leads to each node."""
    return np.round(tree.durations / problem.scene.step).astype(np.int64)


# Okabe and Ito's colours, which all eyes tell apart; markers too, for print in grey.
STYLES = {
    "ends alone": ("#000000", "o"),
    "four trees": ("#999999", "<"),
    "2 nodes an edge": ("#56B4E9", "v"),
    "likely 1 %": ("#F0E442", "P"),
    "likely 10 %": ("#009E73", "X"),
    "likely 10 %, 4 nodes": ("#D55E00", "*"),
    "4 nodes an edge": ("#0072B2", "s"),
    "8 nodes an edge": ("#CC79A7", "D"),
    "frame before": ("#E69F00", "^"),
    "as published": ("#000000", "o"),
    "stop at escape": ("#0072B2", "s"),
    "shortened": ("#E69F00", "^"),
    "shortened, stop at escape": ("#009E73", "D"),
}
SHOWN = {"capture": "capture score", "effort/est": "effort of escape, AO-EST"}
QUALITIES = ("AUC", "AP")


def figure_fewer_steps(result: FewerSteps) -> Figure:
    """A row a task, a column for each score's AUC and AP; error bars are standard deviations."""
    from matplotlib.figure import Figure

    tasks = result.settings.tasks
    columns = list(product(SHOWN, range(len(QUALITIES))))
    figure = Figure(figsize=(12, 2.6 * len(tasks) + 0.6), dpi=200, layout="constrained")
    axes = figure.subplots(len(tasks), len(columns), squeeze=False)
    for row, task in enumerate(tasks):
        for column, (metric, measure) in enumerate(columns):
            ax = axes[row, column]
            _draw(ax, result, task, metric, measure)
            if column == 0:
                ax.set_ylabel(task, fontsize=9)
            if row == 0:
                ax.set_title(f"{SHOWN[metric]}: {QUALITIES[measure]}", fontsize=9)
            if row == len(tasks) - 1:
                ax.set_xlabel("computing time of a state [ms]", fontsize=8)
    for first, side in ((0, "left"), (len(QUALITIES), "right")):
        handles, labels = axes[0, first].get_legend_handles_labels()
        where: Any = f"outside lower {side}"
        figure.legend(handles, labels, loc=where, ncols=4, frameon=False, fontsize=7)
    return figure


def _draw(ax: Axes, result: FewerSteps, task: str, metric: str, measure: int) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter

    for option in OPTIONS:
        points = result.curve(task, metric, option)
        if not points:
            continue
        color, marker = STYLES[option]
        values = [p.quality[:, measure] for p in points]
        ax.errorbar(
            [1e3 * p.seconds for p in points],
            [v.mean() for v in values],
            yerr=[v.std(ddof=1) if len(v) > 1 else 0.0 for v in values],
            color=color,
            marker=marker,
            markersize=3.5,
            linewidth=1.2,
            elinewidth=0.6,
            label=option,
        )
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25, linewidth=0.5)
