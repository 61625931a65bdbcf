"""The paper's figure of robustness against model errors: AP of a score whose inputs are wrong.

Recorded pushes get errors of growing size, and are scored as if they were true. All scores are kept
in one file, state by state: stopped and started again, the study goes on.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin.datasets.generation import load_or_generate
from energymargin.evaluation.labelled import HORIZON
from energymargin.executors.threads import Threads, thread_count
from energymargin.experiments.perturbation_errors import KINDS, LARGEST, perturbed, typical
from energymargin.experiments.quality import check_labels, quality
from energymargin.settings import SearchSettings
from energymargin.store import ScoreStore
from energymargin.store.scoring import begin_run, score_run
from energymargin.tasks.base import whole_number

__all__ = ["PAPER", "QUICK", "Perturbation", "Point", "Settings", "reproduce"]

TASK = "push"
FRAMES = 10
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
    """Of the study; raises ValueError on numbers out of range."""

    trajectories: int = 50
    nodes: int = 100
    """Of each search tree."""
    levels: tuple[float, ...] = (0.0, 0.1, 0.2, 0.5, 1.0)
    """Scaled largest errors."""
    draws: int = 5
    """Of the errors, at each level."""
    seed: int = 0
    """Of the searches; the errors of draw i have the seed i."""

    def __post_init__(self) -> None:
        """Checks the numbers: a mistake is said before anything is computed, or written."""
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
        return SearchSettings(self.nodes, self.seed, search="published")


QUICK = Settings(trajectories=10, nodes=20, levels=(0.0, 0.5, 1.0), draws=2)
"""For a first picture in seconds."""


@dataclass(frozen=True)
class Point:
    """One level of one kind of error."""

    kind: str
    level: float
    ap: NDArray[np.float64]
    """Of each draw, shape (draws,)."""
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


@dataclass(frozen=True)
class Perturbation:
    """What came out."""

    settings: Settings
    typical: dict[str, tuple[float, ...]]
    """What each of LARGEST is held against, in these data."""
    states: int
    """How many there are, in a draw."""
    points: list[Point]

    def curve(self, kind: str) -> list[Point]:
        """The points of one kind of error, by level."""
        return sorted((p for p in self.points if p.kind == kind), key=lambda p: p.level)

    def to_csv(self) -> str:
        """One line a point, then one for each point of the paper's curves."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("source", "error", "scaled", "ap", "ap_low", "ap_high", "draws", "again"))
        for kind in KINDS:
            for p in self.curve(kind):
                numbers = (p.mean, *p.interval, len(p.ap), p.again)
                writer.writerow(("ours", p.kind, p.level, *numbers))
        for kind in KINDS:
            for level, ap in PAPER[kind].items():
                writer.writerow(("paper", kind, level, ap, "", "", "", ""))
        return text.getvalue()

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
                *self._aps(),
                "",
                *self._says(),
                "",
                *self._largest(),
            ]
        )

    def _aps(self) -> list[str]:
        lines = [f"| scaled error | {' | '.join(KINDS)} |", "| ---: " * (1 + len(KINDS)) + "|"]
        for points in zip(*map(self.curve, KINDS), strict=True):
            level = points[0].level
            cells = [_cell(point) for point in points]
            papers = [PAPER[p.kind].get(level) for p in points]
            shown = [
                cell + (f", paper {paper:.2f}" if paper is not None else "")
                for cell, paper in zip(cells, papers, strict=True)
            ]
            lines.append(f"| {level:g} | {' | '.join(shown)} |")
        return lines

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
            "| error | of | largest | in the data | share | why |",
            "| --- | --- | ---: | --- | ---: | --- |",
        ]
        for kind in KINDS:
            for largest, usual in zip(LARGEST[kind], self.typical[kind], strict=True):
                unit = f" {largest.unit}".rstrip()
                cells = [
                    *(kind, largest.quantity, f"{largest.value:g}{unit}"),
                    f"{largest.measure} {usual:.3f}{unit}",
                    f"{100 * largest.value / usual:.0f} %",
                    largest.reason,
                ]
                lines.append(f"| {' | '.join(cells)} |")
        return [*lines, ""]


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Perturbation:
    """Scores what the folder's store lacks, and writes perturbation.md and perturbation.csv.

    `progress(done, total)` counts states. Raises ValueError on a folder of other trajectories, and
    on trajectories that all have the same label.
    """
    executor = Threads(thread_count(threads))
    advance = progress or (lambda _done, _total: None)
    folder.mkdir(parents=True, exist_ok=True)
    dataset = load_or_generate(
        folder / f"{TASK}.h5", tasks.make(TASK), settings.trajectories, FRAMES, seed=0
    )
    check_labels(dataset)
    jobs = list(product(range(settings.draws), settings.levels, KINDS))
    aps: dict[tuple[str, float], list[float]] = {}
    again = dict.fromkeys(product(KINDS, settings.levels), 0)
    with ScoreStore(folder / "scores.db", create=True) as store:
        for number, (draw, level, kind) in enumerate(jobs):

            def count(done: int, of: int, number: int = number) -> None:
                advance(number * of + done, len(jobs) * of)

            metric = FORCE if kind == FORCE else "capture"
            changed = perturbed(dataset, kind, level, draw)
            run = begin_run(store, changed.dataset, (metric,), settings.search)
            score_run(changed.dataset, run, executor=executor, progress=count)
            aps.setdefault((kind, level), []).append(quality(run.labelled_scores())[metric][1])
            again[kind, level] += changed.again
    points = [Point(*at, np.array(values), again[at]) for at, values in aps.items()]
    result = Perturbation(settings, typical(dataset), dataset.size, points)
    (folder / "perturbation.md").write_text(result.to_markdown())
    (folder / "perturbation.csv").write_text(result.to_csv())
    return result


def _cell(point: Point) -> str:
    low, high = point.interval
    return f"{point.mean:.3f}" + (f" ({low:.3f} to {high:.3f})" if high > low else "")
