"""AUC and AP of scores, without their intervals, at the horizon that stands for all."""

from __future__ import annotations

from energymargin.evaluation import HORIZON, SUCCESS, Cell, LabelledScores, evaluate

__all__ = ["quality"]


def quality(labelled: LabelledScores) -> dict[str, tuple[float, float]]:
    """AUC and AP by metric, of those whose label is not the same everywhere.

    Capture and force are held against "captured over the next HORIZON frames", the trajectory's
    score against its success.
    """
    result = evaluate(labelled, horizons=(HORIZON,), draws=1)  # the intervals are not looked at
    cells: dict[str, Cell | None] = {m: own[HORIZON] for m, own in result.states.items()}
    cells[SUCCESS] = result.success
    return {metric: (cell.auc, cell.ap) for metric, cell in cells.items() if cell is not None}
