"""How well scores predict: AUC and AP at one horizon, and the pushes on which the paper's figures
show them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin.datasets import Dataset
from energymargin.evaluation import Cell, LabelledScores, evaluate
from energymargin.records.datasets.generation import load_or_generate
from energymargin.records.evaluation.labelled import HORIZON, SUCCESS, captured_labels

__all__ = ["FRAMES", "TASK", "interval", "pushes", "quality"]

TASK = "push"
FRAMES = 10  # of a trajectory
CONFIDENCE = 0.95


def pushes(folder: Path, trajectories: int) -> Dataset:
    """So many pushes, seed 0, kept in the folder as push.h5.

    Raises ValueError if the file has other trajectories, and unless some states are captured over
    the next HORIZON frames and some are not, and some pushes succeed and some do not.
    """
    path = folder / f"{TASK}.h5"
    dataset = load_or_generate(path, tasks.make(TASK), trajectories, FRAMES, seed=0)
    captured = [captured_labels(t.captured, HORIZON) for t in dataset.trajectories]
    for labels in (dataset.successes.tolist(), [one for own in captured for one in own.tolist()]):
        if len(set(labels)) < 2:
            raise ValueError(
                f"trajectories is {trajectories}, expected so many that some fail and some succeed"
            )
    return dataset


def quality(labelled: LabelledScores) -> dict[str, tuple[float, float]]:
    """AUC and AP by metric, of those whose label is not the same everywhere.

    The scores of states are compared with "captured over the next HORIZON frames", the success
    score of a trajectory with its success.
    """
    result = evaluate(labelled, frames=(HORIZON,), draws=1)  # the intervals are not looked at
    cells: dict[str, Cell | None] = {m: own[HORIZON] for m, own in result.states.items()}
    cells[SUCCESS] = result.success
    return {metric: (cell.auc, cell.ap) for metric, cell in cells.items() if cell is not None}


def interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Student's 95 % interval of the mean of independent AUC or AP, within 0..1; of those that do
    not differ, the mean itself."""
    mean = float(values.mean())
    if np.ptp(values) == 0:
        return mean, mean
    from scipy.stats import t

    reach = t.ppf((1 + CONFIDENCE) / 2, len(values) - 1)
    half = float(reach * values.std(ddof=1) / math.sqrt(len(values)))
    return max(0.0, mean - half), min(1.0, mean + half)
