"""Convex hulls with few corners: a collision costs time for each of them."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

__all__ = ["corners", "hull_volume", "inside"]

# Where no point sticks out of the thinned hull by more than this share of its size, it is the same.
SAME = 2e-3
OPTIONS = "Qt Q12"  # facets of triangles; wide ones, of rounded points, are no error


def hull_volume(points: NDArray[np.float64]) -> float:
    """Volume [m^3] of the convex hull of points, shape (n, 3); 0 if they are flat."""
    try:
        return float(ConvexHull(points, qhull_options=OPTIONS).volume)
    except (QhullError, ValueError):  # flat, or fewer than four points
        return 0.0


def inside(points: NDArray[np.float64], part: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each of the points (n, 3) lies in the convex hull of a part's, shape (n,)."""
    planes = ConvexHull(part, qhull_options=OPTIONS).equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] <= 0.0).all(axis=1))


def corners(points: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """At most `most` corners of the hull of points that span a volume, shape (k, 3).

    All corners if they are no more. Otherwise the hull grows by the corner that is farthest
    outside, until none is far: it lies within the true one.
    """
    all_corners: NDArray[np.float64] = points[
        np.sort(ConvexHull(points, qhull_options=OPTIONS).vertices)
    ]
    if len(all_corners) <= most:
        return all_corners
    chosen = _extremes(all_corners)
    hull = ConvexHull(all_corners[chosen], incremental=True, qhull_options=OPTIONS)
    size = float(np.ptp(all_corners, axis=0).max())
    while len(chosen) < most:
        outside = (all_corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        farthest = int(outside.argmax())
        if outside[farthest] <= SAME * size:
            break
        chosen.append(farthest)
        hull.add_points(all_corners[[farthest]])
    return np.asarray(all_corners[np.sort(chosen)])


def _extremes(points: NDArray[np.float64]) -> list[int]:
    """Indices of the points that are farthest out along the principal axes and between them."""
    centered = points - points.mean(axis=0)
    spreads, axes = np.linalg.svd(centered, full_matrices=False)[1:]
    along = centered @ axes.T / spreads
    directions = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], float)
    return sorted({int(i) for i in (along @ directions.T).argmax(axis=0)})
