"""Sets of states: capture set, success set, bounds. They combine with ``& | ~``.

Each function takes the name of the body whose position (or velocity, or axis) counts, and
``frame``, the name of the body in whose frame it counts; by default the world's.

A position is that of the body's ``point``: its "origin", which is that of the shape's frame, as of
a mesh file or a link, or its "center_of_mass".
"""

from energymargin._core import Region
from energymargin._core.regions import (
    AnnularSector,
    Ball,
    Box,
    Disc,
    HalfSpace,
    Joint,
    Predicate,
    Speed,
    Swept,
    Tilt,
    Touching,
)
from energymargin.base.calls import explained

__all__ = [
    "AnnularSector",
    "Ball",
    "Box",
    "Disc",
    "HalfSpace",
    "Joint",
    "Predicate",
    "Region",
    "Speed",
    "Swept",
    "Tilt",
    "Touching",
]

globals().update({name: explained(globals()[name], name) for name in __all__ if name != "Region"})
