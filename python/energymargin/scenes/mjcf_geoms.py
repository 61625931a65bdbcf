"""Geoms of a MuJoCo model as solids."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Part, Sphere
from energymargin.scenes.mjcf_model import geom_name, local_pose, word
from energymargin.scenes.poses import Pose, place

__all__ = ["plane", "shape"]

ELLIPSOID_POINTS = 200
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
Solid = Box | Sphere | Cylinder | Capsule | ConvexHull


def shape(model: Any, geoms: list[tuple[int, Pose]]) -> Solid | Compound:
    """The solids of geoms, each with its body's pose in the frame of the shape."""
    placed = [
        (_solid(model, geom), at @ local_pose(model.geom_pos[geom], model.geom_quat[geom]))
        for geom, at in geoms
    ]
    if len(placed) == 1 and np.array_equal(placed[0][1], np.eye(4)):
        return placed[0][0]
    return Compound([Part(solid, **place(matrix)) for solid, matrix in placed])


def plane(model: Any, geom: int, body: Pose) -> dict[str, Any]:
    """Keywords of `Scene.add_plane`; it has no end, whatever size is drawn."""
    at = body @ local_pose(model.geom_pos[geom], model.geom_quat[geom])
    normal = at[:3, 2] / np.linalg.norm(at[:3, 2])
    return {"normal": normal, "offset": float(normal @ at[:3, 3])}


def _solid(model: Any, geom: int) -> Solid:
    kind, size = word("mjtGeom", model.geom_type[geom]), np.asarray(model.geom_size[geom], float)
    if kind == "box":
        return Box(2 * size)
    if kind == "sphere":
        return Sphere(size[0])
    if kind == "capsule":
        return Capsule(size[0], 2 * size[1])
    if kind == "cylinder":
        return Cylinder(size[0], 2 * size[1])
    if kind == "ellipsoid":
        return ConvexHull(size * _even_directions(ELLIPSOID_POINTS))
    points = _hull(model, int(model.geom_dataid[geom]))
    try:
        return ConvexHull(points)
    except ValueError as error:
        raise ValueError(f"geom {geom_name(model, geom)!r}: {error}") from error


def _even_directions(count: int) -> NDArray[np.float64]:
    """Unit vectors (count, 3) along a spiral from pole to pole."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turns, radius = GOLDEN_ANGLE * np.arange(count), np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turns), radius * np.sin(turns), z], axis=1)


def _hull(model: Any, mesh: int) -> NDArray[np.float64]:
    """The corners (n, 3) of the convex hull that MuJoCo collides, in the geom's frame."""
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    points: NDArray[np.float64] = np.asarray(model.mesh_vert[first : first + count], float)
    graph = model.mesh_graphadr[mesh]
    if graph < 0:
        return points
    corners = model.mesh_graph[graph]  # then the number of faces, and as many addresses as corners
    chosen = np.asarray(model.mesh_graph[graph + 2 + corners : graph + 2 + 2 * corners])
    return np.array(points[chosen])
