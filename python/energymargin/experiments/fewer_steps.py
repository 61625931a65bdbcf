"""What it gains to use more of the simulation that is paid for: AUC and AP against computing time.

Each option is one way to score the states of a trajectory. It is held against the plain way of its
metric, at as many rollouts, and at as much simulation. Every size and seed of an option is one file
in the folder, written as soon as it is finished: stopped and started again, the study goes on.
"""

from __future__ import annotations

import csv
import io
import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import datasets, tasks
from energymargin._core import stream
from energymargin.datasets import Dataset
from energymargin.evaluation import HORIZON, Cell, LabelledScores, evaluate
from energymargin.experiments.fewer_steps_options import OPTIONS, PLAIN
from energymargin.experiments.table1 import paper_tasks
from energymargin.scoring import held_interrupts, thread_count
from energymargin.tasks.base import whole_number

__all__ = ["METRICS", "FewerSteps", "Point", "Run", "Settings", "reproduce"]

METRICS = ("capture", "success", "effort/est")
FRAMES = 10


@dataclass(frozen=True)
class Settings:
    """Of the study."""

    tasks: tuple[str, ...] = ()
    """Those of the paper's table, if there are none."""
    options: tuple[str, ...] = tuple(OPTIONS)
    trajectories: int = 50
    rollouts: tuple[int, ...] = (10, 30, 100, 300)
    """Of each search."""
    seeds: int = 3
    """Searches of each state."""

    def checked(self) -> Settings:
        """With its tasks; ValueError on a task or option that there is not, or on bad numbers."""
        for what, names, known in (
            ("tasks", self.tasks, paper_tasks()),
            ("options", self.options, list(OPTIONS)),
        ):
            wrong = [name for name in names if name not in known]
            if wrong:
                raise ValueError(f"{what} has {wrong[0]!r}, expected some of {', '.join(known)}")
        whole_number("trajectories", self.trajectories, 2)
        whole_number("seeds", self.seeds, 1)
        for rollouts in self.rollouts:
            whole_number("rollouts", rollouts, 1)
        return Settings(
            self.tasks or tuple(paper_tasks()),
            self.options,
            self.trajectories,
            self.rollouts,
            self.seeds,
        )


@dataclass(frozen=True)
class Job:
    """The states of one dataset, scored in one way."""

    version: str
    task: str
    trajectories: int
    option: str
    rollouts: int
    seed: int

    def path(self, folder: Path) -> Path:
        """Where it is kept."""
        option = self.option.replace("/", "-").replace(" ", "-")
        return folder / "scores" / f"{self.task}-{option}-{self.rollouts}-{self.seed}.json"


@dataclass(frozen=True)
class Run:
    """A job that is done."""

    job: Job
    seconds: float
    """Computing time of a state, in the mean [s]."""
    steps: float
    """Simulation steps of a state, in the mean."""
    scores: dict[str, list[float]]
    """By metric, of each state."""
    cells: dict[str, Cell | None]
    """By metric, against the labels."""


@dataclass(frozen=True)
class Point:
    """One size of one option: what its searches with several seeds come to."""

    task: str
    option: str
    metric: str
    rollouts: int
    seconds: float
    steps: float
    auc: NDArray[np.float64]
    """By seed."""
    ap: NDArray[np.float64]


@dataclass(frozen=True)
class FewerSteps:
    """What came out."""

    settings: Settings
    runs: list[Run]

    def points(self, task: str, option: str, metric: str) -> list[Point]:
        """By size."""
        found = []
        for rollouts in self.settings.rollouts:
            runs = [
                run
                for run in self.runs
                if (run.job.task, run.job.option, run.job.rollouts) == (task, option, rollouts)
            ]
            cells = [cell for run in runs if (cell := run.cells.get(metric)) is not None]
            if cells:
                found.append(
                    Point(
                        *(task, option, metric, rollouts),
                        seconds=float(np.mean([run.seconds for run in runs])),
                        steps=float(np.mean([run.steps for run in runs])),
                        auc=np.array([cell.auc for cell in cells]),
                        ap=np.array([cell.ap for cell in cells]),
                    )
                )
        return found

    def all_points(self) -> Iterator[Point]:
        """In the order of the tables."""
        for task, metric, option in product(self.settings.tasks, METRICS, self.settings.options):
            yield from self.points(task, option, metric)

    def gain(self, point: Point, value: str) -> float:
        """How far a point's AUC or AP lies above the plain curve at as many simulation steps.

        The curve is drawn straight over the logarithm of the steps. NaN without a plain curve, or
        outside of it.
        """
        plain = self.points(point.task, PLAIN[point.metric], point.metric)
        if len(plain) < 2:
            return float("nan")
        curve = [float(getattr(other, value).mean()) for other in plain]
        steps = np.log([other.steps for other in plain])
        there = np.interp(np.log(point.steps), steps, curve, left=np.nan, right=np.nan)
        return float(getattr(point, value).mean() - there)

    def to_csv(self) -> str:
        """One line a point."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        values = ("auc", "auc_spread", "auc_gain", "ap", "ap_spread", "ap_gain")
        columns = ("task", "metric", "option", "rollouts", "seconds", "steps")
        writer.writerow((*columns, *values))
        for p in self.all_points():
            numbers = [
                number
                for value in ("auc", "ap")
                for own in [getattr(p, value)]
                for number in (own.mean(), _spread(own), self.gain(p, value))
            ]
            writer.writerow((p.task, p.metric, p.option, p.rollouts, p.seconds, p.steps, *numbers))
        return text.getvalue()

    def to_markdown(self) -> str:
        """One table a task."""
        s = self.settings
        lines = [
            f"AUC and AP (mean ± standard deviation of {s.seeds} seeds) of {s.trajectories} "
            f"trajectories of {FRAMES} states; captured over the next {HORIZON} frames. In "
            "brackets, how far above the plain curve at as many simulation steps.",
        ]
        for task in s.tasks:
            lines += [
                "",
                f"**{task}**",
                "",
                "| score | option | rollouts | ms a state | steps a state | AUC | AP |",
                "| --- | --- | --- | --- | --- | --- | --- |",
            ]
            lines += [self._line(point) for point in self.all_points() if point.task == task]
        return "\n".join(lines) + "\n"

    def _line(self, p: Point) -> str:
        cells = [
            f"{own.mean():.3f} ± {_spread(own):.3f} ({self.gain(p, value):+.3f})".replace(
                " (+nan)", ""
            )
            for value in ("auc", "ap")
            for own in [getattr(p, value)]
        ]
        numbers = f"{p.rollouts} | {1e3 * p.seconds:.2f} | {p.steps:.0f}"
        return f"| {p.metric} | {p.option} | {numbers} | {' | '.join(cells)} |"


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FewerSteps:
    """Makes every run that is not in the folder yet, each on one thread of a process of its own.

    `progress(done, total)` counts them. Raises ValueError on settings that cannot be, or a folder
    of other ones.
    """
    settings = settings.checked()
    advance = progress or (lambda _done, _total: None)
    (folder / "scores").mkdir(exist_ok=True)
    for task in settings.tasks:
        _dataset(folder, task, settings.trajectories)
    wanted = list(_jobs(settings))
    runs = {job: run for job in wanted if (run := _kept(job, folder)) is not None}
    missing = [job for job in wanted if job not in runs]
    advance(len(runs), len(wanted))
    for run in _made(missing, folder, thread_count(threads)):
        runs[run.job] = run
        advance(len(runs), len(wanted))
    return FewerSteps(settings, [runs[job] for job in wanted])


def _jobs(settings: Settings) -> Iterator[Job]:
    own = version("energymargin")
    for seed, task, rollouts, option in product(
        range(settings.seeds), settings.tasks, settings.rollouts, settings.options
    ):
        yield Job(own, task, settings.trajectories, option, rollouts, seed)


def _dataset(folder: Path, task: str, trajectories: int) -> Dataset:
    path = folder / f"{task}.h5"
    return datasets.load_or_generate(path, tasks.make(task), trajectories, FRAMES, seed=0)


def _kept(job: Job, folder: Path) -> Run | None:
    path = job.path(folder)
    if not path.exists():
        return None
    kept = json.loads(path.read_text())
    if kept.pop("job") != asdict(job):
        raise ValueError(f"{path} holds other scores: remove it, or choose another folder")
    cells = {metric: cell and Cell(**cell) for metric, cell in kept.pop("cells").items()}
    return Run(job, cells=cells, **kept)


def _made(jobs: Sequence[Job], folder: Path, threads: int) -> Iterator[Run]:
    """Runs as they are finished."""
    if not jobs:
        return
    context = multiprocessing.get_context("spawn")
    with (
        held_interrupts() as interrupted,
        ProcessPoolExecutor(min(threads, len(jobs)), mp_context=context) as pool,
    ):
        running: set[Future[Run]] = {pool.submit(_run, job, folder) for job in jobs}
        while running and not interrupted.is_set():
            done, running = wait(running, timeout=0.05, return_when=FIRST_COMPLETED)
            for future in done:
                if not interrupted.is_set():
                    yield future.result()
        pool.shutdown(cancel_futures=True)
    if interrupted.is_set():
        raise KeyboardInterrupt


def _run(job: Job, folder: Path) -> Run:
    """Scores all states, and keeps the file."""
    dataset = _dataset(folder, job.task, job.trajectories)
    problems, frames = dataset.problems(), dataset.frames()
    score = OPTIONS[job.option]
    scores: dict[str, list[float]] = {}
    steps, seconds = 0, 0.0
    for first in range(0, len(frames), FRAMES):
        own = range(first, first + FRAMES)
        start = time.process_time()
        found = score(
            [problems[i] for i in own], job.rollouts, [stream(job.seed, i) for i in own]
        )
        seconds += time.process_time() - start
        for state in found:
            steps += state.steps
            for metric, value in state.scores.items():
                scores.setdefault(metric, []).append(value)
    count = len(frames)
    cells = _cells(dataset, scores)
    run = Run(job, seconds / count, steps / count, scores, cells)
    path = job.path(folder)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(json.dumps(asdict(run)))
    os.replace(temporary, path)
    return run


def _cells(dataset: Dataset, scores: dict[str, list[float]]) -> dict[str, Cell | None]:
    """Each score against its label: captured over the horizon, or the trajectory's success."""
    trajectories = dataset.trajectories
    labelled = LabelledScores(
        task=dataset.task,
        trajectory=np.repeat(np.arange(len(trajectories)), [len(t) for t in trajectories]),
        captured=np.concatenate([t.captured for t in trajectories]),
        success=np.repeat([t.success for t in trajectories], [len(t) for t in trajectories]),
        scores={metric: np.array(values) for metric, values in scores.items()},
    )
    result = evaluate(labelled, horizons=(HORIZON,))
    cells = {metric: own[HORIZON] for metric, own in result.states.items()}
    if "success" in scores:
        cells["success"] = result.success
    return cells


def _spread(values: NDArray[np.float64]) -> float:
    """Standard deviation; 0 of a single value."""
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


def as_json(value: Any) -> str:
    """One line."""
    return json.dumps(value)
