"""The printed bodies of the recordings: upright prisms, from the authors' meshes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Compound, ConvexHull, Part

__all__ = ["outlines", "prism"]

ENLARGED = 10.0  # the authors' lengths


@cache
def outlines(folder: Path, name: str) -> tuple[NDArray[np.float64], ...]:
    """Of the convex parts of a body, such as "jaw-gripper", seen from above: corners, (N, 2) [m],
    about the tag.

    Each object of the file `NAME-vhacd.obj`, or else `NAME.obj`, is a part. Raises OSError, and
    ValueError with the line that is no corner.
    """
    own = folder / name
    split = own / f"{name}-vhacd.obj"
    path = split if split.exists() else own / f"{name}.obj"
    parts: list[list[tuple[float, float]]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        word, *numbers = line.split() or [""]
        if word == "o" or (word == "v" and not parts):
            parts.append([])
        if word == "v":
            parts[-1].append(_corner(path, number, numbers))
    corners = [_hull(np.array(part)) for part in parts if part]
    if not corners:
        raise ValueError(f"{path}: has no corners, expected lines 'v x y z'")
    return tuple(corners)


def prism(folder: Path, name: str, height: float) -> Compound:
    """The body of these outlines, its middle at half of the height [m]."""
    parts = []
    for outline in outlines(folder, name):
        faces = [np.insert(outline, 2, z, axis=1) for z in (-height / 2, height / 2)]
        parts.append(Part(ConvexHull(np.concatenate(faces))))
    return Compound(parts)


def _corner(path: Path, number: int, words: list[str]) -> tuple[float, float]:
    try:
        x, y, *_ = (float(word) / ENLARGED for word in words)
    except ValueError as error:
        raise ValueError(f"{path}, line {number}: expected 'v x y z', numbers") from error
    return x, y


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners of the convex hull, counter-clockwise."""
    from scipy.spatial import ConvexHull as Hull

    return points[Hull(points).vertices]
