"""How far our scores agree with the authors', state by state: rank correlations and means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from energymargin.base.table_text import DASH, markdown_table

__all__ = ["AGAIN", "DEFINED", "agreement", "agreement_table"]

DEFINED = "capture/defined"
"""Our capture score by the paper's definition: the set of the labels, where it was recorded."""
AGAIN = "capture/again"
"""The score "capture" with another seed."""

# By ours, theirs. An effort that they did not find is inf, or in grasp this [J].
PAIRS = {
    "capture": "capture",
    DEFINED: "capture",
    "effort/est": "effort/est",
    "effort/rrt": "effort/rrt",
}
NOT_FOUND = 100.0

HEAD = (
    *("", "states", "rank correlation, all", "captured now"),
    *("of two seeds, all", "captured now", "mean, theirs", "ours"),
)

Scores = Mapping[str, NDArray[np.float64]]
Sides = tuple[NDArray[np.float64], ...]
"""Theirs, ours, and ours of another seed: one value a state, NaN where one side has none."""


def agreement(
    name: str, theirs: Scores, ours: Scores, captured: NDArray[np.bool_]
) -> list[list[str]]:
    """The rows of a part; scores have one value a state, NaN where there is none."""
    pairs = _pairs(theirs, ours)
    return [_row(f"{name} {own}", sides, captured) for own, sides in pairs]


def agreement_table(rows: list[list[str]]) -> str:
    """All parts, as Markdown."""
    return markdown_table(list(HEAD), rows)


def _pairs(theirs: Scores, ours: Scores) -> Iterator[tuple[str, Sides]]:
    for own, other in PAIRS.items():
        if own not in ours or other not in theirs:
            continue
        a, b = theirs[other], ours[own]
        again = ours[AGAIN] if own == "capture" and AGAIN in ours else np.full(len(b), np.nan)
        there = np.isfinite(a) & np.isfinite(b) & ((a < NOT_FOUND) | (other == "capture"))
        yield own, tuple(np.where(there, side, np.nan) for side in (a, b, again))


def _row(name: str, sides: Sides, captured: NDArray[np.bool_]) -> list[str]:
    theirs, ours, again = sides
    there = np.isfinite(ours)
    return [
        name,
        str(there.sum()),
        *(_rank(theirs[among], ours[among]) for among in (there, there & captured)),
        *(_rank(again[among], ours[among]) for among in (there, there & captured)),
        *(f"{np.mean(side[there]):.3g}" if there.any() else DASH for side in (theirs, ours)),
    ]


def _rank(a: NDArray[np.float64], b: NDArray[np.float64]) -> str:
    """Spearman's correlation; a dash where it says nothing."""
    from scipy import stats

    if len(a) < 3 or not np.isfinite(a).all() or np.ptp(a) == 0 or np.ptp(b) == 0:
        return DASH
    return f"{stats.spearmanr(a, b).statistic:.2f}"
