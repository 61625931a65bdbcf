"""Links and joints of a URDF file, each from its element, and joints as those of a scene, with what
a caller says of them."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from energymargin._core import Box, Cylinder, Mimic, Sphere, Surface
from energymargin.base.aliases import Floats
from energymargin.base.plausibility import warn
from energymargin.model.scenes import additions
from energymargin.model.scenes.additions import Control, FileMistakes
from energymargin.model.scenes.poses import Pose, from_rpy, place
from energymargin.model.scenes.urdf_elements import SURFACE, end_of

TYPES = ("revolute", "continuous", "prismatic", "fixed")
NO_MASS = 1e-6  # kg; a link of at most that, and without inertia, has none
UNLIMITED = (-math.inf, math.inf)
SLACK = 1e-6  # rad or m, of a mimic joint beyond its own limits: files are rounded
CLOSE = 0.01  # share of its range by which a mimic joint may be beyond its limits, with a warning


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
    collisions = element.findall("collision")
    geometries = [Geometry(_shape(each), _pose(each.find("origin"))) for each in collisions]
    center = _pose(element.find("inertial/origin"))
    scaled = None if inertia is None else scaling * inertia
    return Link(name, mass, center, scaled, tuple(geometries), contact)


def surface_of(link: Link) -> dict[str, Surface]:
    """What Bullet's <contact> says of it beside friction, as a keyword of `Scene.add_body`."""
    contact = {name: value for name in SURFACE if (value := link.contact.get(name, 0.0))}
    if "stiffness" not in contact:
        contact.pop("damping", None)
    if "spinning_friction" in contact:
        contact["torsional_friction"] = contact.pop("spinning_friction")
    return {"surface": Surface(**contact)} if contact else {}


def _shape(collision: ET.Element) -> Box | Sphere | Cylinder | MeshFile:
    shape = next(collision.iterfind("geometry/*"))
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
    parent, child = end_of(element, "parent"), end_of(element, "child")
    origin, dynamics = _pose(element.find("origin")), element.find("dynamics")
    axis = np.array(_numbers(element.find("axis"), "xyz", (1.0, 0.0, 0.0)))
    effort, mimic = _number(limit, "effort", math.inf), _mimic(element.find("mimic"))
    damping, friction = _number(dynamics, "damping", 0.0), _number(dynamics, "friction", 0.0)
    law = (limits, effort, damping, friction, mimic)
    return Joint(name, kind, parent, child, origin, axis, *law)


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


def _inertia(element: ET.Element | None) -> Floats | None:
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


def joint_keywords(
    joints: dict[str, Joint], control: Control, prefix: str, mistakes: FileMistakes, *, leader: bool
) -> list[dict[str, Any]]:
    """Keywords of `Scene.add_joint`, in an order in which joints may be added.

    `control` of a joint replaces what the file has. `leader`: limits of joints that lead hold, for
    those that follow too. Lists unknown joints and keywords, and limits
    that contradict each other.
    """
    with mistakes.listed():
        additions.check_control(control, {name: _settable(joint) for name, joint in joints.items()})
    followers: dict[str, list[tuple[Joint, Mimic]]] = {}
    for joint in joints.values():
        if joint.mimic:
            followers.setdefault(joint.mimic.joint, []).append((joint, joint.mimic))
    keywords = {}
    for name, joint in joints.items():
        if joint.mimic is None:
            own = control.get(name, {})
            # Those that follow resist here: the same power at the same motion.
            following = followers.get(name, ())
            damping = sum((m.multiplier**2 * j.damping for j, m in following), joint.damping)
            friction = sum((abs(m.multiplier) * j.friction for j, m in following), joint.friction)
            with mistakes.listed():
                drive = _drive(joint, damping, friction, own)
                keywords[name] = {**_joint_frames(joint, prefix), **drive, **own}
    for joint in joints.values():
        if joint.mimic and joint.mimic.joint in keywords:
            mimic, own = joint.mimic, control.get(joint.name, {})
            with mistakes.listed():
                if not leader or "limits" in own:
                    _check_reach(joint, mimic, own, keywords[mimic.joint]["limits"])
                prefixed = Mimic(prefix + mimic.joint, mimic.multiplier, mimic.offset)
                keywords[joint.name] = {**_joint_frames(joint, prefix), "mimic": prefixed}
    return list(keywords.values())


def _settable(joint: Joint) -> Sequence[str]:
    """What `joints` may set of a joint."""
    return () if joint.type == "fixed" else ("limits",) if joint.mimic else additions.CONTROL


def _joint_frames(joint: Joint, prefix: str) -> dict[str, Any]:
    """Which bodies a joint connects, where, and how they move."""
    names = {"name": joint.name, "parent": joint.parent, "child": joint.child}
    keywords: dict[str, Any] = {key: prefix + name for key, name in names.items()}
    keywords["type"] = "revolute" if joint.type == "continuous" else joint.type
    at = place(joint.origin)
    keywords |= {"origin": at["position"], "orientation": at["orientation"]}
    if joint.type == "fixed":
        return keywords
    length = float(np.linalg.norm(joint.axis))
    if length == 0.0:
        raise ValueError(f"joint {joint.name!r} has the axis 0 0 0, expected a direction")
    return {**keywords, "axis": joint.axis / length}


def _drive(joint: Joint, damping: float, friction: float, own: Mapping[str, Any]) -> dict[str, Any]:
    """Limits, start, and what resists."""
    if joint.type == "fixed":
        return {}
    lower, upper = _given(joint.name, own["limits"]) if "limits" in own else _limits(joint)
    start, most = min(max(0.0, lower), upper), _torque_limit(joint, own)
    resists = {"damping": damping, "friction": friction, "torque_limit": most}
    return {"limits": (lower, upper), "start": start, **resists}


def _torque_limit(joint: Joint, own: Mapping[str, Any]) -> float:
    """The effort of the file; many exporters write 0 where they know none."""
    if joint.effort != 0.0 or "torque_limit" in own or own.get("held"):
        return joint.effort
    if own.get("stiffness") or own.get("damping"):
        way = f"joints={{{joint.name!r}: {{'torque_limit': 10.0, ...}}}}"
        raise ValueError(
            f'joint {joint.name!r} has effort="0" in the file, and joints drives it: with a torque '
            f"limit of 0 it would not move; {way} says how strong it is, math.inf has no limit"
        )
    return math.inf  # what resists without a motor is not a motor's to limit


def _given(name: str, limits: Any) -> tuple[float, float]:
    values = np.asarray(limits, float)
    if values.shape != (2,) or not values[0] < values[1]:
        raise ValueError(f"joints[{name!r}] has the limits {limits!r}, expected (lower, upper)")
    return float(values[0]), float(values[1])


def _limits(joint: Joint) -> tuple[float, float]:
    """Those of the file, if it is clear what they are."""
    lower, upper = joint.limits or (0.0, 0.0)
    if (joint.type == "continuous") != (lower < upper):
        return (lower, upper) if lower < upper else UNLIMITED
    has = f"limits from {lower} to {upper}" if joint.limits else "no limits"
    way = f"joints={{{joint.name!r}: {{'limits': (lower, upper)}}}} says which hold"
    raise ValueError(f"joint {joint.name!r} is {joint.type} and has {has}; {way}")


def _check_reach(
    joint: Joint, mimic: Mimic, own: Mapping[str, Any], source: tuple[float, float]
) -> None:
    """A joint that follows stays within its own limits wherever the other one may go."""
    if "limits" in own:
        lower, upper = _given(joint.name, own["limits"])
    elif joint.limits is None or joint.type == "continuous":
        return
    else:
        lower, upper = joint.limits
    name = mimic.joint
    least, most = sorted(mimic.multiplier * limit + mimic.offset for limit in source)
    beyond = max(lower - least, most - upper)
    if beyond <= SLACK:
        return
    if beyond <= CLOSE * (upper - lower):
        text = f"joint {joint.name!r} follows {name!r} from {least:.6g} to {most:.6g}, and its own "
        text += f"limits are from {lower:.6g} to {upper:.6g}: they differ by less than 1 %, and "
        text += f"those of {name!r} hold."
        warn([(text, text)], text)
        return
    raise ValueError(
        f"joint {joint.name!r} has limits from {lower} to {upper} and follows {name!r} from "
        f"{least} to {most}; joints={{{name!r}: {{'limits': ...}}}} or "
        f"joints={{{joint.name!r}: {{'limits': ...}}}} says which hold, mimic_limits='leader' "
        "that those of the joints that lead do, for all"
    )
