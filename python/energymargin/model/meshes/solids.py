"""Closed surfaces as solids: which of them bounds a body, and which a cavity in one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh import Trimesh
from trimesh.util import append_faces

from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn

Points = Floats
Faces = NDArray[np.int64]

SAME = 1e-6  # share of its size and volume by which a surface that is there twice may differ
SAMPLES = 64  # faces of a surface by which it is located
DEPTH = 1e-4  # of these samples below the surface, as a share of its size
CHUNK = 1_000_000  # solid angles at a time: some 100 MB
CAVITY_POINTS = 500  # of a cavity, that say how much of it is filled
WAY_OUT = "decompose=False takes the convex hull of it all"


@dataclass(eq=False)
class Solid:
    """A body's outer surface, which faces outwards, and those of its cavities, inwards."""

    outer: Trimesh
    cavities: list[Trimesh] = field(default_factory=list)
    buried: bool = False
    """Whether it lies, as far as samples tell, in another body."""


def triangles(bodies: Sequence[Solid]) -> list[Points]:
    """Those of each surface of bodies, shapes (n, 3, 3)."""
    surfaces = [surface for body in bodies for surface in (body.outer, *body.cavities)]
    return [np.asarray(surface.triangles, float) for surface in surfaces]


def solids(shells: list[Trimesh], path: Path, limit: Limit, *, certain: bool = True) -> list[Solid]:
    """The solids that closed surfaces bound; surfaces of a body that faces inwards are turned.

    A surface within another one bounds a cavity if the two face opposite ways, and a surface within
    a cavity a body of its own. One that faces the same way as the one around it bounds a body that
    is `buried` in that, with a warning. One that is there twice counts once.

    `certain`: whether the ways that surfaces face are the file's. Raises ValueError where they
    contradict each other or are not certain, TimeoutError or Cancelled at the limit.
    """
    around = _around(shells, path, limit)
    order = sorted(range(len(shells)), key=lambda i: len(around[i]))
    turned: dict[int, bool] = {}
    ways: dict[int, int] = {}  # 1 of a surface that faces outwards, -1 inwards, 0 of a second one
    found: dict[int, Solid] = {}
    for i in order:
        turned[i] = turned[around[i][0]] if around[i] else bool(shells[i].volume < 0)
        if turned[i]:
            shells[i].invert()
        if any(_same(shells[i], shells[j]) for j in around[i]):
            ways[i] = 0
            continue
        ways[i] = 1 if shells[i].volume > 0 else -1
        outside = sum(ways[j] for j in around[i])
        inside = outside + ways[i]
        if inside < 0 or (outside and not certain):
            raise ValueError(
                f"{path} has a closed surface of {len(shells[i].faces)} faces within another, "
                "which may bound a cavity or not; expected one that faces the other way for a "
                f"cavity, or the same way, each face once. {WAY_OUT}"
            )
        if ways[i] > 0:
            found[i] = Solid(shells[i], buried=outside > 0)
        else:
            body = max((j for j in around[i] if j in found), key=lambda j: len(around[j]))
            found[body].cavities.append(shells[i])
    _warn_of_buried(sum(body.buried for body in found.values()), path)
    return [found[i] for i in sorted(found)]


def _same(shell: Trimesh, other: Trimesh) -> bool:
    """Whether two surfaces are one that is there twice, whichever way each of them faces."""
    least = SAME * float(other.extents.max())
    return bool(
        np.abs(shell.bounds - other.bounds).max() <= least
        and abs(abs(shell.volume) - abs(other.volume)) <= SAME * abs(other.volume)
    )


def _warn_of_buried(count: int, path: Path) -> None:
    if count:
        text = f"{path.name} has {count} closed surfaces within bodies that face the same way as "
        text += "these: they are taken as inside of them. A cavity's surface faces the other way."
        warn([("buried", text)], str(path))


def _around(shells: list[Trimesh], path: Path, limit: Limit) -> list[list[int]]:
    """For each surface those that it lies within.

    Raises ValueError if opposite ones cross each other, but for a cavity into which a body reaches.
    """
    lows = np.array([shell.bounds[0] for shell in shells])
    highs = np.array([shell.bounds[1] for shell in shells])
    volumes = np.array([shell.volume for shell in shells])
    around: list[list[int]] = []
    crossing: list[tuple[int, int]] = []
    for i, shell in enumerate(shells):
        meets = (lows <= highs[i]).all(axis=1) & (highs >= lows[i]).all(axis=1)
        # Of two equal surfaces the later one counts as within the earlier.
        smaller = np.abs(volumes) >= np.abs(volumes[i])
        smaller[i:] &= np.abs(volumes[i:]) > np.abs(volumes[i])
        around.append([])
        for j in np.flatnonzero(meets & smaller):
            limit.require(f"the surfaces of {path} were sorted")
            share = float((np.abs(winding_numbers(_below(shell), shells[j])) > 0.5).mean())
            if share == 1.0:
                around[i].append(int(j))
            elif share > 0.0 and volumes[i] * volumes[j] < 0.0:
                crossing.append((i, int(j)))
    if any(not around[i] and not around[j] for i, j in crossing):
        wrong = f"{path} has two closed surfaces that cross each other and face opposite ways"
        expected = f"expected surfaces of bodies and of cavities within them. {WAY_OUT}"
        raise ValueError(f"{wrong}, {expected}")
    return around


def _below(shell: Trimesh) -> Points:
    """Points a little below some faces of a surface, in what it bounds, shape (n, 3)."""
    chosen = np.unique(np.linspace(0, len(shell.faces) - 1, SAMPLES).astype(int))
    normals = np.asarray(shell.face_normals, float)[chosen]  # 0 of one without an area
    depth = np.copysign(DEPTH * float(shell.extents.max()), shell.volume)
    below = np.asarray(shell.triangles_center, float)[chosen] - depth * normals
    sound = normals.any(axis=1)
    return np.asarray(below[sound] if sound.any() else below)


def winding_numbers(points: Points, surface: Trimesh) -> Points:
    """How often a surface goes round each of the points (n, 3): 1 inside, -1 if it faces inwards.

    The sum of the faces' solid angles (Van Oosterom and Strackee, 1983), shape (n,).
    """
    triangles = np.asarray(surface.triangles, float)
    total = np.zeros(len(points))
    step = max(1, CHUNK // max(1, len(points)))
    for start in range(0, len(triangles), step):
        edges = triangles[None, start : start + step] - points[:, None, None]
        a, b, c = edges[:, :, 0], edges[:, :, 1], edges[:, :, 2]
        la, lb, lc = (np.linalg.norm(edge, axis=2) for edge in (a, b, c))
        above = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ijk,ijk->ij", *pair) for pair in ((a, b), (b, c), (c, a)))
        below = la * lb * lc + ab * lc + bc * la + ca * lb
        total += 2.0 * np.arctan2(above, below).sum(axis=1)
    return total / (4.0 * np.pi)


def merged(vertices: NDArray[Any], faces: NDArray[Any]) -> Trimesh:
    """A mesh whose faces meet at common vertices."""
    surface = Trimesh(vertices, faces, process=False)
    surface.merge_vertices()
    a, b, c = surface.faces.T
    surface.update_faces((a != b) & (b != c) & (c != a))
    surface.remove_unreferenced_vertices()
    return surface


def joined(pieces: Sequence[Trimesh]) -> Trimesh:
    """One mesh of several."""
    return merged(*append_faces([p.vertices for p in pieces], [p.faces for p in pieces]))


def points_within(cavity: Trimesh) -> Points:
    """Points evenly in a cavity, the same for the same one, shape (n, 3); none if it is flat."""
    random = np.random.default_rng(0)
    found: list[Points] = []
    for _ in range(100):
        low, high = np.asarray(cavity.bounds, float)
        points = random.uniform(low, high, (CAVITY_POINTS, 3))
        found.append(points[np.abs(winding_numbers(points, cavity)) > 0.5])
        if sum(map(len, found)) >= CAVITY_POINTS:
            break
    return np.concatenate(found)
