"""The tables of `foresight`, and what a study of it is made of."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import positive_number, whole_number
from energymargin.evaluation import Cell
from energymargin.evaluation.bootstrap import DRAWS, bootstrap_weights
from energymargin.evaluation.calibration import (
    BINS,
    Reliability,
    brier,
    calibration_error,
    reliability,
)
from energymargin.evaluation.cells import DASH, cell_of, csv_fields
from energymargin.evaluation.labelled import Compared
from energymargin.shares import short
from energymargin.tasks.base import Following
from energymargin_paper.study import setting

__all__ = [
    "FRESH",
    "HORIZONS",
    "LAST",
    "LEARNED",
    "NAMES",
    "NOMINAL",
    "NO_PROBABILITY",
    "OBJECTS",
    "PLANS",
    "PUBLISHED",
    "SCRIPT",
    "STRENGTH",
    "TASKS",
    "Foresight",
    "Method",
    "Settings",
    "TaskForesight",
]

TASKS = ("push", "balance", "topple", "grasp", "scoop", "push-multi")
HORIZONS = range(1, 6)  # frames
LAST = {"topple": 4}  # frames of the column with intervals; no box of topple is held for five
PUBLISHED = ("capture", "effort/est")
SCRIPT, NOMINAL, FRESH, LEARNED = "script", "nominal", "fresh", "learned"

# One rule for all tasks: how strong the disturbance is, as a share of the problem's bounds, and how
# many objects each of its pieces meets. Fixed on trajectories of another seed, as
# docs/results/foresight.md says.
STRENGTH = 0.6
OBJECTS = 2  # or as many as a task has

# What the robot does, by the name of a probability.
PLANS: dict[str, Following | None] = {
    "coast": None,
    "hold": "hold",
    SCRIPT: "script",
    "default": "script",
    FRESH: "script",
    NOMINAL: "script",
}

# In the order of the tables.
NAMES = {
    "capture": "capture score",
    "effort/est": "effort, AO-EST",
    "coast": "probability, coasting",
    "hold": "probability, hold",
    SCRIPT: "probability, script",
    "default": "probability, script, Uniform()",
    NOMINAL: "script alone, undisturbed",
    LEARNED: "learned from raw states",
    "ceiling": "ceiling",
}
NO_PROBABILITY = ("effort/est",)
UNSURE = (0.05, 0.95)  # probabilities between are neither sure to hold nor sure to be lost


@dataclass(frozen=True)
class Method:
    """How a probability is estimated."""

    rollouts: int
    strength: float
    objects: int | None
    seed: int


@dataclass(frozen=True)
class Settings:
    """Of the study; raises ValueError on numbers out of range."""

    tasks: tuple[str, ...] = setting(TASKS, "Which tasks, with commas between.")
    trajectories: int = setting(50, "Of each task, of ten frames.")
    nodes: int = setting(100, "Of the published scores' trees.")
    rollouts: int = setting(30, "Of each probability.")
    fresh: int = setting(
        100, "Others, which the probabilities are held against, with another seed; 0: none."
    )
    continuations: int = setting(100, "Of each state for the ceiling.")
    strength: float = setting(STRENGTH, "Of the disturbance, as a share of the bounds.")
    objects: int = setting(
        OBJECTS, "How many objects are disturbed at a time, at most those there are."
    )
    seed: int = setting(0, "Of all that is random.")

    def __post_init__(self) -> None:
        """Checks them."""
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
        """Of the probabilities, by name."""
        stated = Method(self.rollouts, self.strength, self.objects, self.seed)
        found = dict.fromkeys(("coast", "hold", SCRIPT), stated)
        found["default"] = Method(self.rollouts, 1.0, None, self.seed)
        found[NOMINAL] = Method(0, 0.0, None, 0)
        if self.fresh:
            found[FRESH] = Method(self.fresh, self.strength, self.objects, self.seed + 1)
        return found


@dataclass(frozen=True)
class TaskForesight:
    """The N states of one task."""

    task: str
    trajectory: NDArray[np.int64]
    """Shape (N,)."""
    labels: dict[int, NDArray[np.bool_]]
    """By horizon, shape (N,): whether a state stays captured until then."""
    counts: dict[int, NDArray[np.bool_]]
    """By horizon, shape (N,): whether it is captured now, and has so many frames left."""
    scores: dict[str, dict[int, NDArray[np.float64]]]
    """By name and horizon, shape (N,); NaN where there is none."""
    steps: dict[str, float]
    """By name: simulation steps a state."""
    missing: int
    """States whose problem or rollouts failed, of all probabilities together."""
    seed: int = 0

    @property
    def last(self) -> int:
        """The horizon of the columns with intervals."""
        return LAST.get(self.task, max(HORIZONS))

    @cached_property
    def cells(self) -> dict[str, dict[int, Cell | None]]:
        """By name and horizon: AUC and AP; None where there is but one label to tell apart."""
        weights = bootstrap_weights(int(self.trajectory.max()) + 1, DRAWS, self.seed)
        return {
            name: {h: cell_of(self.compared(name, h), weights) for h in HORIZONS}
            for name in NAMES
            if name in self.scores
        }

    def compared(self, name: str, horizon: int) -> Compared:
        """The states that count and have a score, with their labels."""
        scores = self.scores[name][horizon]
        chosen = np.flatnonzero(self.counts[horizon] & ~np.isnan(scores))
        labels = self.labels[horizon][chosen]
        return Compared(scores[chosen], labels, self.trajectory[chosen], chosen)

    def reliability(self, name: str, horizon: int) -> Reliability | None:
        """Of a probability against what happened; None without a state."""
        scores, labels, *_ = self.compared(name, horizon)
        return reliability(scores, labels.astype(float)) if len(scores) else None

    def calibration(self, name: str, horizon: int) -> tuple[float, float] | None:
        """Brier score and expected calibration error against what happened."""
        scores, labels, *_ = self.compared(name, horizon)
        if name in NO_PROBABILITY or not len(scores):
            return None
        happened = labels.astype(float)
        return brier(scores, happened), calibration_error(scores, happened)

    def against_fresh(self, horizon: int, *, unsure: bool) -> tuple[float, int] | None:
        """Expected error of the probability against shares of fresh rollouts, and of how many
        states: all, or those that are `unsure`. None without any."""
        if FRESH not in self.scores:
            return None
        p, fresh = (self.scores[name][horizon][self.counts[horizon]] for name in (SCRIPT, FRESH))
        there = ~np.isnan(p) & ~np.isnan(fresh)
        if unsure:
            there &= (p >= UNSURE[0]) & (p <= UNSURE[1])
        if not there.any():
            return None
        return calibration_error(p[there], fresh[there]), int(there.sum())


@dataclass(frozen=True)
class Foresight:
    """What came out."""

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
            f"and have h frames left. Version {version('energymargin')}, {own.trajectories} "
            f"trajectories of ten frames a task, seed {own.seed}; trees of {own.nodes} nodes, "
            f"{own.rollouts} rollouts. The disturbance of a probability is "
            f"Uniform(strength={own.strength:g}, objects={own.objects}): each piece meets {many}, "
            "where there are so many. "
            "Beside it stands the default, Uniform(). The intervals, 95 % by trajectory, the Brier "
            f"score and the expected calibration error (ECE, {BINS} bins of equal mass) are of the "
            "horizon in the head of their column.",
        ]
        for task in self.tasks:
            lines += ["", f"## {task.task}", "", *_table(task)]
        if own.fresh:
            lines += ["", "## Against fresh rollouts", "", *self._fresh()]
        return "\n".join(lines) + "\n"

    def _fresh(self) -> Iterator[str]:
        own = self.settings
        yield (
            f"How far the probability of {own.rollouts} rollouts is from the share of {own.fresh} "
            f"others under the same disturbance: the expected error over {BINS} bins."
        )
        yield ""
        yield f"| | horizon | all states | from {UNSURE[0]:g} to {UNSURE[1]:g} |"
        yield "| --- | ---: | ---: | ---: |"
        for task in self.tasks:
            both = [task.against_fresh(task.last, unsure=unsure) for unsure in (False, True)]
            cells = [f"{pair[0]:.3f} of {pair[1]}" if pair else DASH for pair in both]
            yield f"| {task.task} | {task.last} | {' | '.join(cells)} |"

    def to_csv(self) -> str:
        """One line for each task, score and horizon."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        measures = ("auc", "auc_low", "auc_high", "ap", "ap_low", "ap_high", "brier", "ece")
        writer.writerow(("task", "score", "horizon", "count", "positives", *measures, "steps"))
        for task in self.tasks:
            for name, cells in task.cells.items():
                for h, cell in cells.items():
                    calibration = task.calibration(name, h) or ("", "")
                    steps = round(task.steps[name])
                    writer.writerow((task.task, name, h, *csv_fields(cell), *calibration, steps))
        return text.getvalue()

    def reliability_csv(self) -> str:
        """One line for each bin of the reliability plot."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("task", "score", "horizon", "predicted", "happened", "states"))
        for task in self.tasks:
            for name in task.cells:
                found = None
                if name not in NO_PROBABILITY:
                    found = task.reliability(name, task.last)
                for row in zip(*found, strict=True) if found else ():
                    writer.writerow((task.task, name, task.last, *row))
        return text.getvalue()


def _table(task: TaskForesight) -> Iterator[str]:
    """A row for each score."""
    last = task.last
    own = [task.counts[h] for h in HORIZONS]
    stay = [int(task.labels[h][task.counts[h]].sum()) for h in HORIZONS]
    shares = ", ".join(f"{n} of {int(of.sum())}" for n, of in zip(stay, own, strict=True))
    yield f"Stay captured, by horizon: {shares}. Failed: {task.missing}."
    yield ""
    yield (
        f"| | {' | '.join(map(str, HORIZONS))} | AUC, {last} | AP, {last} | Brier, {last} | "
        f"ECE, {last} | steps a state |"
    )
    yield "| --- " + "| ---: " * (len(HORIZONS) + 5) + "|"
    for name, cells in task.cells.items():
        values = [cell.value() if cell else DASH for cell in cells.values()]
        cell, calibration = cells[last], task.calibration(name, last)
        intervals = cell.intervals() if cell else (DASH, DASH)
        measures = [short(value) for value in calibration] if calibration else [DASH, DASH]
        numbers = [*values, *intervals, *measures, f"{task.steps[name]:.0f}"]
        yield f"| {NAMES[name]} | {' | '.join(numbers)} |"
