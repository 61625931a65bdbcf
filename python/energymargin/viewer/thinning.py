"""Which nodes and edges of a large tree are drawn: what falls on the same spot is drawn once.

A million dots on a thousand spots look like a thousand dots, and are a thousand times slower.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_EDGES", "MOST_POINTS", "shown_edges", "shown_points"]

MOST_POINTS, MOST_EDGES = 20_000, 8_000  # what a browser without a graphics card still moves
SPOTS = (500, 350, 250, 175, 125)  # along the view's longest side; the coarsest is a dot's size


def shown_points(
    points: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """Rows of points, shape (N, 3), that are drawn: of those of one kind, shape (N,), on a spot the
    one that comes first in `order`, shape (N,); and at most MOST_POINTS. size: of the view [m]."""
    return _one_a_spot(points, kinds, order, size, MOST_POINTS)


def shown_edges(
    edges: NDArray[np.float64], kinds: NDArray[np.bool_], order: NDArray[np.float64], size: float
) -> NDArray[np.int64]:
    """As `shown_points`, of edges from spot to spot, shape (N, 2, 3); at most MOST_EDGES."""
    return _one_a_spot(edges.reshape(-1, 6), kinds, order, size, MOST_EDGES)


def _one_a_spot(
    values: NDArray[np.float64],
    kinds: NDArray[np.bool_],
    order: NDArray[np.float64],
    size: float,
    most: int,
) -> NDArray[np.int64]:
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
