"""Sets of states: capture set, success set, bounds. They combine with ``& | ~``.

Each function takes the name of the body whose position (or velocity, or axis) counts, and
``frame``, the name of the body in whose frame it counts; by default the world's.
"""

from energymargin._core import Region
from energymargin._core.regions import (
    AnnularSector,
    Ball,
    Box,
    Disc,
    HalfSpace,
    Predicate,
    Speed,
    Swept,
    Tilt,
)

__all__ = [
    "AnnularSector",
    "Ball",
    "Box",
    "Disc",
    "HalfSpace",
    "Predicate",
    "Region",
    "Speed",
    "Swept",
    "Tilt",
]
