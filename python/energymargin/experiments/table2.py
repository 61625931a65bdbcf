"""The paper's Table II: recorded pushes of ten combinations of object and end-effector.

The paper's own recordings are no part of this library: `published` scores them from a folder.
These are of a simulated stand-in for the real world, in another physics engine: data/push_real. All
scores are kept in one file, state by state: stopped and
started again, the study goes on.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import recordings, tasks
from energymargin.datasets import Dataset
from energymargin.evaluation import Cell, Evaluation, LabelledScores, evaluate
from energymargin.evaluation.cells import csv_fields
from energymargin.evaluation.labelled import PAPER_HORIZON
from energymargin.evaluation.table import CSV_COLUMNS
from energymargin.executors.threads import Threads, thread_count
from energymargin.scenes.files import data_file
from energymargin.settings import SearchSettings
from energymargin.store import Run, ScoreStore
from energymargin.store.scoring import begin_run, score_run
from energymargin.tasks.printed import OBJECTS, TOOLS

__all__ = [
    "COMBINATIONS",
    "HORIZONS",
    "PAPER",
    "QUICK",
    "Row",
    "Settings",
    "Table2",
    "recorded",
    "reproduce",
]

TASK = "push-real"
METRICS = ("capture", "success")  # which share a tree
COMBINATIONS = tuple(f"{name}-{tool}" for name, tool in product(OBJECTS, TOOLS))
K_BAR = 60  # frames
RECORDINGS = 12  # of a combination
FRAME_RATE = 33.0  # Hz
HORIZONS = (0, 2, 5, 10, 20)  # frames
LONG_HORIZON = 20  # frames: the share of a trajectory that two frames are in Table I
STAND_IN = (
    "The recordings are a simulated stand-in: pushes in another physics engine (MuJoCo) with an "
    "arm's and a camera's errors, not the paper's recordings; those are scored by "
    "`energymargin reproduce published`."
)

# AUC and AP of the paper's Table II, on its own recordings.
PAPER: dict[str, dict[str, tuple[float, float]]] = {
    "rectangle-jaw": {"capture": (0.85, 0.89), "success": (0.94, 0.95)},
    "rectangle-round": {"capture": (0.89, 0.98), "success": (1.00, 1.00)},
    "triangle-jaw": {"capture": (0.94, 0.99), "success": (0.69, 0.62)},
    "triangle-round": {"capture": (0.93, 0.99), "success": (0.94, 0.93)},
    "convex-jaw": {"capture": (0.91, 0.92), "success": (1.00, 1.00)},
    "convex-round": {"capture": (0.84, 0.81), "success": (0.91, 0.88)},
    "concave-jaw": {"capture": (0.93, 0.96), "success": (0.67, 0.78)},
    "concave-round": {"capture": (0.97, 0.99), "success": (0.94, 0.93)},
    "irregular-jaw": {"capture": (0.95, 0.99), "success": (0.47, 0.36)},
    "irregular-round": {"capture": (0.94, 0.99), "success": (0.93, 0.87)},
}


@dataclass(frozen=True)
class Settings:
    """Of the study; raises ValueError on what cannot be."""

    combinations: tuple[str, ...] = COMBINATIONS
    nodes: int = 100
    """Of each search tree."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks them: a mistake is said before anything is computed, or written."""
        chosen = list(self.combinations)
        wrong = [name for name in chosen if name not in COMBINATIONS or chosen.count(name) > 1]
        if wrong or not chosen:
            what = repr(wrong[0]) if wrong else "empty"
            raise ValueError(
                f"combinations has {what}, expected some of {', '.join(COMBINATIONS)}, each once"
            )
        SearchSettings(self.nodes, self.seed)


QUICK = Settings(combinations=("rectangle-jaw", "rectangle-round"), nodes=10)
"""For a first picture in a quarter of a minute."""


@dataclass(frozen=True)
class Row:
    """One combination."""

    combination: str
    dataset: Dataset
    labelled: LabelledScores
    evaluation: Evaluation
    seconds: float
    """Of a state's search [s]."""

    def capture(self, horizon: int) -> Cell | None:
        """Of the capture score, against being captured over so many frames more."""
        return self.evaluation.states["capture"][horizon]


@dataclass(frozen=True)
class Table2:
    """What came out."""

    settings: Settings
    rows: list[Row]

    def to_markdown(self) -> str:
        """The paper's table, and every horizon."""
        s = self.settings
        states = self.rows[0].dataset.size if self.rows else 0
        return "\n".join(
            [
                "# Recorded pushes",
                "",
                f"**{STAND_IN}**",
                "",
                f"{RECORDINGS} recordings of each combination, {states} states; AUC/AP with their "
                f"95 % intervals below. Capture: captured now, and over the next "
                f"{LONG_HORIZON} frames (0.6 s). Success: the score of the last {K_BAR} "
                f"frames of a recording, against the observer's verdict. Trees of {s.nodes} nodes, "
                f"seed {s.seed}. The paper's values are of its own recordings, captured now.",
                "",
                *self._main_table(),
                "",
                "## Capture, by the horizon in frames of 1/33 s",
                "",
                *self._horizons_table(),
                "",
            ]
        )

    def to_csv(self) -> str:
        """One line a cell, in full precision; what is not there is empty."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("combination", *CSV_COLUMNS))
        for row in self.rows:
            paper = PAPER[row.combination]
            cells = [("capture", h, row.capture(h)) for h in HORIZONS]
            for score, horizon, cell in [*cells, ("success", "", row.evaluation.success)]:
                told = paper[score] if horizon in (PAPER_HORIZON, "") else ("", "")
                writer.writerow((row.combination, score, "all", horizon, *csv_fields(cell), *told))
        return text.getvalue()

    def _main_table(self) -> list[str]:
        lines = [
            f"| | capture, now | paper's capture, now | capture, {LONG_HORIZON} frames "
            "| success | paper's success | captured | successful | ms a state |",
            "| --- " * 9 + "|",
        ]
        for row in self.rows:
            paper = PAPER[row.combination]
            success = row.evaluation.success
            captured = row.capture(0)
            lines.append(
                f"| {row.combination} | {_cell(row.capture(PAPER_HORIZON))} "
                f"| {_pair(paper['capture'])} | {_cell(row.capture(LONG_HORIZON))} "
                f"| {_cell(success)} | {_pair(paper['success'])} | {_share(captured)} "
                f"| {_share(success)} | {1e3 * row.seconds:.0f} |"
            )
        means = [
            _mean([row.capture(PAPER_HORIZON) for row in self.rows]),
            self._paper_mean("capture"),
            _mean([row.capture(LONG_HORIZON) for row in self.rows]),
            _mean([row.evaluation.success for row in self.rows]),
            self._paper_mean("success"),
        ]
        bold = " | ".join(f"**{value}**" for value in means)
        return [*lines, f"| **mean** | {bold} | | | |"]

    def _horizons_table(self) -> list[str]:
        lines = [
            f"| | {' | '.join(f'h = {h}' for h in HORIZONS)} |",
            "| --- " * (1 + len(HORIZONS)) + "|",
        ]
        for row in self.rows:
            cells = [cell.value() if (cell := row.capture(h)) else "" for h in HORIZONS]
            lines.append(f"| {row.combination} | {' | '.join(cells)} |")
        means = [_mean([row.capture(h) for row in self.rows]) for h in HORIZONS]
        return [*lines, f"| **mean** | {' | '.join(f'**{value}**' for value in means)} |"]

    def _paper_mean(self, score: str) -> str:
        """Of the combinations of this table."""
        return _pair(np.mean([PAPER[row.combination][score] for row in self.rows], axis=0))


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Table2:
    """Scores what the folder's store lacks, and writes table2.md and table2.csv.

    `progress(done, total)` counts states. Raises ValueError on a store that is none.
    """
    executor = Threads(thread_count(threads))
    advance = progress or (lambda _done, _total: None)
    folder.mkdir(parents=True, exist_ok=True)
    sets = {name: recorded(name) for name in settings.combinations}
    search = SearchSettings(settings.nodes, settings.seed, search="published")
    before, total = 0, sum(dataset.size for dataset in sets.values())
    rows = []
    with ScoreStore(folder / "scores.db", create=True) as store:
        for name, dataset in sets.items():

            def count(done: int, _of: int, before: int = before) -> None:
                advance(before + done, total)

            run = begin_run(store, dataset, METRICS, search)
            score_run(dataset, run, executor=executor, progress=count)
            before += dataset.size
            rows.append(_row(name, dataset, run))
    result = Table2(settings, rows)
    (folder / "table2.md").write_text(result.to_markdown())
    (folder / "table2.csv").write_text(result.to_csv())
    return result


def recorded(combination: str, count: int = RECORDINGS) -> Dataset:
    """The first recordings of one combination, placed into the scene of push-real, with labels."""
    name, tool = combination.split("-")
    labels = recordings.read_labels(data_file("push_real/labels.csv"))
    files = [f"{combination}-{number:02}.csv" for number in range(count)]
    return recordings.dataset(
        tasks.make(TASK, object=name, tool=tool),
        [recordings.read_csv(data_file(f"push_real/{file}")) for file in files],
        {file: labels[file] for file in files},
    )


def _row(combination: str, dataset: Dataset, run: Run) -> Row:
    labelled = run.labelled_scores()
    evaluation = evaluate(labelled, horizons=HORIZONS, last=K_BAR)
    return Row(combination, dataset, labelled, evaluation, run.seconds())


def _cell(cell: Cell | None) -> str:
    if cell is None:
        return ""
    return "<br>".join((cell.value(), *cell.intervals()))


def _mean(cells: Sequence[Cell | None]) -> str:
    """AUC/AP, in the mean of the cells that are there."""
    values = [(cell.auc, cell.ap) for cell in cells if cell is not None]
    return _pair(np.mean(values, axis=0)) if values else ""


def _pair(values: Sequence[float] | NDArray[np.float64]) -> str:
    """AUC/AP, such as ".915/.954"."""
    return "/".join("1.00" if value >= 0.9995 else f"{value:.3f}"[1:] for value in values)


def _share(cell: Cell | None) -> str:
    """Of the label 1."""
    return "" if cell is None else f"{cell.positives / cell.count:.0%}"
