"""Links as bodies: what they collide with, and how their mass is spread."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from energymargin import meshes
from energymargin._core import Compound, Inertial
from energymargin.limits import Limit
from energymargin.scenes.files import found
from energymargin.scenes.poses import moved, place
from energymargin.scenes.urdf_model import Geometry, Link, MeshFile

__all__ = ["Shaping", "body"]


@dataclass(frozen=True)
class Shaping:
    """How the links of a file become bodies."""

    path: Path
    inertia_from_shapes: bool
    decompose: bool
    threshold: float
    packages: tuple[str | Path, ...]
    limit: Limit


def body(link: Link, how: Shaping, *, fixed: bool) -> dict[str, Any]:
    """The keywords shape, mass and inertial of `Scene.add_body`, in the link's frame."""
    shape = _shape(link, how)
    keywords = {"shape": shape, "mass": 0.0 if fixed else link.mass}
    empty = isinstance(shape, Compound) and not shape.parts
    if not fixed and (empty or not how.inertia_from_shapes):
        keywords["inertial"] = _inertial(link)
    return keywords


def _inertial(link: Link) -> Inertial:
    if link.inertia is None:
        raise ValueError(
            f"link {link.name!r} has a mass and no <inertia>; inertia='shapes' takes it from the "
            "collision shapes"
        )
    frame = place(link.center)
    try:
        return Inertial(frame["position"], inertia=link.inertia, axes=frame["orientation"])
    except ValueError as error:
        raise ValueError(
            f"link {link.name!r}: {error}; inertia='shapes' takes it from the collision shapes"
        ) from error


def _shape(link: Link, how: Shaping) -> Any:
    """One solid in the link's frame as itself, all else as a compound."""
    if len(link.geometries) == 1 and not isinstance(link.geometries[0].shape, MeshFile):
        shape, pose = link.geometries[0]
        if np.array_equal(pose, np.eye(4)):
            return shape
    placed = [_placed(geometry, how) for geometry in link.geometries]
    if len(placed) == 1:
        return placed[0]
    return Compound([part for compound in placed for part in compound.parts])


def _placed(geometry: Geometry, how: Shaping) -> Compound:
    shape = geometry.shape
    if not isinstance(shape, MeshFile):
        return moved(Compound([shape]), geometry.pose)
    file = found(shape.filename, how.path, how.packages)
    mesh = meshes.mesh(
        file,
        scale=shape.scale,
        decompose=how.decompose,
        threshold=how.threshold,
        **how.limit.rest(),
    )
    return moved(mesh, geometry.pose)
