"""One comparison of a score with a label."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation.bootstrap import auc_ap, intervals, ranked
from energymargin.evaluation.labelled import Compared
from energymargin.evaluation.paper import DASH

__all__ = ["Cell", "cell_of", "csv_fields", "short"]


@dataclass(frozen=True)
class Cell:
    """One comparison of a score with a label."""

    auc: float
    ap: float
    auc_interval: tuple[float, float] | None
    """95 % bootstrap interval; None if there are not two trajectories to draw from."""
    ap_interval: tuple[float, float] | None
    count: int
    """How many states, or trajectories."""
    positives: int
    """How many of them have the label 1."""

    def value(self) -> str:
        """AUC/AP, such as ".981/.992"."""
        return f"{short(self.auc)}/{short(self.ap)}"

    def intervals(self) -> tuple[str, str]:
        """Of AUC and of AP, such as ".96-.99"; a dash if there is none."""
        return _span(self.auc_interval), _span(self.ap_interval)


def cell_of(compared: Compared, weights: NDArray[np.int64]) -> Cell | None:
    """AUC and AP, with intervals of the (draws, T) weights of the trajectories."""
    scores, labels, trajectory, _ = compared
    if not compared.of_both_kinds:
        return None
    auc, ap = auc_ap(scores, labels)
    auc_interval, ap_interval = intervals(ranked(scores), labels, trajectory, weights)
    return Cell(
        auc=auc,
        ap=ap,
        auc_interval=auc_interval,
        ap_interval=ap_interval,
        count=len(labels),
        positives=int(labels.sum()),
    )


def csv_fields(cell: Cell | None) -> list[float | str]:
    """Its columns of a CSV file, from count to ap_high; empty without a cell."""
    if cell is None:
        return [""] * 8
    return [
        *(cell.count, cell.positives),
        *(cell.auc, *(cell.auc_interval or ("", ""))),
        *(cell.ap, *(cell.ap_interval or ("", ""))),
    ]


def _span(interval: tuple[float, float] | None) -> str:
    return DASH if interval is None else f"{short(interval[0])}-{short(interval[1])}"


def short(value: float) -> str:
    """Three decimals without the leading zero: .981, 1.00."""
    return "1.00" if value >= 0.9995 else f"{value:.3f}"[1:]
