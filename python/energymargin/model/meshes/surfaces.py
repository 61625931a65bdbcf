"""The closed surfaces in a mesh file, however often and whichever way round it has their faces.

Where bodies touch, more than two faces meet at an edge, and are paired (manifold3d); walls that are
there twice, facing opposite ways, bound nothing. A surface whose faces are all there twice, or that
face both ways, bounds a body, and its faces are turned alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from manifold3d import Error
from numpy.typing import NDArray
from trimesh import Trimesh
from trimesh.graph import connected_component_labels
from trimesh.repair import fix_winding

from energymargin.model.meshes.deviation import manifold, mesh_of
from energymargin.model.meshes.solids import Faces, joined, merged

FLAT = 1e-9  # volume, as a share of the area to the power of 3/2


class Surfaces(NamedTuple):
    """Closed surfaces, each connected."""

    shells: list[Trimesh]
    turned: bool = False
    """Whether some faces were turned, so that the file does not say which side is inside."""


def closed_surfaces(pieces: Sequence[Trimesh]) -> Surfaces | None:
    """The surfaces of a file's objects, or of all of them together; None if there are holes."""
    own = Surfaces([shell for piece in pieces for shell in _connected(piece)])
    if _closed(own):
        return Surfaces(list(filter(_encloses, own.shells)))
    apart = [part for part in _apart(joined(pieces)) if _encloses(part) or not _is_closed(part)]
    parts = [next(filter(_closed, _readings(part)), None) for part in apart]
    found = [part for part in parts if part is not None]
    if len(found) < len(parts):
        return None
    shells = [shell for part in found for shell in part.shells]
    return Surfaces(shells, any(part.turned for part in found))


def _readings(part: Trimesh) -> Iterator[Surfaces]:
    """What the faces of a connected part may be, the likeliest first; a reading may have holes."""
    faces, twice = _distinct(part.faces)
    both = _turned(part, faces[twice])
    both = list(filter(_encloses, both)) if _closed(Surfaces(both)) else []
    yield Surfaces([*_paired(part), *both], bool(both))
    yield Surfaces(_turned(part, faces), True)
    part.fill_holes()
    yield Surfaces(_connected(part))


def _encloses(shell: Trimesh) -> bool:
    """Whether a closed surface has a volume: two triangles back to back have none."""
    corners = np.asarray(shell.triangles, float)
    volume = np.linalg.det(corners - corners[0, 0]).sum() / 6.0
    return bool(abs(volume) > FLAT * float(shell.area) ** 1.5)


def _paired(part: Trimesh) -> list[Trimesh]:
    """Connected surfaces of a part that has as many faces one way at each edge as the other way."""
    solid = manifold(part.vertices, part.faces)
    return [mesh_of(own) for own in solid.decompose()] if solid.status() == Error.NoError else []


def _distinct(faces: Faces) -> tuple[Faces, NDArray[np.bool_]]:
    """Each face once, shape (n, 3), and which of them are there as often both ways round, (n,)."""
    even = (faces < np.roll(faces, -1, axis=1)).sum(axis=1) == 2  # two ascents round the triangle
    found, inverse = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    return found, np.bincount(inverse.ravel(), weights=np.where(even, 1, -1)) == 0.0


def _turned(part: Trimesh, faces: Faces) -> list[Trimesh]:
    """Connected surfaces of some faces of a part, each with its faces turned alike."""
    surface = merged(part.vertices, faces)
    fix_winding(surface)
    return _connected(surface)


def _connected(surface: Trimesh) -> list[Trimesh]:
    """Surfaces whose faces meet at edges of two faces."""
    return list(surface.split(only_watertight=False, repair=False)) if len(surface.faces) else []


def _apart(surface: Trimesh) -> list[Trimesh]:
    """Parts that share no vertex."""
    labels = connected_component_labels(surface.edges_unique, node_count=len(surface.vertices))
    of_faces = labels[surface.faces[:, 0]]
    order = np.argsort(of_faces, kind="stable")
    starts = np.flatnonzero(np.diff(of_faces[order])) + 1
    return [merged(surface.vertices, surface.faces[rows]) for rows in np.split(order, starts)]


def _closed(surfaces: Surfaces) -> bool:
    return bool(surfaces.shells) and all(map(_is_closed, surfaces.shells))


def _is_closed(shell: Trimesh) -> bool:
    return bool(shell.is_watertight and shell.is_winding_consistent)
