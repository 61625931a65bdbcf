"""AUC and AP of scores, without their intervals, at the horizon that stands for all."""

from __future__ import annotations

from energymargin.datasets import Dataset
from energymargin.evaluation import Cell, LabelledScores, evaluate
from energymargin.evaluation.labelled import HORIZON, SUCCESS, captured_labels

__all__ = ["check_labels", "quality"]


def check_labels(dataset: Dataset) -> None:
    """Raises ValueError unless some of its states are captured and some are not, and some of its
    trajectories succeed and some do not."""
    captured = [captured_labels(t.captured, HORIZON) for t in dataset.trajectories]
    for labels in (dataset.successes.tolist(), [one for own in captured for one in own.tolist()]):
        if len(set(labels)) < 2:
            raise ValueError(
                f"trajectories is {len(dataset.trajectories)}, expected so many that some fail and "
                "some succeed"
            )


def quality(labelled: LabelledScores) -> dict[str, tuple[float, float]]:
    """AUC and AP by metric, of those whose label is not the same everywhere.

    Capture and force are held against "captured over the next HORIZON frames", the trajectory's
    score against its success.
    """
    result = evaluate(labelled, horizons=(HORIZON,), draws=1)  # the intervals are not looked at
    cells: dict[str, Cell | None] = {m: own[HORIZON] for m, own in result.states.items()}
    cells[SUCCESS] = result.success
    return {metric: (cell.auc, cell.ap) for metric, cell in cells.items() if cell is not None}
