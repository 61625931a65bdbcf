"""One comparison of a score with a label, and what the paper reports to be seen beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation.bootstrap import auc_ap, intervals, ranked
from energymargin.evaluation.labelled import Compared
from energymargin.shares import short

__all__ = ["DASH", "PAPER", "Cell", "cell_of", "csv_fields", "paper_text"]

DASH = "—"

# AUC and AP of the paper's Table I.
PAPER: dict[str, dict[str, tuple[float, float]]] = {
    "push": {
        "capture": (0.97, 0.99),
        "effort/est": (0.92, 0.98),
        "effort/rrt": (0.92, 0.99),
        "force": (0.86, 0.95),
        "success": (0.98, 0.98),
    },
    "balance": {
        "capture": (0.98, 0.99),
        "effort/est": (0.93, 0.98),
        "effort/rrt": (0.94, 0.98),
        "force": (0.94, 0.96),
        "success": (0.93, 0.95),
    },
    "topple": {
        "capture": (0.94, 0.93),
        "effort/est": (0.93, 0.91),
        "effort/rrt": (0.93, 0.92),
        "force": (0.77, 0.62),
        "success": (0.89, 0.92),
    },
    "grasp": {
        "capture": (1.00, 1.00),
        "effort/est": (0.99, 0.99),
        "effort/rrt": (0.97, 0.99),
        "force": (0.73, 0.88),
        "success": (0.99, 0.99),
    },
}


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


def paper_text(value: tuple[float, float] | None) -> str:
    """AUC/AP as it is shown; a dash for None."""
    return DASH if value is None else "/".join(short(one, decimals=2) for one in value)
