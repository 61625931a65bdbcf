"""The links and the joints of a URDF file, each from its element."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from energymargin._core import Box, Cylinder, Mimic, Sphere, Surface
from energymargin.base.arrays import Numbers
from energymargin.model.scenes.poses import Pose, from_rpy
from energymargin.model.scenes.urdf_elements import SURFACE, end_of

TYPES = ("revolute", "continuous", "prismatic", "fixed")
NO_MASS = 1e-6  # kg; a link of at most that, and without inertia, has none


class MeshFile(NamedTuple):
    """A mesh, by the name that the file gives it."""

    filename: str
    scale: tuple[float, float, float]


class Geometry(NamedTuple):
    """One collision shape of a link."""

    shape: Box | Sphere | Cylinder | MeshFile
    pose: Pose
    """In the link's frame."""


@dataclass(frozen=True, eq=False)
class Link:
    """One link; without mass or density it is a frame."""

    name: str
    mass: float
    center: Pose
    """Pose of the inertia's frame in the link's."""
    inertia: Any
    """Matrix (3, 3) about the centre of mass [kg m^2]; None if the file has none."""
    geometries: tuple[Geometry, ...]
    contact: dict[str, float]
    """What Bullet's <contact> has, by tag."""
    dense: bool = False
    """Whether its mass is that of its shapes, of a density."""

    @property
    def frame(self) -> bool:
        """Whether it is a frame alone."""
        return self.mass == 0.0 and not self.dense


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint; for a prismatic one read m for rad and N for N m."""

    name: str
    type: str
    """One of TYPES."""
    parent: str
    child: str
    origin: Pose
    """In the parent's frame."""
    axis: Any
    """Shape (3,), as the file has it."""
    limits: tuple[float, float] | None = None
    """As the file has them [rad]; None if it has none."""
    effort: float = math.inf
    """[N m]."""
    damping: float = 0.0
    """[N m s/rad]."""
    friction: float = 0.0
    """Dry [N m]."""
    mimic: Mimic | None = None


def link_of(element: ET.Element) -> Link:
    """That of an element; ValueError on a mass below 0."""
    name, mass = element.get("name", ""), _number(element.find("inertial/mass"), "value", 0.0)
    if mass < 0.0:
        raise ValueError(f"link {name!r} has the mass {mass} kg, expected one of at least 0")
    inertia = _inertia(element.find("inertial/inertia"))
    if mass <= NO_MASS and (inertia is None or not inertia.any()):
        mass = 0.0
    contact = {of.tag: _number(of, "value", 0.0) for of in element.iterfind("contact/*")}
    scaling = contact.pop("inertia_scaling", 1.0)
    geometries = [
        Geometry(_shape(next(collision.iterfind("geometry/*"))), _pose(collision.find("origin")))
        for collision in element.findall("collision")
    ]
    return Link(
        name,
        mass,
        _pose(element.find("inertial/origin")),
        None if inertia is None else scaling * inertia,
        tuple(geometries),
        contact,
    )


def surface_of(link: Link) -> dict[str, Surface]:
    """What Bullet's <contact> says of it beside friction, as a keyword of `Scene.add_body`."""
    contact = {name: value for name in SURFACE if (value := link.contact.get(name, 0.0))}
    if "stiffness" not in contact:
        contact.pop("damping", None)
    if "spinning_friction" in contact:
        contact["torsional_friction"] = contact.pop("spinning_friction")
    return {"surface": Surface(**contact)} if contact else {}


def _shape(shape: ET.Element) -> Box | Sphere | Cylinder | MeshFile:
    if shape.tag == "box":
        return Box(_numbers(shape, "size", ()))
    if shape.tag == "sphere":
        return Sphere(_number(shape, "radius", 0.0))
    if shape.tag == "cylinder":
        return Cylinder(_number(shape, "radius", 0.0), _number(shape, "length", 0.0))
    scale = np.broadcast_to(_numbers(shape, "scale", (1.0,)), 3).tolist()
    return MeshFile(shape.get("filename", ""), tuple(scale))


def joint_of(element: ET.Element) -> Joint:
    """That of an element; ValueError on a type that is not one of TYPES."""
    name, kind = element.get("name", ""), element.get("type", "")
    if kind not in TYPES:
        hint = "; base='free' lets the root move" if kind == "floating" else ""
        raise ValueError(f"joint {name!r} is {kind!r}, expected one of {', '.join(TYPES)}{hint}")
    limit = element.find("limit")
    limits = None
    if limit is not None and ("lower" in limit.attrib or "upper" in limit.attrib):
        limits = (_number(limit, "lower", 0.0), _number(limit, "upper", 0.0))
    return Joint(
        name,
        kind,
        end_of(element, "parent"),
        end_of(element, "child"),
        _pose(element.find("origin")),
        np.array(_numbers(element.find("axis"), "xyz", (1.0, 0.0, 0.0))),
        limits,
        _number(limit, "effort", math.inf),
        _number(element.find("dynamics"), "damping", 0.0),
        _number(element.find("dynamics"), "friction", 0.0),
        _mimic(element.find("mimic")),
    )


def _mimic(element: ET.Element | None) -> Mimic | None:
    if element is None:
        return None
    multiplier, offset = _number(element, "multiplier", 1.0), _number(element, "offset", 0.0)
    return Mimic(element.get("joint", ""), multiplier, offset)


def _numbers(element: ET.Element | None, name: str, default: Sequence[float]) -> Sequence[float]:
    text = None if element is None else element.get(name)
    return default if text is None else [float(word) for word in text.split()]


def _number(element: ET.Element | None, name: str, default: float) -> float:
    return _numbers(element, name, (default,))[0]


def _inertia(element: ET.Element | None) -> Numbers | None:
    """Matrix (3, 3)."""
    if element is None:
        return None
    xx, xy, xz, yy, yz, zz = (
        _number(element, f"i{axes}", 0.0) for axes in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _pose(origin: ET.Element | None) -> Pose:
    nothing = (0.0, 0.0, 0.0)
    return from_rpy(_numbers(origin, "xyz", nothing), _numbers(origin, "rpy", nothing))
