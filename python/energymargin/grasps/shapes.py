"""Shapes travel to other processes as the calls that make them again."""

from __future__ import annotations

import copyreg
import hashlib
import pickle
from typing import Any

import energymargin as em

FIELDS = {
    em.Box: ("size",),
    em.Sphere: ("radius",),
    **dict.fromkeys((em.Cylinder, em.Capsule), ("radius", "length")),
    em.ConvexHull: ("points",),
    em.Part: ("shape", "position", "orientation"),
    em.MassProperties: ("volume", "center", "moments", "axes"),
    em.Inertial: ("center", "moments", "axes"),
    em.Compound: ("parts", "solid"),
}
"""By kind, what it is made of, in the order of its arguments."""


def _reduced(one: Any) -> tuple[Any, tuple[Any, ...]]:
    """The call that makes a shape again, and its arguments, of plain numbers."""
    given = [getattr(one, name) for name in FIELDS[type(one)]]
    make = _inertial if isinstance(one, em.Inertial) else type(one)
    return make, tuple(value.tolist() if hasattr(value, "tolist") else value for value in given)


def _inertial(center: list[float], moments: list[float], axes: list[float]) -> em.Inertial:
    return em.Inertial(center, inertia=moments, axes=axes)


for kind in FIELDS:
    copyreg.pickle(kind, _reduced)


def digest(shape: Any) -> str:
    """A text that is the same for equal shapes alone."""
    return hashlib.sha256(pickle.dumps(shape, protocol=4)).hexdigest()
