"""Sets of states as solids: where the objects may be, the state otherwise unchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, cast

import numpy as np
from fast_simplification import simplify
from skimage.measure import marching_cubes

import energymargin as em
from energymargin.base.aliases import Floats, Ints, Mask
from energymargin.look.outlines import AXES, object_centers, seen_corners
from energymargin.look.plots.scenes import inside_at

# Room around what is seen, as a share of its longest side.
LEVEL_NORMAL = 0.99  # upward part of the normal of a plane that counts as level
AROUND_STATES = 0.08
AROUND_ONE = 0.6  # of a single state: its motion is not known
LEVEL = 0.02  # of the view's size: an object that rises by less stays on the ground

# Cells along the longest side of the grid, and how far it reaches beyond the view, as a share of
# the view's size. A slab may reach far; the camera has to stay outside of a solid.
CELLS, AROUND = 60, 0.03
FLAT_CELLS, FLAT_AROUND = 320, 0.4
FLAT = 0.002  # height of a slab, as a share of the view's size
MOST_TRIANGLES = 3000  # a flat surface needs few, and browsers without a graphics card are slow
HALVINGS = 6  # of a cell, until the border is found


class Surface(NamedTuple):
    """A closed surface of triangles, seen from outside against the clock."""

    points: Floats
    """Corners [m], shape (N, 3)."""
    faces: Ints
    """Three corners each, shape (F, 3)."""


class View(NamedTuple):
    """A box [m] that holds what matters."""

    low: Floats
    high: Floats
    floor: float
    """Height of the ground, or of the lowest point if there is none."""

    @property
    def size(self) -> float:
        """Its longest side [m]."""
        return float((self.high - self.low).max())

    @property
    def center(self) -> Floats:
        """Its middle."""
        return np.asarray((self.low + self.high) / 2)


def view_around(scene: em.Scene, states: Iterable[Floats]) -> View:
    """A view of objects and effector in these states."""
    states = list(states)
    points = seen_corners(scene, states, AXES)
    low, high = points.min(axis=0), points.max(axis=0)
    share = AROUND_STATES if len(states) > 1 else AROUND_ONE
    around = share * float((high - low).max())
    grounds = [shape for body in scene.bodies if isinstance(shape := body.shape, em.Plane)]
    level = [plane.offset for plane in grounds if plane.normal[2] > LEVEL_NORMAL]
    return View(low - around, high + around, max(level, default=float(low[2])))


def is_flat(problem: em.Problem, states: Floats, view: View) -> bool:
    """Whether no object is lifted or tipped: neither in these states, shape (K, n), nor by the
    disturbance."""
    if problem.force[2] != 0.0 or np.any(problem.torque[:2] != 0.0):
        return False
    heights = object_centers(problem.scene, states, "z")
    return bool(np.all(np.ptp(heights, axis=0) < LEVEL * view.size))


def region_surface(
    problem: em.Problem,
    region: em.regions.Region,
    view: View,
    *,
    flat: bool = False,
    layer: int = 0,
) -> Surface | None:
    """The surface of a set in and around the view; None if it is empty there, or all of
    it.

    flat: a slab on the ground, of the places at the objects' own height. layer: slabs of others lie
    above each other, and solids of others do not end at the same walls. If each of several objects
    has its own set, the region is that of at least one.
    """
    seen = AXES[:2] if flat else AXES

    def contains(points: Floats) -> Mask:
        """Whether it is in the set with the objects' centres at each of the points, (N, 3)."""
        return inside_at(problem, region, points[:, : len(seen)], seen)

    cells, share = (FLAT_CELLS, FLAT_AROUND) if flat else (CELLS, (1 + layer) * AROUND)
    around = share * view.size
    cell = (view.size + 2 * around) / cells
    ends = zip(view.low - around, view.high + around, strict=True)
    axes = [np.arange(low, high + cell, cell) for low, high in ends]
    size = np.full(3, cell)
    if flat:
        size[2] = FLAT * view.size
        axes[2] = np.array([view.floor + 2 * layer * size[2]])
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = np.repeat(contains(grid.reshape(-1, 3)).reshape(grid.shape[:3]), 1 + flat, axis=2)
    return _surface(inside, contains, grid[0, 0, 0], size, sides=2 if flat else 3)


def _surface(
    inside: Mask, contains: Callable[[Floats], Mask], start: Floats, cell: Floats, sides: int
) -> Surface | None:
    """Surface of the cells that are inside, closed one cell beyond the grid's ends; its border is
    looked for along the first so many axes."""
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
    if len(faces) > MOST_TRIANGLES:
        mesh = vertices.astype(np.float32), faces.astype(np.int32)
        vertices, faces = cast(Any, simplify)(*mesh, target_count=MOST_TRIANGLES)
    return Surface(vertices, faces[:, ::-1])
