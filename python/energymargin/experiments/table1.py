"""The paper's Table I: how well each score predicts robustness and success, on every task.

Each task's states are scored in both readings of the effector, "coast" and "drive"; the
trajectories, and so the labels, the force score and the ceiling, are the same in both.
"""

from __future__ import annotations

import csv
import io
import platform
import shlex
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from energymargin import datasets, tasks
from energymargin._core import Problem
from energymargin.datasets import Dataset
from energymargin.evaluation import (
    CSV_COLUMNS,
    DASH,
    HORIZON,
    HORIZONS,
    PAPER,
    SUCCESS,
    Cell,
    Evaluation,
    LabelledScores,
    captured_labels,
    csv_fields,
    evaluate,
    paper_value,
)
from energymargin.experiments.ceiling import (
    CEILING,
    CONTINUATIONS,
    ceiling_dataset,
    ceiling_store,
    evaluate_ceiling,
    scripted,
)
from energymargin.experiments.sheet import Sheet
from energymargin.scoring import METRICS, check_settings, thread_count
from energymargin.store import ScoreStore, score_dataset
from energymargin.tasks.base import EFFECTORS, whole_number

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = [
    "FULL",
    "QUICK",
    "Settings",
    "Table1",
    "TaskResult",
    "check_tasks",
    "paper_tasks",
    "reproduce",
]

FRAMES = 10  # K of Section VI-D
WEIGHTS = ("engage", "stick", "distance", "ground_engage", "ground_stick")  # of the force score
NAMES = {
    "capture": "capture",
    "effort/est": "effort EST",
    "effort/rrt": "effort RRT",
    "force": "force",
    SUCCESS: "success",
}
TREES = 3  # a state's: one for capture and success, one for each planner of the effort


@dataclass(frozen=True)
class Settings:
    """What the table is made of; raises ValueError on numbers out of range."""

    tasks: Sequence[str]
    trajectories: int = 50
    nodes: int = 1000
    continuations: int = CONTINUATIONS
    """Of each state, for the ceiling."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks the numbers: a mistake is said before anything is computed, or written."""
        check_settings(METRICS, self.nodes, self.seed)
        whole_number("trajectories", self.trajectories, 1)
        whole_number("continuations", self.continuations, 1)

    def command(self, folder: Path) -> str:
        """What to type to make the table again."""
        options = {
            "nodes": self.nodes,
            "trajectories": self.trajectories,
            "continuations": self.continuations,
            "seed": self.seed,
            "tasks": ",".join(self.tasks),
            "out": folder,
        }
        words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
        return shlex.join(["energymargin", "reproduce", "table1", *words])


FULL = Settings(tasks=())
QUICK = Settings(tasks=(), trajectories=20, nodes=50, continuations=20)
"""For a first picture in a few minutes."""


@dataclass(frozen=True)
class TaskResult:
    """One task's part of the table."""

    task: str
    readings: dict[str, Evaluation]
    """By effector, the task's own reading first."""
    ceiling: Evaluation
    captured: list[float]
    """Share of the states with the label 1, by horizon."""
    succeeded: float
    """Share of the trajectories that are successful."""
    weights: dict[str, float]
    """Of the force score, by name."""


@dataclass(frozen=True)
class Table1:
    """The table, and all that stands behind it."""

    settings: Settings
    folder: Path
    results: list[TaskResult]

    def render(self) -> RenderableType:
        """For the terminal, 80 columns wide."""
        from rich.console import Group
        from rich.text import Text

        caption = [Text(line, "dim") for line in self._caption()]
        return Group(*caption, Text(), *(sheet.render() for sheet in self._sheets()))

    def to_markdown(self) -> str:
        """The same as a Markdown file."""
        caption = "\n\n".join(self._caption())
        sheets = "\n".join(sheet.to_markdown() for sheet in self._sheets())
        return f"# Table I\n\n{caption}\n\n{sheets}"

    def to_csv(self) -> str:
        """One line a cell, in full precision; the ceiling has no reading of the effector."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["task", "effector", *CSV_COLUMNS])
        for result in self.results:
            for effector, evaluation in result.readings.items():
                writer.writerows([result.task, effector, *row] for row in evaluation.csv_rows())
            cells = [(CEILING, h, cell) for h, cell in result.ceiling.states[CEILING].items()]
            for name, horizon, cell in [
                *cells,
                (f"{CEILING}/{SUCCESS}", "", result.ceiling.success),
            ]:
                writer.writerow([result.task, "", name, horizon, *csv_fields(cell), "", ""])
        return text.getvalue()

    def _caption(self) -> list[str]:
        settings = self.settings
        weights = "; ".join(f"{result.task} {_words(result.weights)}" for result in self.results)
        packages = ", ".join(f"{p} {version(p)}" for p in ("energymargin", "numpy", "scikit-learn"))
        return [
            f"AUC/AP of each score, with their 95 % intervals below (trajectories are drawn), and "
            f"the paper's values. {settings.trajectories} trajectories of {FRAMES} frames a task, "
            f"seed {settings.seed}, {settings.nodes} nodes a tree. "
            f"Under a task's name: the reading of its effector; its default comes first. "
            f"Positives: the share of the states, or trajectories, with the label 1. "
            f"Weights of the force score: {weights}.",
            f"Ceiling: the most that any score of the state can reach on these data, but for "
            f"chance. It knows the robot's script: the share of {settings.continuations} "
            f"continuations of each state, with fresh noise, that stay captured or succeed.",
            f"Made by `{settings.command(self.folder)}` with {packages}, "
            f"Python {platform.python_version()} on {platform.system()} {platform.machine()}.",
        ]

    def _sheets(self) -> list[Sheet]:
        own, other = ({r.task: list(r.readings)[i] for r in self.results} for i in (0, 1))
        return [
            self._summary("Table I", own),
            *(_horizons(result, own[result.task]) for result in self.results),
            self._summary("Table I in the other reading of the effector", other),
            *(_horizons(result, other[result.task]) for result in self.results),
        ]

    def _summary(self, title: str, effectors: dict[str, str]) -> Sheet:
        """One row a task."""
        return Sheet(
            title=f"{title}: captured over the next {HORIZON} frames, and success",
            header=list(NAMES.values()),
            rows=[
                [
                    f"{result.task}\n{effectors[result.task]}",
                    *(
                        _lines(
                            _cell(result.readings[effectors[result.task]], score),
                            f"paper {paper_value(result.task, score)}",
                        )
                        for score in NAMES
                    ),
                ]
                for result in self.results
            ],
            notes=[note for r in self.results for note in _below(r, effectors[r.task])]
            or [
                "No cell is below the paper's, and every score of ours is ahead of the force score."
            ],
        )


def paper_tasks() -> list[str]:
    """The tasks of the paper's Table I that there are, in its order."""
    return [name for name in PAPER if name in tasks.names()]


def check_tasks(names: Sequence[str]) -> None:
    """Raises ValueError unless these are tasks of the paper's table, each once."""
    wrong = [name for name in names if name not in paper_tasks() or list(names).count(name) > 1]
    if wrong or not names:
        what = repr(wrong[0]) if wrong else "empty"
        raise ValueError(
            f"tasks has {what}, expected some of {', '.join(paper_tasks())}, each once"
        )


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Table1:
    """Makes the table; trajectories, scores and shares are kept in the folder as soon as they are
    there, and the same call goes on from them.

    `progress(what, share)` is called with what is being done, and the share that is done of all.
    Raises ValueError on a task that is not in the paper's table, or a folder that holds a table of
    other settings, before anything long is computed.
    """
    check_tasks(settings.tasks)
    threads = thread_count(threads)
    advance = progress or (lambda _what, _share: None)
    parts = []
    for name in settings.tasks:
        advance(f"{name}: trajectories", 0.0)
        parts.append(_Part.prepare(name, settings, folder))
    stages = [stage for part in parts for stage in part.stages(threads)]
    total, before = sum(stage.work for stage in stages), 0.0
    for stage in stages:

        def count(done: int, of: int, stage: _Stage = stage, before: float = before) -> None:
            what = f"{stage.what}, {done} of {of} states"
            advance(what, (before + stage.work * done / of) / total)

        stage.run(count)
        before += stage.work
    results = []
    for part in parts:
        advance(f"{part.dataset.task}: comparing with the labels", 1.0)
        results.append(part.result())
    return Table1(settings, folder, results)


@dataclass(frozen=True)
class _Stage:
    """One long computation, over the states of one dataset."""

    what: str
    work: float
    """How long it may take [s]; what counts is its ratio to the others'."""
    run: Callable[[Callable[[int, int], None]], None]
    """Takes a `progress(done, total)`."""


@dataclass(frozen=True)
class _Part:
    """One task: its files, and what is to be computed."""

    dataset: Dataset
    """In the task's own reading of the effector."""
    settings: Settings
    folder: Path

    @classmethod
    def prepare(cls, name: str, settings: Settings, folder: Path) -> _Part:
        """Generates the trajectories if they are not there, and opens every file once."""
        path, task = folder / f"{name}.h5", tasks.make(name)
        dataset = datasets.load_or_generate(
            path, task, settings.trajectories, FRAMES, settings.seed
        )
        part = cls(dataset, settings, folder)
        for effector in part.effectors():
            part.scores(effector).close()
        part.shares().close()
        return part

    def effectors(self) -> list[str]:
        """Both readings, the task's own first."""
        own = self.dataset.parameters["effector"]
        return sorted(EFFECTORS, key=lambda effector: effector != own)

    def reading(self, effector: str) -> Dataset:
        """The same trajectories, of a task with this effector."""
        return replace(self.dataset, parameters={**self.dataset.parameters, "effector": effector})

    def scores(self, effector: str) -> ScoreStore:
        """The file of the scores in one reading."""
        return ScoreStore.for_dataset(
            self._path(f"{effector}-scores"),
            self.reading(effector),
            METRICS,
            self.settings.nodes,
            self.settings.seed,
        )

    def shares(self) -> ScoreStore:
        """The file of the ceiling."""
        return ceiling_store(
            self._path(CEILING), self.dataset, self.settings.continuations, self.settings.seed
        )

    def problem(self) -> Problem:
        """That of the first state."""
        first = self.dataset.trajectories[0]
        return tasks.make(self.dataset.task, **self.dataset.parameters).problem(
            first.states[0], first.params, first.contacts[0]
        )

    def stages(self, threads: int) -> list[_Stage]:
        """What takes long: the scores in the task's own reading, the ceiling, the other reading."""
        task, settings = scripted(self.dataset), self.settings
        start = time.perf_counter()
        task.rollout(settings.seed, frames=2)
        step = (time.perf_counter() - start) / task.steps
        states = len(self.dataset.frames())
        edge = self.problem().duration / task.step

        def score(effector: str) -> _Stage:
            return _Stage(
                f"{task.name}: scores, {effector}",
                states * TREES * settings.nodes * edge * step,
                lambda progress: score_dataset(
                    self.reading(effector),
                    self._path(f"{effector}-scores"),
                    METRICS,
                    settings.nodes,
                    settings.seed,
                    threads=threads,
                    progress=progress,
                ),
            )

        ceiling = _Stage(
            f"{task.name}: ceiling",
            states * settings.continuations * task.steps / 2 * step,
            lambda progress: ceiling_dataset(
                self.dataset,
                self._path(CEILING),
                settings.continuations,
                settings.seed,
                threads=threads,
                progress=progress,
            ),
        )
        own, other = self.effectors()
        return [score(own), ceiling, score(other)]

    def result(self) -> TaskResult:
        """The evaluation of all files, once they are whole."""
        seed, weights = self.settings.seed, self.problem().force_weights
        readings = {}
        for effector in self.effectors():
            with self.scores(effector) as store:
                readings[effector] = evaluate(store.labelled_scores(), seed=seed)
        with self.shares() as store:
            labelled = store.labelled_scores()
        return TaskResult(
            task=self.dataset.task,
            readings=readings,
            ceiling=evaluate_ceiling(labelled, seed),
            captured=[_share_captured(labelled, horizon) for horizon in HORIZONS],
            succeeded=float(np.mean([t.success for t in self.dataset.trajectories])),
            weights={name: getattr(weights, name) for name in WEIGHTS},
        )

    def _path(self, what: str) -> Path:
        return self.folder / f"{self.dataset.task}-{what}.db"


def _horizons(result: TaskResult, effector: str) -> Sheet:
    """All horizons of one task in one reading. A column is a label, a row is a score."""
    evaluation, ceiling = result.readings[effector], result.ceiling
    columns = len(HORIZONS)
    scores = [[name, *map(_lines, cells.values()), ""] for name, cells in evaluation.states.items()]
    most = [*ceiling.states[CEILING].values(), ceiling.success]
    shares = [*result.captured, result.succeeded]
    return Sheet(
        title=f"{result.task}, effector {effector}: captured over the next h frames, and success",
        header=[*(f"h = {horizon}" for horizon in HORIZONS), "success"],
        rows=[
            *scores,
            [SUCCESS, *[""] * columns, _lines(evaluation.success)],
            [CEILING, *map(_lines, most)],
            ["positives", *(f"{100 * share:.0f} %" for share in shares)],
        ],
        notes=[],
    )


def _below(result: TaskResult, effector: str) -> list[str]:
    """The cells of the summary that are below the paper's, in the two digits that it gives, that
    are not ahead of the force score, or that could not be computed.
    """
    notes = []
    force = _cell(result.readings[effector], "force")
    for score, name in NAMES.items():
        cell = _cell(result.readings[effector], score)
        if cell is None:
            notes.append(f"{result.task}, {name}: all its labels are the same.")
            continue
        behind = force is not None and (cell.auc <= force.auc or cell.ap <= force.ap)
        if behind and score not in ("force", SUCCESS):
            notes.append(f"{result.task}, {name}: not ahead of the force score.")
        pairs = zip(("AUC", "AP"), (cell.auc, cell.ap), PAPER[result.task][score], strict=True)
        below = [measure for measure, ours, theirs in pairs if round(ours, 2) < theirs]
        if below:
            ceiling = result.ceiling
            most = ceiling.success if score == SUCCESS else ceiling.states[CEILING][HORIZON]
            notes.append(
                f"{result.task}, {name}: {' and '.join(below)} below the paper's; "
                f"{cell.value()} ({', '.join(cell.intervals())}), "
                f"the paper {paper_value(result.task, score)}, "
                f"ceiling {DASH if most is None else most.value()}."
            )
    return notes


def _cell(evaluation: Evaluation, score: str) -> Cell | None:
    return evaluation.success if score == SUCCESS else evaluation.states[score][HORIZON]


def _lines(cell: Cell | None, *more: str) -> str:
    return "\n".join((DASH, *more) if cell is None else (cell.value(), *cell.intervals(), *more))


def _words(weights: dict[str, float]) -> str:
    return ", ".join(f"{n.replace('_', ' ')} {weight:g}" for n, weight in weights.items() if weight)


def _share_captured(labelled: LabelledScores, horizon: int) -> float:
    labels = [captured_labels(labelled.captured[own], horizon) for own in labelled.by_trajectory()]
    return float(np.concatenate(labels).mean())
