"""How far convex parts are from the solid that they stand for.

What is in one and not in the other is an exact solid too (manifold3d); distances are sampled there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold, Mesh64, OpType
from scipy.spatial import cKDTree
from trimesh import Trimesh, proximity
from trimesh.triangles import closest_point

from energymargin.model.meshes.solids import Faces, Points, Solid

DIGITS = 4  # of a figure; more are noise
SAMPLES = 10_000  # points on a surface, or in a difference
ZOOMED = 1_000  # of them round the farthest one, where it is looked for again
ZOOMS = 3
SLABS = 8  # of a difference: their cuts have the points within it
NEAREST = 4  # triangles by their centres, among which the nearest one mostly is
ROUGH = 0.01  # share by which the centre of another one may be nearer
EXACT = 64  # of the points that seem farthest have their distance to the whole surface


@dataclass(frozen=True)
class Deviation:
    """How convex parts differ from the mesh that they stand for. Distances are sampled, to about a
    hundredth of their value."""

    distance: float
    """Largest distance [m] of a point of the mesh to the parts, or of the parts to the mesh."""
    closed_opening: float
    """Diameter [m] of the largest ball that has its centre in the parts and that the mesh has room
    for: an opening as wide may be closed, and a wider one is narrower by as much at most."""
    volume: float
    """Volume of the parts together, as a share of the mesh's."""


def deviation(solid: Manifold, parts: Sequence[Points]) -> Deviation:
    """That of parts, each (k, 3), from a solid."""
    hulls = union([hull(part) for part in parts])
    beyond = Surface(solid).farthest(hulls - solid)[0]
    short = Surface(hulls).farthest(solid - hulls)[0]
    figures = (max(beyond, short), 2.0 * beyond, hulls.volume() / solid.volume())
    return Deviation(*(float(f"{figure:.{DIGITS}g}") for figure in figures))


def union(solids: Sequence[Manifold]) -> Manifold:
    """Several solids as one."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def hull(points: Points) -> Manifold:
    """The convex hull of points, shape (n, 3)."""
    return Manifold.hull_points(points)


def solid_of(bodies: Sequence[Solid]) -> Manifold:
    """Bodies, less their cavities."""
    return union(
        [_bounded(b.outer) - union([_bounded(cavity) for cavity in b.cavities]) for b in bodies]
    )


def _bounded(surface: Trimesh) -> Manifold:
    """What a closed surface bounds, whichever way it faces."""
    faces = surface.faces if surface.volume > 0.0 else surface.faces[:, ::-1]
    return manifold(surface.vertices, faces)


def manifold(vertices: Points, faces: Faces) -> Manifold:
    """The solid of a surface; its status says if that has holes."""
    points, corners = np.array(vertices, float, order="C"), np.array(faces, np.uint64, order="C")
    return Manifold(Mesh64(points, corners))  # which takes no view that cannot be written to


def corners_of(solid: Manifold) -> Points:
    """Shape (n, 3)."""
    return np.asarray(solid.to_mesh64().vert_properties[:, :3], float)


def mesh_of(solid: Manifold) -> Trimesh:
    """The surface of a solid."""
    mesh = solid.to_mesh64()
    return Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)


class Surface:
    """The surface of a solid, to measure distances from."""

    def __init__(self, solid: Manifold) -> None:
        """Samples it."""
        self._mesh = mesh_of(solid)
        fine = solid.refine_to_length(_spacing(solid, SAMPLES)).to_mesh64()
        self._triangles = np.asarray(fine.vert_properties[:, :3], float)[fine.tri_verts]
        self._tree = cKDTree(self._triangles.mean(axis=1))

    def farthest(self, rest: Manifold, samples: int = SAMPLES) -> tuple[float, Points, Points]:
        """The largest distance [m] of a point of `rest`, which lies outside; the point and the
        nearest one of the surface, shapes (3,)."""
        distance, point, nearest = 0.0, np.zeros(3), np.zeros(3)
        for _ in range(ZOOMS):
            if rest.is_empty():
                break
            spacing = _spacing(rest, samples)
            points = _points_of(rest, spacing)
            if not len(points):
                break
            points = points[np.argsort(self._distances(points))[-EXACT:]]
            near, distances, _ = proximity.closest_point(self._mesh, points)
            best = int(distances.argmax())
            if distances[best] > distance:
                distance, point, nearest = float(distances[best]), points[best], near[best]
            rest ^= Manifold.cube((4.0 * spacing,) * 3, True).translate(tuple(point))
            samples = ZOOMED
        return distance, point, nearest

    def _distances(self, points: Points) -> Points:
        """Of points (n, 3) to the nearest triangles by their centres, shape (n,): not less than the
        true ones."""
        triangles = self._triangles[self._tree.query(points, k=NEAREST, eps=ROUGH)[1]]
        repeated = np.repeat(points, NEAREST, axis=0)
        near = closest_point(triangles.reshape(-1, 3, 3), repeated)
        distances = np.linalg.norm(near - repeated, axis=1)
        return np.asarray(distances.reshape(-1, NEAREST).min(axis=1))


def _spacing(solid: Manifold, samples: int) -> float:
    return float(np.sqrt(solid.surface_area() / samples))


def _points_of(solid: Manifold, spacing: float) -> Points:
    """Points on a solid's surface and on cuts through it, about `spacing` apart, shape (n, 3)."""
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    axis = int((high - low).argmax())
    points = []
    for i in range(1, SLABS + 1):
        height = low[axis] + (high[axis] - low[axis]) * i / SLABS
        above, below = solid.split_by_plane(tuple(np.eye(3)[axis]), height)
        points.append(corners_of(below.refine_to_length(spacing)))
        solid = above
    return np.concatenate(points)
