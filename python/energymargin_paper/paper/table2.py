"""The paper's Table II: recorded pushes of ten combinations of object and end-effector.

The paper's own recordings are no part of this library: `published` scores them from a folder.
These are of a simulated stand-in for the real world, in another physics engine: data/push_real. All
scores are kept in one file, state by state: stopped and started again, the study goes on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import recordings, tasks
from energymargin._core import capture_score, stream
from energymargin.base.table_text import csv_text, markdown_table, short
from energymargin.datasets import Dataset
from energymargin.evaluate.executors.choice import Threads
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import Cell, Evaluation, LabelledScores, evaluate
from energymargin.model.scenes.files import data_file
from energymargin.records.evaluation.labelled import captured_labels
from energymargin.records.evaluation.table import CSV_COLUMNS, csv_fields
from energymargin.records.store.scoring import begin_run, score_run
from energymargin.store import Run, ScoreStore
from energymargin_paper.paper.printed import OBJECTS, TOOLS
from energymargin_paper.paper.table1 import PAPER_COLUMNS, PAPER_HORIZON
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "COMBINATIONS",
    "HORIZONS",
    "PAPER",
    "STUDY",
    "Combination",
    "Settings",
    "Table2",
    "figure_table2",
    "most_wrong",
    "recorded",
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
    """The study's settings; raises ValueError on unknown names and numbers out of range."""

    combinations: tuple[str, ...] = setting(
        COMBINATIONS,
        "Combinations of object and end-effector, as rectangle-jaw, separated by commas.",
        shown="all ten",
    )
    nodes: int = setting(100, "Nodes of each search tree.")
    seed: int = setting(0, "Seed of the searches.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        chosen = list(self.combinations)
        wrong = [name for name in chosen if name not in COMBINATIONS or chosen.count(name) > 1]
        if wrong or not chosen:
            what = repr(wrong[0]) if wrong else "empty"
            raise ValueError(
                f"combinations has {what}, expected some of {', '.join(COMBINATIONS)}, each once"
            )
        SearchSettings(self.nodes, self.seed)


@dataclass(frozen=True)
class Combination:
    """One combination."""

    combination: str
    dataset: Dataset
    labelled: LabelledScores
    evaluation: Evaluation
    seconds: float
    """Time of a state's search [s]."""

    def capture(self, horizon: int) -> Cell | None:
        """AUC and AP of the capture score against being captured over so many frames more."""
        return self.evaluation.states["capture"][horizon]


@dataclass(frozen=True, eq=False)
class Table2:
    """The result."""

    settings: Settings
    rows: list[Combination]

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
                self._main_table(),
                "",
                "## Capture, by the horizon in frames of 1/33 s",
                "",
                self._horizons_table(),
                "",
            ]
        )

    def to_csv(self) -> str:
        """One line a cell, in full precision; what is not there is empty."""
        lines = []
        for row in self.rows:
            paper = PAPER[row.combination]
            cells = [("capture", h, row.capture(h)) for h in HORIZONS]
            for score, horizon, cell in [*cells, ("success", "", row.evaluation.success)]:
                reported = paper[score] if horizon in (PAPER_HORIZON, "") else ("", "")
                lines.append((row.combination, score, "all", horizon, *csv_fields(cell), *reported))
        return csv_text(("combination", *CSV_COLUMNS, *PAPER_COLUMNS), lines)

    def _main_table(self) -> str:
        header = (
            *("", "capture, now", "paper's capture, now", f"capture, {LONG_HORIZON} frames"),
            *("success", "paper's success", "captured", "successful", "ms a state"),
        )
        lines = []
        for row in self.rows:
            paper = PAPER[row.combination]
            success = row.evaluation.success
            captured = row.capture(0)
            lines.append(
                [
                    *(row.combination, _cell(row.capture(PAPER_HORIZON)), _pair(paper["capture"])),
                    *(_cell(row.capture(LONG_HORIZON)), _cell(success), _pair(paper["success"])),
                    *(_share(captured), _share(success), f"{1e3 * row.seconds:.0f}"),
                ]
            )
        means = [
            _mean([row.capture(PAPER_HORIZON) for row in self.rows]),
            self._paper_mean("capture"),
            _mean([row.capture(LONG_HORIZON) for row in self.rows]),
            _mean([row.evaluation.success for row in self.rows]),
            self._paper_mean("success"),
        ]
        lines.append(["**mean**", *(f"**{value}**" for value in means), "", "", ""])
        return markdown_table(header, lines)

    def _horizons_table(self) -> str:
        lines = []
        for row in self.rows:
            cells = [cell.value() if (cell := row.capture(h)) else "" for h in HORIZONS]
            lines.append([row.combination, *cells])
        means = [_mean([row.capture(h) for row in self.rows]) for h in HORIZONS]
        lines.append(["**mean**", *(f"**{value}**" for value in means)])
        return markdown_table(["", *(f"h = {h}" for h in HORIZONS)], lines)

    def _paper_mean(self, score: str) -> str:
        """Mean of the combinations of this table."""
        return _pair(np.mean([PAPER[row.combination][score] for row in self.rows], axis=0))


class Table2Study(Study[Settings, Table2]):
    """How well capture and success are predicted on recorded pushes of five objects by two tools.

    The recordings are a simulated stand-in for the paper's, which `reproduce published` scores:
    pushes in another physics engine, with an arm's and a camera's errors (data/push_real).

    The folder gets table2.md, table2.csv, table2.png and all scores (scores.db).

    Example: `energymargin reproduce table2 --combinations rectangle-jaw,convex-round`
    """

    name = "table2"
    title, unit = "Scoring", "states"
    settings = Settings()
    quick = Settings(combinations=("rectangle-jaw", "rectangle-round"), nodes=10)
    packages = ("coacd",)

    def compute(self, settings: Settings, folder: Path, threads: int, progress: Progress) -> Table2:
        """Scores what the folder's store lacks. Raises ValueError on a store that is none."""
        sets = {name: recorded(name) for name in settings.combinations}
        search = SearchSettings(settings.nodes, settings.seed)
        before, total = 0, sum(dataset.size for dataset in sets.values())
        rows = []
        with ScoreStore(folder / "scores.db", create=True) as store:
            for name, dataset in sets.items():

                def count(done: int, _of: int, before: int = before) -> None:
                    progress(before + done, total)

                run = begin_run(store, dataset, METRICS, search)
                score_run(dataset, run, executor=Threads(threads), progress=count)
                before += dataset.size
                rows.append(_row(name, dataset, run))
        return Table2(settings, rows)

    def figures(self, result: Table2) -> Iterator[tuple[str, Figure]]:
        """The state of each combination that the capture score gets most wrong."""
        yield "table2.png", figure_table2(result)


STUDY = Table2Study()


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


def _row(combination: str, dataset: Dataset, run: Run) -> Combination:
    labelled = run.labelled_scores()
    evaluation = evaluate(labelled, frames=HORIZONS, last=K_BAR)
    return Combination(combination, dataset, labelled, evaluation, run.seconds())


def _cell(cell: Cell | None) -> str:
    return "" if cell is None else "\n".join((cell.value(), *cell.intervals()))


def _mean(cells: Sequence[Cell | None]) -> str:
    """AUC/AP, in the mean of the cells that are there."""
    values = [(cell.auc, cell.ap) for cell in cells if cell is not None]
    return _pair(np.mean(values, axis=0)) if values else ""


def _pair(values: Sequence[float] | NDArray[np.float64]) -> str:
    """AUC/AP, such as ".915/.954"."""
    return "/".join(map(short, values))


def _share(cell: Cell | None) -> str:
    """Share of the label 1."""
    return "" if cell is None else f"{cell.positives / cell.count:.0%}"


VIEW = ((-0.12, 0.12), (-0.08, 0.16))  # m
LEGEND = 0.5  # inch


def figure_table2(result: Table2) -> Figure:
    """A column an object and a row an end-effector, as far as they were asked for."""
    from matplotlib.figure import Figure

    rows = {row.combination: row for row in result.rows}
    objects = list(dict.fromkeys(name.split("-")[0] for name in rows))
    tools = [tool for tool in TOOLS if any(name.endswith(tool) for name in rows)]
    size = (2.4 * len(objects) + 0.6, 2.9 * len(tools) + LEGEND)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(tools), len(objects), squeeze=False, sharex=True, sharey=True)
    for (i, tool), (j, name) in product(enumerate(tools), enumerate(objects)):
        row = rows.get(f"{name}-{tool}")
        if row is None:
            axes[i, j].set_axis_off()
            continue
        handles = _draw(axes[i, j], row, result.settings)
        axes[i, j].label_outer()
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(len(handles), 2 * len(objects)),
        frameon=False,
        fontsize=7,
    )
    return figure


def _draw(ax: Axes, row: Combination, settings: Settings) -> list[Artist]:
    """The tree of the state that is most wrong; the entries of a legend."""
    from energymargin import plots

    number = most_wrong(row)
    (problem,) = row.dataset.problems([number])
    score = capture_score(
        problem, nodes=settings.nodes, seed=stream(settings.seed, number), warn=False
    )
    most = float(score.tree.costs.max())
    look: dict[str, Any] = {"limits": VIEW, "most": most, "path": False, "color_bar": False}
    plots.plot_state(problem, score, ax=ax, **look, ghosts=2)
    truth = "stays" if _labels(row)[number] else "lost"
    ax.set_title(
        f"{row.combination}\n{truth} within {LONG_HORIZON / FRAME_RATE:.1f} s, "
        f"score {row.labelled.scores['capture'][number]:.2f}",
        fontsize=8,
    )
    return list(plots.state_legend(problem))


def most_wrong(row: Combination) -> int:
    """The number of the state whose score lies on the wrong side of most states of the other label,
    captured over the long horizon or not."""
    labels = _labels(row)
    scores = row.labelled.scores["capture"]
    wrong = np.where(
        labels,
        [(scores[~labels] > score).mean() for score in scores],
        [(scores[labels] < score).mean() for score in scores],
    )
    return int(wrong.argmax())


def _labels(row: Combination) -> NDArray[np.bool_]:
    members = row.labelled.by_trajectory()
    captured = row.labelled.captured
    return np.concatenate([captured_labels(captured[own], LONG_HORIZON) for own in members])
