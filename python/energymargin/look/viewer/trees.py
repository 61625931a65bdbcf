"""A search tree as dots and edges, so many that a browser without a graphics card turns them.

A thousand nodes on one spot look like one dot: the cheapest is drawn.
"""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

import energymargin as em
from energymargin.look.outlines import object_centers
from energymargin.look.plots.styles import COSTS
from energymargin.look.viewer.search import Scored

Floats = NDArray[np.float64]

DOT = 0.014  # of the view's size
MOST_POINTS, MOST_EDGES = 20_000, 8_000
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


def dots(problem: em.Problem, scored: Scored, size: float) -> dict[str, Any]:
    """The nodes in the order of the search, coloured by cost, at most MOST_POINTS. size: of the
    view [m]."""
    tree = scored.tree
    centers = object_centers(problem.scene, tree.states).swapaxes(0, 1)
    points, costs = centers.reshape(-1, 3), np.tile(tree.costs, len(centers))
    outside = scored.lost.T.ravel()
    numbers = np.tile(np.arange(len(tree)), len(centers))
    drawn = in_order(one_a_spot(points, outside, costs, size, MOST_POINTS), numbers)
    shares = np.clip(costs[drawn] / max(scored.most, 1e-12), 0.0, 1.0)
    return {
        "points": points[drawn],
        "colors": matplotlib.colormaps[COSTS](shares, bytes=True)[:, :3],
        "outside": outside[drawn],
        "numbers": numbers[drawn],
    }


def edges(problem: em.Problem, scored: Scored, size: float) -> dict[str, Any]:
    """The edges in the order of the search, at most MOST_EDGES. size: of the view [m]."""
    tree = scored.tree
    centers = object_centers(problem.scene, tree.states).swapaxes(0, 1)
    lines = np.stack([centers[:, tree.parents[1:]], centers[:, 1:]], axis=2).reshape(-1, 2, 3)
    outside, costs = scored.lost[1:].T.ravel(), np.tile(tree.costs[1:], len(centers))
    numbers = np.tile(np.arange(1, len(tree)), len(centers))
    drawn = one_a_spot(lines.reshape(-1, 6), outside, costs, size, MOST_EDGES)
    drawn = in_order(drawn, numbers)
    return {"points": lines[drawn], "outside": outside[drawn], "numbers": numbers[drawn]}


def in_order(drawn: NDArray[np.int64], numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows `drawn`, sorted by their node's number."""
    return drawn[np.argsort(numbers[drawn], kind="stable")]


def one_a_spot(
    values: Floats, kinds: NDArray[np.bool_], order: Floats, size: float, most: int
) -> NDArray[np.int64]:
    """Rows of points or edges, shape (N, D), that are drawn: of those of one kind, shape (N,), on a
    spot the one that comes first in `order`, shape (N,); and at most so many. size: of the view
    [m]."""
    first = np.argsort(order, kind="stable")
    if len(values) <= most:
        return first
    shown = first
    for spots in SPOTS:
        places = np.round(values[first] * (spots / size)).astype(np.int64)
        keys = np.column_stack([places, kinds[first]])
        shown = first[np.sort(np.unique(keys, axis=0, return_index=True)[1])]
        if len(shown) <= most:
            return shown
    return shown[:most]
