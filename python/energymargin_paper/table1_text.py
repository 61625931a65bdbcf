"""What the paper's Table I says, for the terminal, as Markdown and as CSV."""

from __future__ import annotations

import csv
import io
import platform
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from energymargin.checks import whole_number
from energymargin.evaluation import Cell, Evaluation
from energymargin.evaluation.cells import DASH, PAPER, csv_fields, paper_text
from energymargin.evaluation.labelled import HORIZONS, PAPER_HORIZON, SUCCESS
from energymargin.evaluation.table import CSV_COLUMNS
from energymargin.settings import SearchSettings
from energymargin_paper.ceiling import CEILING, CONTINUATIONS
from energymargin_paper.study import setting

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = [
    "FRAMES",
    "METRICS",
    "WEIGHTS",
    "Settings",
    "Sheet",
    "Table1",
    "TaskResult",
    "check_tasks",
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
METRICS = tuple(NAMES)  # its tasks have one object


@dataclass(frozen=True)
class Settings:
    """What the table is made of; raises ValueError on tasks or numbers that cannot be."""

    tasks: tuple[str, ...] = setting(
        tuple(PAPER), "Which tasks of the paper's table, with commas between."
    )
    trajectories: int = setting(50, "How many trajectories of each task.")
    nodes: int = setting(1000, "Nodes of each search tree.")
    continuations: int = setting(CONTINUATIONS, "Of each state, for the ceiling.")
    seed: int = setting(0, "The same seed gives the same numbers, to the last bit.")

    def __post_init__(self) -> None:
        """Checks them: a mistake is said before anything is computed, or written."""
        check_tasks(self.tasks)
        _ = self.search
        whole_number("trajectories", self.trajectories, 1)
        whole_number("continuations", self.continuations, 1)

    @property
    def search(self) -> SearchSettings:
        """Those of the scores."""
        return SearchSettings(self.nodes, self.seed, search="published")

    def command(self, folder: Path) -> str:
        """What to type to make the table again."""
        options = {
            "nodes": self.nodes,
            "trajectories": self.trajectories,
            "continuations": self.continuations,
            "seed": self.seed,
            "tasks": ",".join(self.tasks),
            "output": folder,
        }
        words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
        return shlex.join(["energymargin", "reproduce", "table1", *words])


def check_tasks(names: Sequence[str]) -> None:
    """Raises ValueError unless these are tasks of the paper's table, each once."""
    wrong = [name for name in names if name not in PAPER or list(names).count(name) > 1]
    if wrong or not names:
        what = repr(wrong[0]) if wrong else "empty"
        raise ValueError(f"tasks has {what}, expected some of {', '.join(PAPER)}, each once")


@dataclass(frozen=True)
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
                writer.writerow([result.task, "", name, "all", horizon, *csv_fields(cell), "", ""])
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
            f"States with fewer than h frames left are left out. "
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


@dataclass(frozen=True)
class Sheet:
    """A title, a table and what there is to say about it, for the terminal and for Markdown."""

    title: str
    header: list[str]
    """Of every column but the first, which names the rows."""
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
        lines = [["", *self.header], ["---"] * (1 + len(self.header)), *self.rows]
        table = [f"| {' | '.join(line).replace(chr(10), '<br>')} |" for line in lines]
        notes = [f"- {note}" for note in self.notes]
        return "\n".join([f"## {self.title}", "", *table, "", *notes, *([""] if notes else [])])


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
    return paper_text(PAPER.get(result.task, {}).get(score))


def _cell(evaluation: Evaluation, score: str) -> Cell | None:
    return evaluation.success if score == SUCCESS else evaluation.states[score][PAPER_HORIZON]


def _lines(cell: Cell | None, *more: str) -> str:
    return "\n".join((DASH, *more) if cell is None else (cell.value(), *cell.intervals(), *more))


def _words(weights: dict[str, float]) -> str:
    return ", ".join(f"{n.replace('_', ' ')} {weight:g}" for n, weight in weights.items() if weight)
