"""What each score of a task's states foresees, and whether its probabilities mean what they say."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation import Cell
from energymargin.records.evaluation.bootstrap import DRAWS, bootstrap_weights
from energymargin.records.evaluation.labelled import Compared
from energymargin.records.evaluation.table import cell_of
from energymargin_paper.evidence.calibration import (
    Reliability,
    brier,
    calibration_error,
    reliability,
)
from energymargin_paper.probabilities import FRESH, HORIZONS, LEARNED, NOMINAL, SCRIPT

__all__ = ["NAMES", "UNSURE", "TaskForesight"]

LAST = {"topple": 4}  # frames of the column with intervals; no box of topple is held for five

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


@dataclass(frozen=True, eq=False)
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
        """How reliable a probability was; None without a state, or of another score."""
        scores, labels, *_ = self.compared(name, horizon)
        if name in NO_PROBABILITY or not len(scores):
            return None
        return reliability(scores, labels.astype(float))

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
