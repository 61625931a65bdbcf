"""A set of states as a solid: the places of the objects for which the state, else unchanged, is in
it.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from fast_simplification import simplify
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from skimage.measure import marching_cubes

from energymargin._core import Problem
from energymargin.regions import Region
from energymargin.viewer.solids import Triangles
from energymargin.viewer.views import View, object_places

__all__ = ["region_surface"]

# Along the longest side, and how far around the view, beside its size: a slab may reach far, but
# whoever looks should stand outside of a solid.
CELLS, AROUND = 60, 0.03
FLAT_CELLS, FLAT_AROUND = 320, 0.4
FLAT = 0.002  # height of a slab beside the view's size
MOST = 3000  # triangles: a flat one needs few, and browsers without a graphics card are slow
SMOOTH = 0.8  # cells; more would round the corners away


def region_surface(
    problem: Problem, region: Region, view: View, *, flat: bool = False, layer: int = 0
) -> Triangles | None:
    """The surface of a set in and around the view; None if it is empty there, or all of it.

    flat: a slab on the ground, of the places at the objects' own height. layer: slabs of others lie
    above each other, and solids of others do not end at the same walls.
    """
    if flat:
        return _slab(problem, region, view, layer)
    axes, cell = _axes(view, CELLS, (1 + layer) * AROUND)
    inside = _contains(problem, region, axes)
    return _surface(inside, np.array([axis[0] for axis in axes]), np.full(3, cell))


def _slab(problem: Problem, region: Region, view: View, layer: int) -> Triangles | None:
    (x, y, _), cell = _axes(view, FLAT_CELLS, FLAT_AROUND)
    heights = problem.state[object_places(problem.scene)[0]][2:]
    inside = _contains(problem, region, [x, y, heights])
    layers = np.repeat(inside, 2, axis=2)
    thickness = FLAT * view.size
    start = np.array([x[0], y[0], view.floor + 2 * layer * thickness])
    return _surface(layers, start, np.array([cell, cell, thickness]))


def _axes(view: View, cells: int, share: float) -> tuple[list[NDArray[np.float64]], float]:
    """A grid in and around the view along x, y and z, and the size of its cells [m]."""
    around = share * view.size
    cell = (view.size + 2 * around) / cells
    ends = zip(view.low - around, view.high + around, strict=True)
    return [np.arange(low, high + cell, cell) for low, high in ends], cell


def _contains(
    problem: Problem, region: Region, axes: list[NDArray[np.float64]]
) -> NDArray[np.bool_]:
    """Whether it is in the set with the objects' centres at each place of a grid, shape (X, Y, Z).

    If each of several objects has its own set, the region is that of at least one.
    """
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    states = np.tile(problem.state, (grid[..., 0].size, 1))
    for place in object_places(problem.scene):
        states[:, place] = grid.reshape(-1, 3)
    return np.asarray(region.contains(problem.scene, states)).reshape(grid.shape[:3])


def _surface(
    inside: NDArray[np.bool_], start: NDArray[np.float64], cell: NDArray[np.float64]
) -> Triangles | None:
    """Of the cells that are inside; closed at the grid's ends."""
    if inside.all() or not inside.any():
        return None
    field = np.pad(inside, 1).astype(np.float32)
    smooth = [SMOOTH if count > 2 else 0.0 for count in inside.shape]  # a slab stays flat
    field = gaussian_filter(field, smooth)
    if field.max() <= 0.5:  # a speck: smoothed away, so it is shown as it is
        field = np.pad(inside, 1).astype(np.float32)
    vertices, faces, _, _ = cast(Any, marching_cubes)(field, 0.5, spacing=tuple(cell))
    if len(faces) > MOST:
        vertices, faces = cast(Any, simplify)(vertices, faces, target_count=MOST)
    return Triangles(vertices + start - cell, faces[:, ::-1].astype(np.int64))
