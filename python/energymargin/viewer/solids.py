"""Triangle meshes: of shapes, and of a set of states as a solid.

A set's solid is the places of the objects for which the state, else unchanged, is in it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
import trimesh
from fast_simplification import simplify
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Problem, Sphere
from energymargin.regions import Region
from energymargin.viewer.views import View, object_places

__all__ = ["Triangles", "region_surface", "shape_triangles"]

# Along the longest side, and how far around the view, beside its size: a slab may reach far, but
# whoever looks should stand outside of a solid.
CELLS, AROUND = 60, 0.03
FLAT_CELLS, FLAT_AROUND = 320, 0.4
FLAT = 0.002  # height of a slab beside the view's size
MOST = 3000  # triangles: a flat one needs few, and browsers without a graphics card are slow
HALVINGS = 6  # of a cell, until the border is found

Points = NDArray[np.float64]


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


def region_surface(
    problem: Problem, region: Region, view: View, *, flat: bool = False, layer: int = 0
) -> Triangles | None:
    """The surface of a set in and around the view; None if it is empty there, or all of it.

    flat: a slab on the ground, of the places at the objects' own height. layer: slabs of others lie
    above each other, and solids of others do not end at the same walls. If each of several objects
    has its own set, the region is that of at least one.
    """

    def contains(points: Points) -> NDArray[np.bool_]:
        """Whether it is in the set with the objects' centres at each of the points, (N, 3)."""
        states = np.tile(problem.state, (len(points), 1))
        for place in object_places(problem.scene):
            states[:, place] = points
        return np.asarray(region.contains(problem.scene, states))

    if flat:
        return _slab(problem, contains, view, layer)
    axes, cell = _axes(view, CELLS, (1 + layer) * AROUND)
    start = np.array([axis[0] for axis in axes])
    return _surface(_sampled(contains, axes), contains, start, np.full(3, cell))


def _slab(
    problem: Problem, contains: Callable[[Points], NDArray[np.bool_]], view: View, layer: int
) -> Triangles | None:
    (x, y, _), cell = _axes(view, FLAT_CELLS, FLAT_AROUND)
    height = problem.state[object_places(problem.scene)[0][2]]
    layers = np.repeat(_sampled(contains, [x, y, np.array([height])]), 2, axis=2)
    thickness = FLAT * view.size
    start = np.array([x[0], y[0], view.floor + 2 * layer * thickness])

    def below(points: Points) -> NDArray[np.bool_]:
        return contains(np.column_stack([points[:, :2], np.full(len(points), height)]))

    return _surface(layers, below, start, np.array([cell, cell, thickness]), sides=2)


def _axes(view: View, cells: int, share: float) -> tuple[list[NDArray[np.float64]], float]:
    """A grid in and around the view along x, y and z, and the size of its cells [m]."""
    around = share * view.size
    cell = (view.size + 2 * around) / cells
    ends = zip(view.low - around, view.high + around, strict=True)
    return [np.arange(low, high + cell, cell) for low, high in ends], cell


def _sampled(
    contains: Callable[[Points], NDArray[np.bool_]], axes: list[NDArray[np.float64]]
) -> NDArray[np.bool_]:
    """On a grid, shape (X, Y, Z)."""
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return contains(grid.reshape(-1, 3)).reshape(grid.shape[:3])


def _surface(
    inside: NDArray[np.bool_],
    contains: Callable[[Points], NDArray[np.bool_]],
    start: NDArray[np.float64],
    cell: NDArray[np.float64],
    sides: int = 3,
) -> Triangles | None:
    """Of the cells that are inside, closed one cell beyond the grid's ends; its border is looked
    for along the first so many axes."""
    if inside.all() or not inside.any():
        return None
    padded = np.pad(inside, 1)
    corners, faces, _, _ = cast(Any, marching_cubes)(padded.astype(np.float32), 0.5)
    axis = np.argmin(np.abs(corners % 1 - 0.5), axis=1)  # of the grid's edge that it halves
    low = np.floor(corners).astype(np.int64)
    step = np.eye(3)[axis]
    within = np.where(padded[tuple(low.T)], 0.0, 1.0)  # shares of the edge
    beyond, refined = 1.0 - within, axis < sides
    for _ in range(HALVINGS):
        middle = (within + beyond) / 2
        points = start + (low + middle[:, None] * step - 1) * cell
        found = np.zeros(len(points), bool)
        found[refined] = contains(points[refined])
        within, beyond = np.where(found, middle, within), np.where(found, beyond, middle)
    share = np.where(refined, (within + beyond) / 2, 0.5)
    vertices = start + (low + share[:, None] * step - 1) * cell
    if len(faces) > MOST:
        vertices, faces = cast(Any, simplify)(
            vertices.astype(np.float32), faces.astype(np.int32), target_count=MOST
        )
    return Triangles(np.asarray(vertices, float), faces[:, ::-1].astype(np.int64))
