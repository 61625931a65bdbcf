"""The printed objects and end-effectors of the recorded pushes (Section VI-E): upright prisms."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Compound, ConvexHull, Cylinder, Part
from energymargin.base.reprs import short_repr
from energymargin.model.scenes.files import data_file

__all__ = ["OBJECTS", "TOOLS", "Printed", "printed"]

OBJECTS = ("rectangle", "triangle", "convex", "concave", "irregular")
TOOLS = ("jaw", "round")
FILE = "push_real/shapes.json"


@dataclass(frozen=True, eq=False)
class Printed:
    """One printed body, whose frame is at its centre of mass."""

    __repr__ = short_repr

    mass: float
    """[kg]"""
    height: float
    """[m]"""
    outlines: tuple[NDArray[np.float64], ...] = ()
    """Corners of its convex parts, seen from above, each (n, 2) [m]."""
    radius: float | None = None
    """Radius of a cylinder, instead [m]."""

    @property
    def shape(self) -> Compound | Cylinder:
        """For a Scene, with its middle at half of its height."""
        if self.radius is not None:
            return Cylinder(self.radius, self.height)
        return Compound([self._part(outline) for outline in self.outlines])

    @property
    def points(self) -> NDArray[np.float64]:
        """The corners of all parts, (n, 2) [m]."""
        return np.concatenate(self.outlines)

    @property
    def ahead(self) -> float:
        """How far its longest edge, which lies ahead, is from its centre [m]."""
        return float(self.points[:, 1].max())

    @property
    def width(self) -> float:
        """Across the direction of the push [m]."""
        return float(np.ptp(self.points[:, 0]))

    def _part(self, outline: NDArray[np.float64]) -> Part:
        """A prism; a box where it is one, for that is the faster shape."""
        low, high = outline.min(axis=0), outline.max(axis=0)
        if len(outline) == 4 and np.isin(outline, (low, high)).all():
            return Part(Box((*(high - low), self.height)), (*((low + high) / 2), 0.0))
        heights = (-self.height / 2, self.height / 2)
        corners = [np.insert(outline, 2, z, axis=1) for z in heights]
        return Part(ConvexHull(np.concatenate(corners)))


def printed(kind: str, name: str) -> Printed:
    """A body of `kind` "objects" or "effectors", such as "rectangle" or "jaw"."""
    shapes = _file()
    found = shapes[kind][name]
    return Printed(
        mass=found["mass"],
        height=shapes["height"],
        outlines=tuple(np.array(part) for part in found.get("parts", ())),
        radius=found.get("radius"),
    )


@cache
def _file() -> dict[str, Any]:
    shapes: dict[str, Any] = json.loads(data_file(FILE).read_text())
    return shapes
