"""Shapes travel to other processes as the calls that make them again; how thin they are."""

from __future__ import annotations

import copyreg
import hashlib
import pickle
from typing import Any

import numpy as np

from energymargin import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    Inertial,
    MassProperties,
    Part,
    Plane,
    Sphere,
    mass_properties,
)
from energymargin.scenes import pose, shape_parts

FIELDS = {
    Box: ("size",),
    Sphere: ("radius",),
    Cylinder: ("radius", "length"),
    Capsule: ("radius", "length"),
    ConvexHull: ("points",),
    Part: ("shape", "position", "orientation"),
    MassProperties: ("volume", "center", "moments", "axes"),
    Inertial: ("center", "moments", "axes"),
    Compound: ("parts", "solid"),
}
"""By kind, what it is made of, in the order of its arguments."""


def _reduced(one: Any) -> tuple[Any, tuple[Any, ...]]:
    """The call that makes a shape again, and its arguments, of plain numbers."""
    given = [getattr(one, name) for name in FIELDS[type(one)]]
    make: Any = {Inertial: _inertial}.get(type(one), type(one))
    return make, tuple(value.tolist() if hasattr(value, "tolist") else value for value in given)


def _inertial(center: list[float], moments: list[float], axes: list[float]) -> Inertial:
    return Inertial(center, inertia=moments, axes=axes)


for kind in FIELDS:
    copyreg.pickle(kind, _reduced)


def digest(shape: Any) -> str:
    """A text that is the same for equal shapes alone."""
    return hashlib.sha256(pickle.dumps(shape, protocol=4)).hexdigest()


def smallest_half_extent(shape: Any) -> float:
    """Half the extent of a shape along its thinnest principal axis [m], of several parts that of
    the thickest one; inf of a plane, and without parts."""
    if isinstance(shape, Plane):
        return np.inf
    extents = []
    for solid in (part.shape for part in shape.parts) if isinstance(shape, Compound) else (shape,):
        axes = pose((0, 0, 0), mass_properties(solid).axes)[:3, :3]
        extents.append(np.ptp(shape_parts(solid)[0] @ axes, axis=0).min())
    return float(max(extents, default=np.inf)) / 2
