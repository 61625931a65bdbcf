"""Compares every score with its label."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation.bootstrap import DRAWS, bootstrap_weights
from energymargin.evaluation.cells import Cell, cell_of
from energymargin.evaluation.labelled import (
    HORIZONS,
    LAST_FRAMES,
    PROBABLE_SUCCESS,
    SUCCESS,
    LabelledScores,
    compared_states,
    compared_trajectories,
    state_metrics,
)
from energymargin.evaluation.table import Evaluation
from energymargin.metrics import ANY

__all__ = ["evaluate"]


def evaluate(
    labelled: LabelledScores,
    horizons: Sequence[int] = HORIZONS,
    draws: int = DRAWS,
    seed: int = 0,
    *,
    last: int = LAST_FRAMES,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Compares every score with its label. States without a score are left out, and counted.

    `last`: k-bar, the frames of a trajectory whose success scores count. `progress(done, total)`
    counts the cells of the states: with 20,000 of these, each takes half a second.
    """
    weights = bootstrap_weights(len(labelled.by_trajectory()), draws, seed)
    states: dict[str, dict[int, Cell | None]] = {m: {} for m in state_metrics(labelled)}
    cells = [(metric, horizon) for metric in states for horizon in horizons]
    for done, (metric, horizon) in enumerate(cells):
        if progress is not None:
            progress(done, len(cells))
        states[metric][horizon] = cell_of(compared_states(labelled, metric, horizon), weights)
    missing = np.any([np.isnan(values) for values in labelled.scores.values()], axis=0)
    return Evaluation(
        task=labelled.task,
        horizons=tuple(horizons),
        states=states,
        success=_success_cell(labelled, SUCCESS, weights, last),
        missing=int(missing.sum()),
        success_any=_success_cell(labelled, SUCCESS + ANY, weights, last),
        last=last,
        probable_success=_success_cell(labelled, PROBABLE_SUCCESS, weights, last),
        asks=labelled.asks,
    )


def _success_cell(
    labelled: LabelledScores, metric: str, weights: NDArray[np.int64], last: int
) -> Cell | None:
    if metric not in labelled.scores:
        return None
    return cell_of(compared_trajectories(labelled, metric, last), weights)
