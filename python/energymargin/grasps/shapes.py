"""Shapes travel to other processes as the calls that make them again."""

from __future__ import annotations

import copyreg
import hashlib
import pickle
from typing import Any

from energymargin._core import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    Inertial,
    MassProperties,
    Part,
    Sphere,
)
from energymargin.meshes.shape import MeshShape

copyreg.pickle(Box, lambda one: (Box, (one.size.tolist(),)))
copyreg.pickle(Sphere, lambda one: (Sphere, (one.radius,)))
copyreg.pickle(Cylinder, lambda one: (Cylinder, (one.radius, one.length)))
copyreg.pickle(Capsule, lambda one: (Capsule, (one.radius, one.length)))
copyreg.pickle(ConvexHull, lambda one: (ConvexHull, (one.points.tolist(),)))
copyreg.pickle(
    Part, lambda one: (Part, (one.shape, one.position.tolist(), one.orientation.tolist()))
)
copyreg.pickle(
    MassProperties,
    lambda one: (
        MassProperties,
        (one.volume, one.center.tolist(), one.moments.tolist(), one.axes.tolist()),
    ),
)
copyreg.pickle(
    Inertial,
    lambda one: (_inertial, (one.center.tolist(), one.moments.tolist(), one.axes.tolist())),
)
for compound in (Compound, MeshShape):
    copyreg.pickle(compound, lambda one: (Compound, (one.parts, one.solid)))


def _inertial(center: list[float], moments: list[float], axes: list[float]) -> Inertial:
    return Inertial(center, inertia=moments, axes=axes)


def digest(shape: Any) -> str:
    """A text that is the same for equal shapes alone."""
    return hashlib.sha256(pickle.dumps(shape, protocol=4)).hexdigest()
