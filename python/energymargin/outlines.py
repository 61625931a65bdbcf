"""Bodies as outlines in a plane: where their corners are, and what a view has to show.

A plane is named by its two axes, such as ("x", "z"); it is looked at along the third.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Scene, Sphere

__all__ = [
    "Limits",
    "Plan",
    "Pose",
    "axis_numbers",
    "body_poses",
    "placed",
    "shape_corners",
    "shape_parts",
    "view_of",
]

AROUND = 0.1  # of the view's longer side, around what moves
ROUND = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)  # rad, corners of a circle

Limits = tuple[tuple[float, float], tuple[float, float]]  # of the plane's two axes [m]
Plan = tuple[str, str]  # the axes of a picture's plane, such as ("x", "z")
Pose = tuple[NDArray[np.float64], NDArray[np.float64]]  # position, quaternion


def placed(points: NDArray[np.float64], pose: Pose, plane: Plan) -> NDArray[np.float64]:
    """Points (N, 3) of a body as they are seen in the plane, shape (N, 2)."""
    position, orientation = pose
    turned = Rotation.from_quat(orientation).apply(points)
    return np.asarray((turned + np.asarray(position))[:, axis_numbers(plane)])


def shape_parts(shape: Any) -> list[NDArray[np.float64]]:
    """The corners of each convex part of a shape, in the shape's frame; arrays (N, 3)."""
    if not isinstance(shape, Compound):
        return [shape_corners(shape)]
    return [
        Rotation.from_quat(part.orientation).apply(shape_corners(part.shape)) + part.position
        for part in shape.parts
    ]


def shape_corners(shape: Any) -> NDArray[np.float64]:
    """Points whose convex hull is the shape, or nearly so if it is round; shape (N, 3)."""
    circle = np.stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND], axis=1)
    if isinstance(shape, Box):
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        return np.asarray(signs * np.asarray(shape.size) / 2)
    if isinstance(shape, ConvexHull):
        return np.asarray(shape.points)
    if isinstance(shape, Cylinder):
        end = np.array([0.0, 0.0, shape.length / 2])
        return np.concatenate([shape.radius * circle + end, shape.radius * circle - end])
    latitudes = np.linspace(-np.pi / 2, np.pi / 2, 13)
    ball = np.concatenate([circle * np.cos(a) + [0.0, 0.0, np.sin(a)] for a in latitudes])
    if isinstance(shape, Sphere):
        return np.asarray(shape.radius * ball)
    if isinstance(shape, Capsule):
        end = np.array([0.0, 0.0, shape.length / 2])
        return np.concatenate([shape.radius * ball + end, shape.radius * ball - end])
    raise TypeError(f"a {type(shape).__name__} cannot be drawn")


def body_poses(scene: Scene, state: NDArray[np.float64]) -> dict[str, Pose]:
    """Of all bodies, in a state."""
    moving = scene.unpack(state)
    return {
        body.name: (body.position, body.orientation)
        if body.fixed
        else (moving[body.name]["position"], moving[body.name]["orientation"])
        for body in scene.bodies
    }


def axis_numbers(plane: Plan) -> list[int]:
    """Which of x, y and z the plane's axes are, as numbers from 0."""
    return ["xyz".index(axis) for axis in plane]


def view_of(scene: Scene, states: NDArray[np.float64], plane: Plan) -> Limits:
    """A view of all that moves in these states, shape (N, n), and a little around it."""
    shown = [body for body in scene.bodies if body.role != "none"]
    points = np.concatenate(
        [
            placed(part, poses[body.name], plane)
            for poses in (body_poses(scene, state) for state in states)
            for body in shown
            for part in shape_parts(body.shape)
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    around = AROUND * float((high - low).max())
    (x0, y0), (x1, y1) = low - around, high + around
    return (float(x0), float(x1)), (float(y0), float(y1))
