"""Convex parts that are as near to a mesh as is asked for: those that are farther off are cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold

from energymargin.model.meshes.convex import NOTHING, Decomposition, cached, corners
from energymargin.model.meshes.deviation import (
    Surface,
    corners_of,
    deviation,
    hull,
    solid_of,
    union,
)
from energymargin.model.meshes.solids import Points, Solid, triangles

MOST_PARTS = 1_000
TURNS = 8  # planes through the line from the farthest point to the mesh, of which the best one cuts
QUICK = 1_000  # samples that show most pieces to be too far off
GROWN = 1.01  # scale of a given part, over gaps between it and its neighbours
LEFT = 0.5  # share of the accuracy by which the parts may fall short of the mesh


class CutPiece(NamedTuple):
    """A piece of the mesh, whose hull is a part."""

    solid: Manifold
    distance: float
    """Of the hull from the mesh, at most [m]."""
    point: Points
    """Where it is as far as that, shape (3,)."""
    nearest: Points
    """The mesh's nearest point, shape (3,)."""


def parts_within(
    accuracy: float, parts: list[Points], bodies: Sequence[Solid], how: Decomposition
) -> list[Points]:
    """Convex parts, each (k, 3), no farther than `accuracy` [m] from bodies, cut from given ones.

    Raises ValueError if that takes more than MOST_PARTS, or more corners than how.max_points;
    TimeoutError or Cancelled at the limit.
    """

    def thinned() -> list[Points]:
        solid = solid_of(bodies)
        whole = _cut(accuracy, parts, solid, how)
        thin = [corners(part, how.max_points, LEFT * accuracy) for part in whole]
        reached = deviation(solid, thin).distance
        if reached > accuracy:
            most = max(map(len, whole))
            few = f"max_points={most} keeps all corners of each part"
            way = few if most > how.max_points else f"accuracy={1.1 * reached:.2g} is reached"
            raise ValueError(
                f"accuracy is {accuracy!r}, and {how.path} is {reached:.2g} m off; {way}"
            )
        return thin

    contents = [*triangles(bodies), *parts]
    return cached(["cut", f"{accuracy!r} {how.max_points}", *contents], thinned)


def _cut(accuracy: float, parts: list[Points], mesh: Manifold, how: Decomposition) -> list[Points]:
    """Parts, each (k, 3), of which none sticks out of the mesh by more than `accuracy` [m].

    The piece of the mesh in each given part, and what is in none, is cut in two where its hull is
    farthest off, again and again.
    """
    surface, least = Surface(mesh), NOTHING * mesh.volume()
    solids = [
        piece
        for part in parts
        for piece in (mesh ^ hull(GROWN * part + (1.0 - GROWN) * part.mean(axis=0))).decompose()
        if (piece ^ hull(part)).volume() > least
    ]
    together = union([solid.hull() for solid in solids])
    outside = Surface(together)
    rests = (mesh - together).decompose()
    left = [rest for rest in rests if outside.farthest(rest, QUICK)[0] > LEFT * accuracy]

    def measured(solids: Sequence[Manifold]) -> list[CutPiece]:
        how.limit.require(f"{how.path} was decomposed")
        large = [solid for solid in solids if solid.hull().volume() > least]
        return [_piece(solid, mesh, surface, accuracy) for solid in large]

    pieces = measured([*solids, *left])
    while (worst := max(pieces, key=lambda piece: piece.distance)).distance > accuracy:
        if len(pieces) >= MOST_PARTS:
            raise ValueError(
                f"accuracy is {accuracy!r}, for which {how.path} has more than {MOST_PARTS} convex "
                f"parts; accuracy={1.1 * worst.distance:.2g} needs fewer"
            )
        pieces.remove(worst)
        pieces += measured(_halves(worst))
    return [corners_of(piece.solid.hull()) for piece in pieces]


def _piece(solid: Manifold, mesh: Manifold, surface: Surface, accuracy: float) -> CutPiece:
    beyond = solid.hull() - mesh
    found = surface.farthest(beyond, QUICK)
    return CutPiece(solid, *(found if found[0] > accuracy else surface.farthest(beyond)))


def _halves(piece: CutPiece) -> list[Manifold]:
    """What a plane leaves of a piece, connected solids: the plane whose hulls are smallest.

    Planes go from where the hull is farthest off straight to the mesh, and through the middle.
    """
    low, high = np.reshape(piece.solid.bounding_box(), (2, 3))
    planes = [(axis, float(axis @ (low + high)) / 2.0) for axis in np.eye(3)]
    line = piece.point - piece.nearest
    across = np.linalg.svd(line[None])[2][1:]
    for turn in np.linspace(0.0, np.pi, TURNS, endpoint=False):
        normal = np.cos(turn) * across[0] + np.sin(turn) * across[1]
        planes.append((normal, float(normal @ piece.point)))
    ways = [piece.solid.split_by_plane(tuple(normal), offset) for normal, offset in planes]
    both = [way for way in ways if not (way[0].is_empty() or way[1].is_empty())]
    best = min(both, key=lambda way: way[0].hull().volume() + way[1].hull().volume())
    return [solid for side in best for solid in side.decompose()]
