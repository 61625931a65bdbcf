"""What was told of questions, against what happened: AUC with an interval, and calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation.bootstrap import auc_ap, bootstrap_weights, intervals, ranked
from energymargin.table_text import markdown_table
from energymargin_paper.evidence.calibration import calibration_error, reliability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_told", "gathered", "told_table"]

DRAWS = 2000  # of the bootstrap, over questions


def gathered(found: dict[str, Any], name: str) -> NDArray[np.float64]:
    """A number of each question, shape (N,)."""
    return np.array([one[name] for one in found.values()], dtype=float)


def told_table(found: dict[str, Any], names: Sequence[str]) -> str:
    """A row for each probability of the questions: "stays" is what happened."""
    header = ["probability with", "questions", "told", "happened", "AUC", "calibration error"]
    stays = gathered(found, "stays")
    rows = [_row(name, gathered(found, name), stays) for name in names]
    return markdown_table(header, rows)


def _row(name: str, told: NDArray[np.float64], stays: NDArray[np.float64]) -> list[str]:
    counts = [name, str(len(stays)), f"{told.mean():.2f}", f"{stays.mean():.2f}"]
    if len(np.unique(stays)) < 2:
        return [*counts, "-", "-"]
    label, places = stays.astype(bool), np.arange(len(stays))
    weights = bootstrap_weights(len(stays), DRAWS, 0)
    low, high = intervals(ranked(told), label, places, weights)[0] or (np.nan, np.nan)
    auc = auc_ap(told, label)[0]
    return [*counts, f"**{auc:.3f}** {low:.3f} to {high:.3f}", _calibration(told, stays)]


def _calibration(told: NDArray[np.float64], stays: NDArray[np.float64]) -> str:
    """With what a perfectly calibrated probability would have with so few questions, in the mean
    of draws: an error is never zero."""
    random = np.random.default_rng(0)
    perfect = [
        calibration_error(told, (random.random(len(told)) < told).astype(float)) for _ in range(200)
    ]
    error = calibration_error(told, stays)
    return f"**{error:.3f}** ({np.mean(perfect):.3f} if perfect)"


def draw_told(ax: Axes, found: dict[str, Any], names: Sequence[str]) -> None:
    """What happened over what was told, in bins."""
    stays = gathered(found, "stays")
    for name in names:
        bins = reliability(gathered(found, name), stays)
        ax.plot(bins.predicted, bins.happened, "o-", ms=3, label=name)
    ax.plot([0, 1], [0, 1], color="black", lw=0.8, ls=":")
    ax.set(xlabel="probability told", ylabel="share that stayed")
    ax.legend(fontsize=7, frameon=False)
