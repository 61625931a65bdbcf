"""The paper's Table I: how well each score predicts robustness and success, on every task.

Each task's states are scored in both readings of the effector, "coast" and "drive"; the
trajectories, and so the labels, the force score and the ceiling, are the same in both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin import datasets, tasks
from energymargin._core import Problem
from energymargin.base.checks import whole_number
from energymargin.base.table_text import DASH, csv_text, markdown_table, short
from energymargin.cli.options import PICTURE_NODES
from energymargin.cli.terminal import out, share_bar
from energymargin.datasets import Dataset
from energymargin.evaluate.executors.choice import Threads
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import Cell, Evaluation, LabelledScores, evaluate
from energymargin.records.evaluation.labelled import HORIZONS, SUCCESS, compared_states
from energymargin.records.evaluation.table import CSV_COLUMNS, csv_fields
from energymargin.records.store.scoring import begin_run
from energymargin.store import Run, ScoreStore, score_dataset
from energymargin.tasks.scripted import EFFECTORS
from energymargin_paper.evidence.ceiling import (
    CAPTURED,
    CEILING,
    CONTINUATIONS,
    ceiling_dataset,
    ceiling_run,
    evaluate_ceiling,
    scripted,
)
from energymargin_paper.jobs import load_or_generate
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import RenderableType

__all__ = ["STUDY", "Settings", "Sheet", "Table1", "TaskResult", "check_tasks"]

# AUC and AP of the paper's Table I.
_PAPER_SCORES = ("capture", "effort/est", "effort/rrt", "force", "success")
_PAPER_ROWS = {
    "push": ((0.97, 0.99), (0.92, 0.98), (0.92, 0.99), (0.86, 0.95), (0.98, 0.98)),
    "balance": ((0.98, 0.99), (0.93, 0.98), (0.94, 0.98), (0.94, 0.96), (0.93, 0.95)),
    "topple": ((0.94, 0.93), (0.93, 0.91), (0.93, 0.92), (0.77, 0.62), (0.89, 0.92)),
    "grasp": ((1.00, 1.00), (0.99, 0.99), (0.97, 0.99), (0.73, 0.88), (0.99, 0.99)),
}
PAPER = {task: dict(zip(_PAPER_SCORES, row, strict=True)) for task, row in _PAPER_ROWS.items()}
"""By task, then by score."""
PAPER_HORIZON = 0  # frames; Tables I and II of the paper come out of its authors' data so
PAPER_COLUMNS = ("paper_auc", "paper_ap")  # of a CSV file

FRAMES = 10  # K of Section VI-D
WEIGHTS = ("engage", "stick", "distance", "ground_engage", "ground_stick")  # of the force score
NAMES = {
    "capture": "capture",
    "effort/est": "effort EST",
    "effort/rrt": "effort RRT",
    "force": "force",
    SUCCESS: "success",
}
METRICS = tuple(NAMES)  # its tasks have one object
TREES = 3  # a state's: one for capture and success, one for each planner of the effort


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on tasks that Table I lacks, or bad numbers."""

    tasks: tuple[str, ...] = setting(
        tuple(PAPER), "Tasks of the paper's table, separated by commas."
    )
    trajectories: int = setting(50, "Trajectories of each task.")
    nodes: int = setting(1000, "Nodes of each search tree.")
    continuations: int = setting(CONTINUATIONS, "Continuations of each state, for the ceiling.")
    seed: int = setting(0, "Seed; the same gives the same numbers, to the last bit.")
    engine: str = setting("native", "What steps the simulation: native or bullet.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        check_tasks(self.tasks)
        _ = self.search
        whole_number("trajectories", self.trajectories, 1)
        whole_number("continuations", self.continuations, 1)

    @property
    def search(self) -> SearchSettings:
        """Those of the scores."""
        return SearchSettings(self.nodes, self.seed)


def check_tasks(names: Sequence[str]) -> None:
    """Raises ValueError unless these are tasks of the paper's table, each once."""
    wrong = [name for name in names if name not in PAPER or list(names).count(name) > 1]
    if wrong or not names:
        what = repr(wrong[0]) if wrong else "empty"
        raise ValueError(f"tasks has {what}, expected some of {', '.join(PAPER)}, each once")


@dataclass(frozen=True, eq=False)
class TaskResult:
    """One task's part of the table."""

    task: str
    readings: dict[str, Evaluation]
    """By effector, the task's own reading first."""
    ceiling: Evaluation
    captured: list[float]
    """Share of the states with the label 1, by horizon, of those with as many frames left."""
    succeeded: float
    """Share of the trajectories that are successful."""
    weights: dict[str, float]
    """Weights of the force score, by name."""


@dataclass(frozen=True, eq=False)
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
        """The result as a Markdown file."""
        caption = "\n\n".join(self._caption())
        sheets = "\n".join(sheet.to_markdown() for sheet in self._sheets())
        return f"# Table I\n\n{caption}\n\n{sheets}"

    def to_csv(self) -> str:
        """One line a cell, in full precision; the ceiling has no reading of the effector."""
        rows: list[list[Any]] = []
        for result in self.results:
            for effector, evaluation in result.readings.items():
                for row in evaluation.csv_rows():
                    score, _, horizon, *_ = row
                    theirs = (
                        PAPER[result.task].get(score) if horizon in (PAPER_HORIZON, "") else None
                    )
                    rows.append([result.task, effector, *row, *(theirs or ("", ""))])
            cells: list[tuple[str, int | str, Cell | None]]
            cells = [(CEILING, h, cell) for h, cell in result.ceiling.states[CEILING].items()]
            cells.append((f"{CEILING}/{SUCCESS}", "", result.ceiling.success))
            rows += ([result.task, "", n, "all", h, *csv_fields(c), "", ""] for n, h, c in cells)
        return csv_text(["task", "effector", *CSV_COLUMNS, *PAPER_COLUMNS], rows)

    def _caption(self) -> list[str]:
        settings = self.settings
        weights = "; ".join(f"{result.task} {_words(result.weights)}" for result in self.results)
        return [
            f"AUC/AP of each score, with their 95 % intervals below (trajectories are drawn), and "
            f"the paper's values. {settings.trajectories} trajectories of {FRAMES} frames a task, "
            f"seed {settings.seed}, {settings.nodes} nodes a tree. "
            f"Under a task's name: the reading of its effector; its default comes first. "
            f"States with fewer than h frames left are left out. "
            f"Positives: the share of the states, or trajectories, with the label 1. "
            f"Weights of the force score: {weights}.",
            f"Ceiling: the most that any score of the state can reach on these data, but for "
            f"chance. It knows the robot's script: the share of {settings.continuations} "
            f"continuations of each state, with fresh noise, that stay captured or succeed.",
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
            title=f"{title}: captured now (h = {PAPER_HORIZON}), and success",
            header=list(NAMES.values()),
            rows=[
                [
                    f"{result.task}\n{effectors[result.task]}",
                    *(
                        _lines(
                            _cell(result.readings[effectors[result.task]], score),
                            f"paper {_paper(result, score)}",
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


@dataclass(frozen=True, eq=False)
class Sheet:
    """A title, a table and what there is to say about it, for the terminal and for Markdown."""

    title: str
    header: list[str]
    """Heads of every column but the first, which names the rows."""
    rows: list[list[str]]
    """A cell has lines: the first is what counts, the others say more about it."""
    notes: list[str]

    def render(self) -> RenderableType:
        """For the terminal."""
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False)
        table.add_column("")
        for name in self.header:
            table.add_column(name, justify="center", no_wrap=True)
        for row in self.rows:
            lines = [cell.partition("\n") for cell in row]
            table.add_row(
                *(
                    Text.assemble((first, "bold"), (newline + more, "dim"))
                    for first, newline, more in lines
                )
            )
        notes = [Text(f"  {note}", "dim") for note in self.notes]
        return Group(Text(self.title, "bold cyan"), Text(), table, *notes, Text())

    def to_markdown(self) -> str:
        """A section of a Markdown file."""
        table = markdown_table(["", *self.header], self.rows)
        notes = [f"- {note}" for note in self.notes]
        return "\n".join([f"## {self.title}", "", table, "", *notes, *([""] if notes else [])])


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
            most = ceiling.success if score == SUCCESS else ceiling.states[CEILING][PAPER_HORIZON]
            notes.append(
                f"{result.task}, {name}: {' and '.join(below)} below the paper's; "
                f"{cell.value()} ({', '.join(cell.intervals())}), "
                f"the paper {_paper(result, score)}, "
                f"ceiling {DASH if most is None else most.value()}."
            )
    return notes


def _paper(result: TaskResult, score: str) -> str:
    value = PAPER[result.task].get(score)
    return DASH if value is None else "/".join(short(one, decimals=2) for one in value)


def _cell(evaluation: Evaluation, score: str) -> Cell | None:
    return evaluation.success if score == SUCCESS else evaluation.states[score][PAPER_HORIZON]


def _lines(cell: Cell | None, *more: str) -> str:
    return "\n".join((DASH, *more) if cell is None else (cell.value(), *cell.intervals(), *more))


def _words(weights: dict[str, float]) -> str:
    return ", ".join(f"{n.replace('_', ' ')} {weight:g}" for n, weight in weights.items() if weight)


class Table1Study(Study[Settings, Table1]):
    """How well each score predicts robustness and success, on every task, beside the paper's.

    AUC and AP of the scores of recorded states against what happened afterwards, in both readings
    of the effector. The *ceiling* is what a score could reach at most: it lets the robot's own
    script go on from each state, many times, with fresh noise.

    The folder gets table1.md and table1.csv, the trajectories (TASK.h5), every score (*.db) and a
    picture of each task (TASK.png).

    Example: `energymargin reproduce table1 --tasks push --nodes 100`
    """

    name = "table1"
    title, unit = "Scoring", "states"
    settings = Settings()
    quick = Settings(trajectories=20, nodes=50, continuations=20)

    def bar(self) -> AbstractContextManager[Progress]:
        """A bar of what is being done, and the share that is done of all."""
        return share_bar()

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Table1:
        """Computes what is not in the folder; `progress(what, share)`. Raises ValueError on a
        folder that holds a table of other settings, before anything long is computed."""
        parts = []
        for name in settings.tasks:
            progress(f"{name}: trajectories", 0.0)
            parts.append(_Part.prepare(name, settings, folder))
        stages = [stage for part in parts for stage in part.stages(threads)]
        total, before = sum(stage.work for stage in stages), 0.0
        for stage in stages:

            def count(done: int, of: int, stage: _Stage = stage, before: float = before) -> None:
                what = f"{stage.what}, {done} of {of} states"
                progress(what, (before + stage.work * (done / of)) / total)

            stage.run(count)
            before += stage.work
        results = []
        for part in parts:
            progress(f"{part.dataset.task}: comparing with the labels", 1.0)
            results.append(part.result())
        return Table1(settings, folder, results)

    def show(self, result: Table1) -> None:
        """In 80 columns."""
        out.print(result.render())

    def figures(self, result: Table1) -> Iterator[tuple[str, Figure]]:
        """Search trees of each task."""
        from energymargin.look.plots.trajectories import figure_trees

        for name in result.settings.tasks:
            dataset = datasets.load(result.folder / f"{name}.h5")
            yield f"{name}.png", figure_trees(dataset, PICTURE_NODES, result.settings.seed)


STUDY = Table1Study()


@dataclass(frozen=True)
class _Stage:
    """One long computation, over the states of one dataset."""

    what: str
    work: float
    """How long it may take [s]; what counts is its ratio to the others'."""
    run: Callable[[Callable[[int, int], None]], object]
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
        path, task = folder / f"{name}.h5", tasks.make(name, engine=settings.engine)
        dataset = load_or_generate(path, task, settings.trajectories, FRAMES, settings.seed)
        part = cls(dataset, settings, folder)
        for effector in part.effectors():
            with part.scores(effector):
                pass
        with part.shares():
            pass
        return part

    def effectors(self) -> list[str]:
        """Both readings, the task's own first."""
        own = self.dataset.parameters["effector"]
        return sorted(EFFECTORS, key=lambda effector: effector != own)

    def reading(self, effector: str) -> Dataset:
        """The trajectories as of a task with this effector."""
        return replace(self.dataset, parameters={**self.dataset.parameters, "effector": effector})

    @contextmanager
    def scores(self, effector: str) -> Iterator[Run]:
        """The scores in one reading."""
        with ScoreStore(self._path(f"{effector}-scores"), create=True) as store:
            yield begin_run(store, self.reading(effector), METRICS, self.settings.search)

    @contextmanager
    def shares(self) -> Iterator[Run]:
        """The shares of the ceiling."""
        settings = self.settings
        with ScoreStore(self._path(CEILING), create=True) as store:
            yield ceiling_run(store, self.dataset, settings.continuations, settings.seed)

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
                    settings=settings.search,
                    executor=Threads(threads),
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
            with self.scores(effector) as run:
                readings[effector] = evaluate(run.labelled_scores(), seed=seed)
        with self.shares() as run:
            labelled = run.labelled_scores()
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


def _share_captured(labelled: LabelledScores, horizon: int) -> float:
    return float(compared_states(labelled, CAPTURED[horizon], horizon).labels.mean())
