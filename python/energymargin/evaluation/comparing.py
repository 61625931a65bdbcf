"""Compares every score with its label."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from energymargin.deprecations import once_positional
from energymargin.evaluation.bootstrap import DRAWS, bootstrap_weights
from energymargin.evaluation.cells import Cell, cell_of
from energymargin.evaluation.labelled import (
    HORIZONS,
    LAST_FRAMES,
    PROBABLE_SUCCESS,
    SUCCESS,
    Among,
    LabelledScores,
    compared_states,
    compared_trajectories,
    state_metrics,
)
from energymargin.evaluation.table import Evaluation
from energymargin.metrics import ANY
from energymargin.tasks.base import whole_number

__all__ = ["evaluate"]


@once_positional("horizons", "draws", "seed", after=1)
def evaluate(
    labelled: LabelledScores,
    *,
    horizons: Sequence[int] = HORIZONS,
    draws: int = DRAWS,
    seed: int = 0,
    last: int = LAST_FRAMES,
    among: Among = "all",
    clipped: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Compares every score with its label. States without a score are left out, and counted.

    Args:
        labelled: scores of states, with what happened.
        horizons: in frames; a state counts that has as many frames after it.
        draws: of the bootstrap; the intervals take time in proportion.
        seed: of the bootstrap.
        last: k-bar, the frames of a trajectory whose success scores count.
        among: "all" states, or only those that are "captured" now; then there is nothing to tell at
            horizon 0, and whole trajectories are not compared.
        clipped: a horizon ends with its trajectory, so that every state counts.
        progress: progress(done, total) counts the cells of the table: with 20,000 states, each
            takes half a second.

    Raises ValueError on numbers out of range, and on `clipped` of scores with a clock.
    """
    whole_number("draws", draws, 1)
    whole_number("last", last, 1)
    for horizon in horizons:
        whole_number("horizon", horizon, 0)
    if among == "captured":
        horizons = [horizon for horizon in horizons if horizon > 0]
    weights = bootstrap_weights(len(labelled.by_trajectory()), draws, seed)
    states: dict[str, dict[int, Cell | None]] = {m: {} for m in state_metrics(labelled)}
    cells = [(metric, horizon) for metric in states for horizon in horizons]
    for done, (metric, horizon) in enumerate(cells):
        if progress is not None:
            progress(done, len(cells))
        compared = compared_states(labelled, metric, horizon, among=among, clipped=clipped)
        states[metric][horizon] = cell_of(compared, weights)
    missing = np.any([np.isnan(values) for values in labelled.scores.values()], axis=0)
    of_all = among == "all"
    return Evaluation(
        task=labelled.task,
        horizons=tuple(horizons),
        states=states,
        success=_success_cell(labelled, SUCCESS, weights, last) if of_all else None,
        missing=int(missing.sum()),
        success_any=_success_cell(labelled, SUCCESS + ANY, weights, last) if of_all else None,
        last=last,
        probable_success=(
            _success_cell(labelled, PROBABLE_SUCCESS, weights, last) if of_all else None
        ),
        asks=labelled.asks,
        search=labelled.search,
        among=among,
        clipped=clipped,
    )


def _success_cell(
    labelled: LabelledScores, metric: str, weights: NDArray[np.int64], last: int
) -> Cell | None:
    if metric not in labelled.scores:
        return None
    return cell_of(compared_trajectories(labelled, metric, last), weights)
