"""The paper's figure of robustness against model errors: AP of a score whose inputs are wrong.

Recorded pushes get errors of growing size, and are scored as if they were true. All scores are kept
in one file, state by state: stopped and started again, the study goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin.base.checks import whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.datasets import Dataset
from energymargin.evaluate.executors.choice import Threads
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import LabelledScores, evaluate
from energymargin.records.evaluation.labelled import HORIZON, captured_labels
from energymargin.records.store.scoring import begin_run, score_run
from energymargin.store import ScoreStore
from energymargin_paper.jobs import load_or_generate
from energymargin_paper.paper.perturbation_errors import KINDS, LARGEST, perturbed, typical
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PAPER", "STUDY", "Perturbation", "Point", "Settings", "figure_perturbation"]

TASK = "push"
FRAMES = 10  # of a trajectory
FORCE = "force"
CONFIDENCE = 0.95

# The paper's curves, from the source of its figure: AP by scaled largest error.
PAPER: dict[str, dict[float, float]] = {
    "friction": {0.0: 0.99, 0.1: 0.99, 0.2: 0.99, 0.5: 0.99, 1.0: 1.0},
    "velocity": {0.0: 0.99, 0.1: 0.98, 0.5: 0.98, 1.0: 0.95},
    "position": {0.0: 0.99, 0.2: 0.99, 0.6: 0.95, 1.0: 0.9},
    FORCE: {0.0: 0.94, 0.2: 0.902, 0.4: 0.874, 0.7: 0.864, 1.0: 0.85},
}


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    trajectories: int = setting(50, "Pushes, of 10 states each.")
    nodes: int = setting(100, "Nodes of each search tree.")
    levels: tuple[float, ...] = setting(
        (0.0, 0.1, 0.2, 0.5, 1.0),
        "Scaled largest errors, from 0 to 1, separated by commas.",
        shown="0,0.1,0.2,0.5,1",
    )
    draws: int = setting(5, "Draws of the errors at each level.")
    seed: int = 0
    """Seed of the searches; the errors of draw i have the seed i."""

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        _ = self.search
        whole_number("trajectories", self.trajectories, 2)
        whole_number("draws", self.draws, 1)
        wrong = [level for level in self.levels if not 0 <= level <= 1]
        if wrong:
            raise ValueError(f"levels has {wrong[0]}, expected numbers from 0 to 1")
        if len(set(self.levels)) < max(len(self.levels), 1):
            raise ValueError(f"levels is {list(self.levels)}, expected some numbers, each once")

    @property
    def search(self) -> SearchSettings:
        """Those of the scores."""
        return SearchSettings(self.nodes, self.seed)


@dataclass(frozen=True, eq=False)
class Point:
    """One level of one kind of error."""

    kind: str
    level: float
    ap: NDArray[np.float64]
    """Average precision of each draw, shape (draws,)."""
    again: int
    """How often a state was drawn again, in all draws."""

    @property
    def mean(self) -> float:
        """Over the draws."""
        return float(self.ap.mean())

    @property
    def interval(self) -> tuple[float, float]:
        """Student's 95 % interval of the mean, within 0..1; of draws that do not differ, the mean
        itself."""
        if np.ptp(self.ap) == 0:
            return self.mean, self.mean
        from scipy.stats import t

        reach = t.ppf((1 + CONFIDENCE) / 2, len(self.ap) - 1)
        half = float(reach * self.ap.std(ddof=1) / math.sqrt(len(self.ap)))
        return max(0.0, self.mean - half), min(1.0, self.mean + half)


@dataclass(frozen=True, eq=False)
class Perturbation:
    """The result."""

    settings: Settings
    typical: dict[str, tuple[float, ...]]
    """What each of LARGEST is compared with, in these data."""
    states: int
    """How many there are, in a draw."""
    points: list[Point]

    def curve(self, kind: str) -> list[Point]:
        """The points of one kind of error, by level."""
        return sorted((p for p in self.points if p.kind == kind), key=lambda p: p.level)

    def to_csv(self) -> str:
        """One line a point, then one for each point of the paper's curves."""
        ours = [
            ("ours", p.kind, p.level, p.mean, *p.interval, len(p.ap), p.again)
            for kind in KINDS
            for p in self.curve(kind)
        ]
        theirs = [
            ("paper", kind, level, ap, "", "", "", "")
            for kind in KINDS
            for level, ap in PAPER[kind].items()
        ]
        header = ("source", "error", "scaled", "ap", "ap_low", "ap_high", "draws", "again")
        return csv_text(header, [*ours, *theirs])

    def to_markdown(self) -> str:
        """The table, what it says, and what the errors are."""
        s = self.settings
        return "\n".join(
            [
                "# Robustness against errors of the model",
                "",
                f"{TASK}: {s.trajectories} trajectories of {FRAMES} states, seed 0, {s.nodes} "
                f"nodes a tree. AP of the capture score, and with force errors of the force score, "
                f"against being captured over the next {HORIZON} frames; the labels are those of "
                f"the true states. Mean over the draws of the errors, {s.draws} at each level, and "
                "Student's 95 % interval of that mean, where they differ; it does not hold what "
                "other trajectories would change.",
                "",
                self._aps(),
                "",
                *self._says(),
                "",
                *self._largest(),
            ]
        )

    def _aps(self) -> str:
        rows = []
        for points in zip(*map(self.curve, KINDS), strict=True):
            level = points[0].level
            cells = [_cell(point) for point in points]
            papers = [PAPER[p.kind].get(level) for p in points]
            shown = [
                cell + (f", paper {paper:.2f}" if paper is not None else "")
                for cell, paper in zip(cells, papers, strict=True)
            ]
            rows.append([f"{level:g}", *shown])
        return markdown_table(["scaled error", *KINDS], rows, ["right"] * (1 + len(KINDS)))

    def _says(self) -> list[str]:
        """How ours stand to the force score, and how often a state was drawn again."""
        ours = [p for p in self.points if p.kind != FORCE]
        force = {p.level: p.mean for p in self.curve(FORCE)}
        below = [f"{p.kind} at {p.level:g}" for p in ours if p.mean <= force[p.level]]
        lowest = min(ours, key=lambda p: p.mean)
        least, first = min(force), force[min(force)]
        drawn = [
            f"{p.level:g}: {p.again} of {p.again + len(p.ap) * self.states}"
            for p in self.curve("position")
            if p.level > 0
        ]
        return [
            "- The capture score is above the force score with each error at every level."
            if not below
            else f"- The capture score is not above the force score with {', '.join(below)}.",
            f"- Its lowest AP, {lowest.mean:.3f} ({lowest.kind} at {lowest.level:g}), is "
            f"{'above' if lowest.mean > first else 'not above'} the force score's at {least:g}, "
            f"{first:.3f}.",
            "- Draws of positions that had no place, and were made again, by scaled error: "
            f"{'; '.join(drawn) or 'none'}. That favours errors that keep the bodies apart.",
        ]

    def _largest(self) -> list[str]:
        lines = [
            "Where the scaled error is 1, each is about the whole of what its quantity is over the "
            "recorded states: of the mean, and of the median of the forces, which a few blows "
            "would rule. Friction: uniform from 0 up, one draw a trajectory. All others: uniform "
            "to both sides, in each state.",
            "",
        ]
        rows = []
        for kind in KINDS:
            for largest, usual in zip(LARGEST[kind], self.typical[kind], strict=True):
                unit = f" {largest.unit}".rstrip()
                cells = [
                    *(kind, largest.quantity, f"{largest.value:g}{unit}"),
                    f"{largest.measure} {usual:.3f}{unit}",
                    f"{100 * largest.value / usual:.0f} %",
                    largest.reason,
                ]
                rows.append(cells)
        header = ("error", "of", "largest", "in the data", "share", "why")
        align = ("left", "left", "right", "left", "right", "left")
        return [*lines, markdown_table(header, rows, align), ""]


class PerturbationStudy(Study[Settings, Perturbation]):
    """How well capture is predicted from a wrong friction, velocity or position; or wrong forces.

    The paper's figure of robustness against errors of the model, on planar pushing: AP of the
    capture score, and of the force score, whose inputs have errors of growing size, beside the
    paper's curves.

    The folder gets perturbation.md, perturbation.csv, perturbation.png, the pushes (push.h5) and
    all scores (scores.db).

    Example: `energymargin reproduce perturbation --levels 0,0.5,1 --draws 3`
    """

    name = "perturbation"
    title, unit = "Scoring with errors", "states"
    settings = Settings()
    quick = Settings(trajectories=10, nodes=20, levels=(0.0, 0.5, 1.0), draws=2)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Perturbation:
        """Scores what the folder's store lacks. Raises ValueError on a folder of other
        trajectories, and on trajectories that all have the same label."""
        dataset = _pushes(folder, settings.trajectories)
        jobs = list(product(range(settings.draws), settings.levels, KINDS))
        aps: dict[tuple[str, float], list[float]] = {}
        again = dict.fromkeys(product(KINDS, settings.levels), 0)
        with ScoreStore(folder / "scores.db", create=True) as store:
            for number, (draw, level, kind) in enumerate(jobs):

                def count(done: int, of: int, number: int = number) -> None:
                    progress(number * of + done, len(jobs) * of)

                changed = perturbed(dataset, kind, level, draw)
                labelled = _scored(
                    store, changed.dataset, kind, settings=settings, threads=threads, count=count
                )
                aps.setdefault((kind, level), []).append(_ap(labelled))
                again[kind, level] += changed.again
            points = [Point(*at, np.array(values), again[at]) for at, values in aps.items()]
        return Perturbation(settings, typical(dataset), dataset.size, points)

    def figures(self, result: Perturbation) -> Iterator[tuple[str, Figure]]:
        """AP against the scaled largest error."""
        yield "perturbation.png", figure_perturbation(result)


STUDY = PerturbationStudy()


def _pushes(folder: Path, trajectories: int) -> Dataset:
    """So many pushes, seed 0, kept in the folder as push.h5.

    Raises ValueError if the file has other trajectories, and unless some states are captured over
    the next HORIZON frames and some are not, and some pushes succeed and some do not.
    """
    path = folder / f"{TASK}.h5"
    dataset = load_or_generate(path, tasks.make(TASK), trajectories, FRAMES, seed=0)
    captured = [captured_labels(t.captured, HORIZON) for t in dataset.trajectories]
    for labels in (dataset.successes, np.concatenate(captured)):
        if labels.all() or not labels.any():
            raise ValueError(
                f"trajectories is {trajectories}, expected so many that some fail and some succeed"
            )
    return dataset


def _scored(
    store: ScoreStore,
    dataset: Dataset,
    kind: str,
    *,
    settings: Settings,
    threads: int,
    count: Callable[[int, int], None],
) -> LabelledScores:
    """The scores of states whose model may have errors of a kind; the store gets what it lacks."""
    metric = FORCE if kind == FORCE else "capture"
    run = begin_run(store, dataset, (metric,), settings.search)
    score_run(dataset, run, executor=Threads(threads), progress=count)
    return run.labelled_scores()


def _ap(labelled: LabelledScores) -> float:
    """Average precision of the one metric that there is; its intervals are not looked at."""
    (cells,) = evaluate(labelled, frames=(HORIZON,), draws=1).states.values()
    cell = cells[HORIZON]
    assert cell is not None  # some states stay captured, and some do not
    return cell.ap


def _cell(point: Point) -> str:
    low, high = point.interval
    return f"{point.mean:.3f}" + (f" ({low:.3f} to {high:.3f})" if high > low else "")


# Colours of Okabe and Ito, and markers, which the paper's grey curves share.
STYLES = {
    "friction": ("#0072B2", "o"),
    "velocity": ("#E69F00", "s"),
    "position": ("#009E73", "^"),
    FORCE: ("#D55E00", "D"),
}
PAPER_COLOR = "0.65"


def figure_perturbation(result: Perturbation) -> Figure:
    """A curve for each kind of error, with the interval of its mean as a band; the paper's in grey,
    dashed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.6), dpi=200, layout="constrained")
    ax = figure.subplots()
    for kind in KINDS:
        color, marker = STYLES[kind]
        points = result.curve(kind)
        levels = [point.level for point in points]
        name = f"{kind} (force score)" if kind == FORCE else kind
        ax.plot(
            *(levels, [point.mean for point in points]),
            color=color,
            marker=marker,
            markersize=5,
            linewidth=1.5,
            label=name,
            zorder=4,
        )
        low, high = zip(*(point.interval for point in points), strict=True)
        ax.fill_between(levels, low, high, color=color, alpha=0.2, linewidth=0, zorder=3)
        ax.plot(
            *(list(PAPER[kind]), list(PAPER[kind].values())),
            color=PAPER_COLOR,
            marker=marker,
            markersize=4,
            linestyle="--",
            linewidth=1.1,
            label=f"paper: {kind}",
            zorder=2,
        )
    ax.set_xlabel("scaled largest error (1: the whole of what the quantity is in the mean)")
    ax.set_ylabel("AP of the prediction of capture")
    ax.set_xlim(-0.03, 1.03)
    ax.set_ylim(top=1.015)
    ax.grid(alpha=0.25, linewidth=0.5)
    figure.legend(loc="outside lower center", ncols=len(KINDS), frameon=False, fontsize=8)
    return figure
