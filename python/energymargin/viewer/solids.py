"""Shapes as triangle meshes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Sphere

__all__ = ["Triangles", "shape_triangles"]


class Triangles(NamedTuple):
    """A closed surface; the triangles' corners run counterclockwise seen from outside."""

    vertices: NDArray[np.float64]
    """Shape (N, 3) [m]."""
    faces: NDArray[np.int64]
    """Rows of `vertices`, shape (M, 3)."""


def shape_triangles(shape: Any) -> Triangles:
    """The surface of a shape in its own frame; of a compound those of all parts.

    Raises TypeError for a Plane, which has no end.
    """
    if isinstance(shape, Compound):
        return _together([_moved(shape_triangles(part.shape), part) for part in shape.parts])
    mesh = _mesh(shape)
    return Triangles(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces))


def _mesh(shape: Any) -> Any:
    if isinstance(shape, Box):
        return trimesh.creation.box(extents=shape.size)
    if isinstance(shape, ConvexHull):
        return trimesh.convex.convex_hull(shape.points)
    if isinstance(shape, Cylinder):
        return trimesh.creation.cylinder(radius=shape.radius, height=shape.length, sections=48)
    if isinstance(shape, Capsule):
        # trimesh's begins at the origin in older versions: put in the middle here.
        mesh = trimesh.creation.capsule(radius=shape.radius, height=shape.length, count=(24, 24))
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
        return mesh
    if isinstance(shape, Sphere):
        return trimesh.creation.icosphere(subdivisions=3, radius=shape.radius)
    raise TypeError(f"a {type(shape).__name__} has no surface of its own")


def _moved(triangles: Triangles, part: Any) -> Triangles:
    turned = Rotation.from_quat(part.orientation).apply(triangles.vertices)
    return Triangles(turned + part.position, triangles.faces)


def _together(parts: list[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return Triangles(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]),
    )
