"""Measures of Ferrari and Canny (1992): which wrenches the contacts of a grasp can resist.

A contact pushes within its friction cone, whose edges are n + mu e for its inward normal n and unit
vectors e across it. The grasp wrench space is the convex hull of the wrenches of all edges and of
0: what all contacts resist whose normal forces sum to at most 1 (their L1 version). Torques are
about the centre of mass and divided by the object's largest radius, so that both halves of a wrench
are forces.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_shape, positive_number, whole_number

EDGES = 8  # of a friction cone: the measures are at least cos(pi / 8) = 92 % of the round cone's
FLAT = 1e-9  # share of the largest singular value below which the space has no extent in some way
SAME = 1e-6  # difference of wrenches that count as one


class WrenchSpace(NamedTuple):
    """How large the grasp wrench space is."""

    epsilon: float
    """Radius of the largest ball about 0 in it: the least wrench that breaks the grip, per unit of
    normal force. 0 unless the grasp is force closed."""
    volume: float
    """In six dimensions; 0 if no contact resists a wrench of some direction."""


def wrench_space(
    points: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    *,
    center: ArrayLike = (0.0, 0.0, 0.0),
    radius: float,
    edges: int = EDGES,
) -> WrenchSpace:
    """The measures of k contacts.

    Args:
        points: where they are, (k, 3) [m].
        normals: unit vectors into the object, (k, 3).
        friction: coefficients, (k,) or one for all. Points have no torsional friction: a face that
            lies on another is several points.
        center: about which torques are taken, the centre of mass [m].
        radius: of the object, its largest from there [m].
        edges: of the pyramid that stands for a friction cone, at least 3.

    Raises ValueError on shapes that do not go together, and numbers that cannot be.
    """
    from scipy.spatial import ConvexHull, QhullError

    at = np.asarray(points, dtype=float).reshape(-1, 3) - np.asarray(center, dtype=float)
    inward = np.asarray(normals, dtype=float).reshape(-1, 3)
    check_shape("normals", inward, at.shape)
    slopes = np.broadcast_to(np.asarray(friction, dtype=float), len(at))
    positive_number("radius", radius)
    whole_number("edges", edges, 3)
    forces = _edges(inward, slopes, edges)
    torques = np.cross(at[:, None], forces) / radius
    wrenches = np.concatenate([forces, torques], axis=2).reshape(-1, 6)
    rounded = np.unique(np.round(wrenches / SAME) * SAME, axis=0)
    sizes = np.linalg.svd(rounded, compute_uv=False)
    if len(sizes) < 6 or sizes[-1] <= FLAT * sizes[0]:
        return WrenchSpace(0.0, 0.0)
    try:
        hull = ConvexHull(np.concatenate([rounded, np.zeros((1, 6))]))
    except QhullError:  # as good as flat
        return WrenchSpace(0.0, 0.0)
    return WrenchSpace(max(0.0, float(-hull.equations[:, -1].max())), float(hull.volume))


def _edges(normals: Floats, slopes: Floats, edges: int) -> Floats:
    """Forces of unit normal force along the edges of each cone, (k, edges, 3)."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = np.cross(normals, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(normals, across)
    angles = np.linspace(0, 2 * np.pi, edges, endpoint=False)
    ways = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * other[:, None]
    return np.asarray(normals[:, None] + slopes[:, None, None] * ways)
