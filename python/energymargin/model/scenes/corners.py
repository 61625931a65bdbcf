"""Corners of shapes: points whose convex hulls are their parts, or nearly so."""

from __future__ import annotations

from typing import Any

import numpy as np

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Sphere
from energymargin.base.aliases import Floats
from energymargin.model.scenes.poses import pose

ROUND = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)  # rad, corners of a circle
CIRCLE = np.stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND], axis=1)
LATITUDES = np.linspace(-np.pi / 2, np.pi / 2, 13)
BALL = np.concatenate([CIRCLE * np.cos(a) + [0.0, 0.0, np.sin(a)] for a in LATITUDES])
SIGNS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T


def shape_parts(shape: Any) -> list[Floats]:
    """The corners of each convex part of a shape, in the shape's frame; arrays (N, 3)."""
    if not isinstance(shape, Compound):
        return [shape_corners(shape)]
    placed = [(part.shape, pose(part.position, part.orientation)) for part in shape.parts]
    return [shape_corners(solid) @ at[:3, :3].T + at[:3, 3] for solid, at in placed]


def shape_corners(shape: Any) -> Floats:
    """Points whose convex hull is the shape, or nearly so if it is round; shape (N, 3)."""
    if isinstance(shape, Box):
        return np.asarray(SIGNS * np.asarray(shape.size) / 2)
    if isinstance(shape, ConvexHull):
        return np.asarray(shape.points)
    if isinstance(shape, Sphere):
        return np.asarray(shape.radius * BALL)
    if isinstance(shape, (Cylinder, Capsule)):
        around = shape.radius * (CIRCLE if isinstance(shape, Cylinder) else BALL)
        end = np.array([0.0, 0.0, shape.length / 2])
        return np.concatenate([around + end, around - end])
    raise TypeError(f"a {type(shape).__name__} cannot be drawn")
