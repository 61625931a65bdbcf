"""The printed bodies of the recordings: upright prisms, from the authors' meshes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Compound, ConvexHull, Part

__all__ = ["outlines", "prism"]

SCALE = 0.1  # the authors' lengths are ten times as large
THRESHOLD = 0.1  # concavity that a part may keep; the authors' own parts are slabs of half a mm
LEAST_WIDTH = 0.004  # m; thinner parts are slivers, less than the tags' error


@cache
def outlines(folder: Path, name: str) -> tuple[NDArray[np.float64], ...]:
    """Of the convex parts of a body, such as "jaw-gripper", seen from above: corners, (N, 2) [m],
    about the tag. Slivers are left out. Errors as `em.mesh`, which needs the extra [urdf]."""
    from energymargin.meshes import mesh

    with np.errstate(divide="ignore", invalid="ignore"):  # of flat faces in the authors' meshes
        solid = mesh(folder / name / f"{name}.obj", scale=SCALE, threshold=THRESHOLD)
    found = [_hull(_corners(part)) for part in solid.parts]
    return tuple(outline for outline in found if _width(outline) >= LEAST_WIDTH)


def prism(folder: Path, name: str, height: float, less: float = 0.0) -> Compound:
    """The body of these outlines, its middle at half of the height [m]; each part is smaller by
    `less` [m] on all sides."""
    parts = []
    for whole in outlines(folder, name):
        outline = _inset(whole, less) if less else whole
        faces = [np.insert(outline, 2, z, axis=1) for z in (-height / 2, height / 2)]
        parts.append(Part(ConvexHull(np.concatenate(faces))))
    return Compound(parts)


def _corners(part: Part) -> NDArray[np.float64]:
    """Of a part of a mesh, which is where the mesh has it, seen from above, (N, 2) [m]."""
    assert isinstance(part.shape, ConvexHull)  # as all parts of a mesh are
    return np.asarray(part.shape.points)[:, :2] + np.asarray(part.position)[:2]


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners of the convex hull, counter-clockwise."""
    from scipy.spatial import ConvexHull as Hull

    return np.asarray(points[Hull(points).vertices])


def _inset(corners: NDArray[np.float64], less: float) -> NDArray[np.float64]:
    """A convex outline whose sides are moved inwards."""
    from scipy.spatial import ConvexHull as Hull
    from scipy.spatial import HalfspaceIntersection

    sides = Hull(corners).equations + np.array([0.0, 0.0, less])
    return _hull(HalfspaceIntersection(sides, corners.mean(axis=0)).intersections)


def _width(corners: NDArray[np.float64]) -> float:
    """The least distance between two parallel lines that hold a convex outline [m]."""
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return float(np.ptp(corners @ normals.T, axis=0).min())
