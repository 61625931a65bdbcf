"""Will it hold for the next frames? What each score of a state foresees, on every task.

The scores of the paper, the probability of `capture_probability` with and without the robot's plan,
the plan alone, a learned classifier, and the ceiling, all compared with "it stays captured for the
next h frames". Only states that are captured now count, with h frames left in their trajectory:
that others are lost needs no foresight.

Every probability is one line of runs.jsonl in the folder, written as soon as it is there, and the
other scores are in stores: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import capture_score, escape_effort
from energymargin.base.checks import positive_number, whole_number
from energymargin.base.table_text import DASH, csv_text, markdown_table, short
from energymargin.datasets import Dataset
from energymargin.evaluate.executors.choice import Threads
from energymargin.evaluate.searches import SearchSettings
from energymargin.records.evaluation.table import csv_fields
from energymargin.store import ScoreStore, add_scores, score_dataset
from energymargin_paper import probabilities
from energymargin_paper.evidence.calibration import BINS
from energymargin_paper.evidence.ceiling import CAPTURED, CEILING, ceiling_dataset, scripted
from energymargin_paper.evidence.foresight_figure import figure_foresight
from energymargin_paper.evidence.foresight_task import NAMES, UNSURE, TaskForesight
from energymargin_paper.jobs import load_or_generate, pairs, resumed
from energymargin_paper.probabilities import (
    FRESH,
    HORIZONS,
    LEARNED,
    NOMINAL,
    SCRIPT,
    Job,
    Method,
    Shares,
    learned,
)
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["STUDY", "Foresight", "Settings"]

FRAMES = 10  # of a trajectory
SAMPLED = 10  # states whose trees say how many steps a tree takes
RUNS_FILE = "runs.jsonl"
TASKS = ("push", "balance", "topple", "grasp", "scoop", "push-multi")
PUBLISHED = ("capture", "effort/est")

# One rule for all tasks: how strong the disturbance is, as a share of the problem's bounds, and how
# many objects each of its pieces meets. Fixed on trajectories of another seed, as
# docs/results/foresight.md says.
STRENGTH = 0.6
OBJECTS = 2  # or as many as a task has


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(TASKS, "Tasks, separated by commas.")
    trajectories: int = setting(50, "Trajectories of each task, of ten frames.")
    nodes: int = setting(100, "Nodes of the published scores' trees.")
    rollouts: int = setting(30, "Rollouts of each probability.")
    fresh: int = setting(
        100, "Rollouts of another seed that the probabilities are compared with; 0: none."
    )
    continuations: int = setting(100, "Continuations of each state, for the ceiling.")
    strength: float = setting(STRENGTH, "Strength of the disturbance, as a share of the bounds.")
    objects: int = setting(OBJECTS, "Objects disturbed at a time, at most all of the task.")
    seed: int = setting(0, "Seed of every random draw.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        wrong = [name for name in self.tasks if name not in TASKS]
        if wrong or not self.tasks or len(set(self.tasks)) < len(self.tasks):
            what = repr(wrong[0]) if wrong else ", ".join(self.tasks) or "empty"
            raise ValueError(f"tasks is {what}, expected some of {', '.join(TASKS)}, each once")
        for name in ("trajectories", "nodes", "rollouts", "continuations", "objects"):
            whole_number(name, getattr(self, name), 1)
        whole_number("fresh", self.fresh, 0)
        whole_number("seed", self.seed, 0, 2**63 - 1)
        positive_number("strength", self.strength)

    def methods(self) -> dict[str, Method]:
        """Methods of the probabilities, by name."""
        stated = Method(self.rollouts, self.strength, self.objects, self.seed)
        found = dict.fromkeys(("coast", "hold", SCRIPT), stated)
        found["default"] = Method(self.rollouts, 1.0, None, self.seed)
        found[NOMINAL] = Method(0, 0.0, None, 0)
        if self.fresh:
            found[FRESH] = Method(self.fresh, self.strength, self.objects, self.seed + 1)
        return found


@dataclass(frozen=True, eq=False)
class Foresight:
    """The result."""

    settings: Settings
    tasks: list[TaskForesight]

    def to_markdown(self) -> str:
        """A table for each task, and one of the calibration."""
        own = self.settings
        many = f"{own.objects} object{'s' * (own.objects != 1)}"
        lines = [
            "# Foresight",
            "",
            "Will it stay captured for the next h frames? AUC/AP, on states that are captured now "
            f"and have h frames left. {own.trajectories} "
            f"trajectories of ten frames a task, seed {own.seed}; trees of {own.nodes} nodes, "
            f"{own.rollouts} rollouts. The disturbance of a probability is "
            f"Uniform(strength={own.strength:g}, objects={own.objects}): each piece meets {many}, "
            "where there are so many. "
            "Beside it stands the default, Uniform(). The intervals, 95 % by trajectory, the Brier "
            f"score and the expected calibration error (ECE, {BINS} bins of equal mass) are of the "
            "horizon in the head of their column. The ceiling is the share of "
            f"{own.continuations} continuations.",
            "",
            "## In short",
            "",
            "AUC/AP over the longest horizon of each task.",
            "",
            _summary(self.tasks),
        ]
        for task in self.tasks:
            lines += ["", f"## {task.task}", "", _table(task)]
        if own.fresh:
            lines += ["", "## Against fresh rollouts", "", self._fresh()]
        return "\n".join(lines) + "\n"

    def _fresh(self) -> str:
        own = self.settings
        text = (
            f"How far the probability of {own.rollouts} rollouts is from the share of {own.fresh} "
            f"others under the same disturbance: the expected error over {BINS} bins."
        )
        rows = []
        for task in self.tasks:
            both = [task.against_fresh(task.last, unsure=unsure) for unsure in (False, True)]
            cells = [f"{pair[0]:.3f} of {pair[1]}" if pair else DASH for pair in both]
            rows.append([task.task, str(task.last), *cells])
        header = ("", "horizon", "all states", f"from {UNSURE[0]:g} to {UNSURE[1]:g}")
        table = markdown_table(header, rows, ("left", "right", "right", "right"))
        return f"{text}\n\n{table}"

    def to_csv(self) -> str:
        """One line for each task, score and horizon."""
        rows = []
        for task in self.tasks:
            for name, cells in task.cells.items():
                for h, cell in cells.items():
                    calibration = task.calibration(name, h) or ("", "")
                    steps = round(task.steps[name])
                    rows.append((task.task, name, h, *csv_fields(cell), *calibration, steps))
        measures = ("auc", "auc_low", "auc_high", "ap", "ap_low", "ap_high", "brier", "ece")
        header = ("task", "score", "horizon", "count", "positives", *measures, "steps")
        return csv_text(header, rows)

    def reliability_csv(self) -> str:
        """One line for each bin of the reliability plot."""
        rows = [
            (task.task, name, task.last, *row)
            for task in self.tasks
            for name in task.cells
            if (bins := task.reliability(name, task.last)) is not None
            for row in zip(*bins, strict=True)
        ]
        header = ("task", "score", "horizon", "predicted", "happened", "states")
        return csv_text(header, rows)


def _summary(tasks: Sequence[TaskForesight]) -> str:
    """A row for each task, a column for each score."""
    names = [name for name in NAMES if any(name in task.cells for task in tasks)]
    rows = []
    for task in tasks:
        cells = [task.cells[name][task.last] if name in task.cells else None for name in names]
        values = [cell.value() if cell else DASH for cell in cells]
        rows.append([task.task, f"{task.last}", *values])
    header = ["", "frames", *(NAMES[name] for name in names)]
    return markdown_table(header, rows, ["left", *["right"] * (len(header) - 1)])


def _table(task: TaskForesight) -> str:
    """A row for each score."""
    last = task.last
    own = [task.counts[h] for h in HORIZONS]
    stay = [int(task.labels[h][task.counts[h]].sum()) for h in HORIZONS]
    shares = ", ".join(f"{n} of {int(of.sum())}" for n, of in zip(stay, own, strict=True))
    text = f"Stay captured, by horizon: {shares}. Failed: {task.missing}."
    measured = (f"{measure}, {last}" for measure in ("AUC", "AP", "Brier", "ECE"))
    header = ["", *map(str, HORIZONS), *measured, "steps a state"]
    rows = []
    for name, cells in task.cells.items():
        values = [cell.value() if cell else DASH for cell in cells.values()]
        cell, calibration = cells[last], task.calibration(name, last)
        intervals = cell.intervals() if cell else (DASH, DASH)
        measures = [short(value) for value in calibration] if calibration else [DASH, DASH]
        steps = f"{task.steps[name]:.0f}"
        rows.append([NAMES[name], *values, *intervals, *measures, steps])
    align = ["left", *["right"] * (len(header) - 1)]
    return f"{text}\n\n{markdown_table(header, rows, align)}"


class ForesightStudy(Study[Settings, Foresight]):
    """Will it hold for the next frames? What each score of a state foresees, on every task.

    The scores of the paper, the probability to stay captured with and without the robot's plan, the
    plan alone, a learned classifier and the ceiling, on states that are captured now; and whether
    the probabilities mean what they say.

    The folder gets foresight.md, foresight.csv, reliability.csv, foresight.png, runs.jsonl, the
    trajectories and the stores of scores.

    Example: `energymargin reproduce foresight --tasks push,balance`
    """

    name = "foresight"
    title, unit = "Foreseeing", "states"
    settings = Settings()
    quick = Settings(trajectories=8, nodes=20, rollouts=8, fresh=16, continuations=8)
    packages = ("scikit-learn",)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Foresight:
        """Makes what is not in the folder yet; `progress` counts states, once for each score."""
        parts = {
            name: load_or_generate(
                *(folder / f"{name}.h5", tasks.make(name), settings.trajectories),
                *(FRAMES, settings.seed),
            )
            for name in settings.tasks
        }
        methods = settings.methods()
        jobs = [
            job
            for dataset in parts.values()
            for job in probabilities.jobs(dataset, settings.trajectories, methods)
        ]
        states = 2 * sum(dataset.size for dataset in parts.values())  # scores, and ceiling
        total = states + len(jobs)
        done = 0
        for dataset in parts.values():
            for stage in (_score, _continue):

                def count(states_done: int, _of: int, before: int = done) -> None:
                    progress(before + states_done, total)

                stage(dataset, settings, folder, threads, count)
                done += dataset.size
        robots = {name: scripted(dataset) for name, dataset in parts.items()}
        rows = resumed(
            folder / RUNS_FILE,
            jobs,
            partial(probabilities.run, parts, robots),
            threads,
            lines=pairs(Job, Shares),
            progress=lambda n, _of: progress(states + n, total),
        )
        results = [_result(dataset, settings, folder, rows) for dataset in parts.values()]
        return Foresight(settings, results)

    def write(self, result: Foresight, folder: Path) -> None:
        """The reliability too."""
        super().write(result, folder)
        (folder / "reliability.csv").write_text(result.reliability_csv())

    def figures(self, result: Foresight) -> Iterator[tuple[str, Figure]]:
        """AUC by horizon, and reliability, a column a task."""
        yield "foresight.png", figure_foresight(result.tasks)


STUDY = ForesightStudy()


def _score(
    dataset: Dataset,
    settings: Settings,
    folder: Path,
    threads: int,
    progress: Callable[[int, int], None],
) -> None:
    """The paper's scores, as published."""
    search = SearchSettings(settings.nodes, settings.seed)
    path = folder / f"{dataset.task}-scores.db"
    score_dataset(
        dataset, path, PUBLISHED, settings=search, executor=Threads(threads), progress=progress
    )


def _continue(
    dataset: Dataset,
    settings: Settings,
    folder: Path,
    threads: int,
    progress: Callable[[int, int], None],
) -> None:
    """The shares of the ceiling."""
    path = folder / f"{dataset.task}-{CEILING}.db"
    count, seed = settings.continuations, settings.seed
    ceiling_dataset(dataset, path, count, seed, threads=threads, progress=progress)


def _result(
    dataset: Dataset, settings: Settings, folder: Path, rows: Mapping[Job, Shares]
) -> TaskForesight:
    """All scores of a task's states, by horizon, and what happened."""
    places = np.array(dataset.frames())
    captured = np.array([trajectory.captured for trajectory in dataset.trajectories])
    labels, counts = _labels(captured, places)
    scores = _stored(dataset, settings, folder)
    steps = {name: _tree_steps(dataset, settings, name) for name in PUBLISHED}
    left = (FRAMES - 1 - places[:, 1]) * scripted(dataset).steps / (FRAMES - 1)
    steps[CEILING] = float(settings.continuations * left[counts[1]].mean())
    for name in settings.methods():
        of_method = [(job, row) for job, row in rows.items() if _is(job, dataset.task, name)]
        scores[name] = {h: np.full(dataset.size, np.nan) for h in HORIZONS}
        for job, row in of_method:
            for h, share in enumerate(row.shares, 1):
                scores[name][h][job.index] = share
        steps[name] = float(np.mean([row.steps for _, row in of_method])) if of_method else 0.0
    scores[LEARNED] = {
        h: learned(_states(dataset), labels[h], places[:, 0], counts[h], settings.seed)
        for h in HORIZONS
    }
    _keep_learned(dataset, settings, folder, scores[LEARNED])
    steps[LEARNED] = 0.0
    failed = sum(row.error is not None for job, row in rows.items() if job.task == dataset.task)
    return TaskForesight(
        *(dataset.task, places[:, 0], labels, counts, scores, steps, failed), seed=settings.seed
    )


def _keep_learned(
    dataset: Dataset, settings: Settings, folder: Path, scores: Mapping[int, NDArray[np.float64]]
) -> None:
    """Puts the classifier's probabilities beside the paper's scores, as a run of its own, which the
    report, the viewer and `evaluate` show as any other."""
    of_horizons = {CAPTURED[h]: values for h, values in scores.items()}
    source = {"source": LEARNED, "seed": settings.seed}
    add_scores(folder / f"{dataset.task}-scores.db", dataset, of_horizons, settings=source)


def _is(job: Job, task: str, method: str) -> bool:
    return job.task == task and job.method == method


def _states(dataset: Dataset) -> NDArray[np.float64]:
    return np.concatenate([trajectory.states for trajectory in dataset.trajectories])


def _labels(
    captured: NDArray[np.bool_], places: NDArray[np.int64]
) -> tuple[dict[int, NDArray[np.bool_]], dict[int, NDArray[np.bool_]]]:
    """By horizon, shape (N,): whether a state stays captured, and whether it counts."""
    t, k = places.T
    stays = {0: captured[t, k]}
    for h in HORIZONS:
        stays[h] = stays[h - 1] & captured[t, np.minimum(k + h, FRAMES - 1)]
    counts = {h: stays[0] & (k + h < FRAMES) for h in HORIZONS}
    return {h: stays[h] for h in HORIZONS}, counts


def _stored(
    dataset: Dataset, settings: Settings, folder: Path
) -> dict[str, dict[int, NDArray[np.float64]]]:
    """The paper's scores, the same for each horizon, and the ceiling."""
    found: dict[str, dict[int, NDArray[np.float64]]] = {}
    with ScoreStore(folder / f"{dataset.task}-scores.db") as store:
        labelled = _run_of(store, nodes=settings.nodes).labelled_scores()
    for name in PUBLISHED:
        found[name] = dict.fromkeys(HORIZONS, labelled.scores[name])
    with ScoreStore(folder / f"{dataset.task}-{CEILING}.db") as store:
        run = _run_of(store, continuations=settings.continuations)
        shares = run.labelled_scores().scores
    found[CEILING] = {h: shares[CAPTURED[h]] for h in HORIZONS}
    return found


def _run_of(store: ScoreStore, **settings: int) -> Any:
    """The run of a store with these settings."""
    for run in store.runs():
        if all(run.settings.get(name) == value for name, value in settings.items()):
            return run
    raise ValueError(f"{store.path} has no run with {settings}; remove it, and start again")


def _tree_steps(dataset: Dataset, settings: Settings, metric: str) -> float:
    """Mean steps of a state's tree, of some states."""
    numbers = np.linspace(0, dataset.size - 1, min(SAMPLED, dataset.size)).astype(int)
    total = 0.0
    for problem in dataset.problems(np.unique(numbers).tolist()):
        if metric == "capture":
            tree = capture_score(problem, nodes=settings.nodes, seed=settings.seed, warn=False).tree
        else:
            search: dict[str, Any] = {
                "nodes": settings.nodes,
                "seed": settings.seed,
                "search": "published",
            }
            tree = escape_effort(problem, planner="est", **search).tree
        total += float(tree.durations.sum()) / problem.scene.step
    return total / len(np.unique(numbers))
