"""From a URDF file to a tree of links, their shapes and the joints between them.

Links without mass are frames: what they carry becomes part of the link they are fixed to.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Cylinder, Mimic, Sphere
from energymargin.limits import Limit
from energymargin.scenes.poses import Pose, from_rpy
from energymargin.scenes.urdf_elements import MIMIC, checked, end_of, reached

TYPES = ("revolute", "continuous", "prismatic", "fixed")


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
    """One link; without mass it is a frame."""

    name: str
    mass: float
    center: Pose
    """Pose of the inertia's frame in the link's."""
    inertia: Any
    """Matrix (3, 3) about the centre of mass [kg m^2]; None if the file has none."""
    geometries: tuple[Geometry, ...]
    friction: float | None


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
    mimic: Mimic | None = None


@dataclass(eq=False)
class Robot:
    """A tree of links, by name; joints are in the file's order."""

    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    base: Pose = field(default_factory=lambda: np.eye(4))
    """The root link, in the frame of the file's root link."""
    merged: dict[str, str] = field(default_factory=dict)
    """Frames that are part of another link, and of which."""
    loose: tuple[str, ...] = ()
    """Joints that follow no other, since their <mimic> is left out."""

    def merge_frames(self, limit: Limit, *, free: bool) -> None:
        """Leaves a mass to each link that can move.

        A `free` robot whose root has no mass has its base in the link that is fixed to the root.
        Raises ValueError on a link that moves and has no mass, TimeoutError or Cancelled at the
        limit.
        """
        while free and self.links[self.root].mass == 0.0:
            limit.require(f"the frame {self.root!r} was merged")
            self._merge_root()
        for joint in list(self.joints.values()):
            if self.links[joint.child].mass > 0.0:
                continue
            if joint.type != "fixed":
                raise ValueError(
                    f"link {joint.child!r} has no mass and moves with joint {joint.name!r}, "
                    "expected an <inertial> with a mass above 0"
                )
            limit.require(f"the frame {joint.child!r} was merged")
            now = self.joints.pop(joint.name)  # whose parent may have been merged
            self._merge(now.child, now.parent, now.origin)

    def _merge_root(self) -> None:
        """Merges the root into the one link that is fixed to it."""
        hanging = [joint for joint in self.joints.values() if joint.parent == self.root]
        fixed = [joint for joint in hanging if joint.type == "fixed"]
        if len(fixed) != 1:
            raise ValueError(
                f"link {self.root!r} has no mass, expected a root with mass, or one link fixed to "
                "it, for base='free'"
            )
        joint = self.joints.pop(fixed[0].name)
        self._merge(self.root, joint.child, np.asarray(np.linalg.inv(joint.origin), float))
        self.root, self.base = joint.child, self.base @ joint.origin

    def _merge(self, frame: str, into: str, at: Pose) -> None:
        """A link carries from now on what a frame carried that is `at` a pose in the link."""
        self.links[into] = _carrying(self.links[into], self.links.pop(frame), at)
        for name, joint in self.joints.items():
            if joint.parent == frame:
                self.joints[name] = replace(joint, parent=into, origin=at @ joint.origin)
        self.merged[frame] = into
        for name, carrier in self.merged.items():
            if carrier == frame:
                self.merged[name] = into


def _carrying(link: Link, frame: Link, at: Pose) -> Link:
    """A link with the shapes of a frame that is fixed to it."""
    if not frame.geometries:
        return link
    if link.geometries and link.friction != frame.friction:
        raise ValueError(
            f"link {frame.name!r} has no mass and is part of {link.name!r}, which has another "
            "friction; ignore=('contact/lateral_friction',) and frictions={...} say which one holds"
        )
    shapes = tuple(Geometry(shape, at @ pose) for shape, pose in frame.geometries)
    return replace(link, geometries=link.geometries + shapes, friction=frame.friction)


def read(
    path: Path,
    ignore: Collection[str],
    limit: Limit,
    *,
    free: bool,
    subtree: str | None = None,
) -> Robot:
    """The model of a file, or of one link and what hangs on it, without its frames.

    Frames are merged into the links that carry them.

    Raises FileNotFoundError, ValueError that names what is wrong, or what is not simulated, and
    TimeoutError or Cancelled at the limit.
    """
    element, loose = checked(path, ignore, limit, subtree)
    links = _by_name("link", [_link(link) for link in element.findall("link")])
    joints = _by_name("joint", [_joint(joint) for joint in element.findall("joint")])
    limit.require(f"{path} was read")
    followed = _followed(joints, limit)
    robot = Robot(_root(links, joints), links, followed, loose=loose)
    robot.merge_frames(limit, free=free)
    return robot


def _by_name(what: str, items: list[Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for item in items:
        if item.name in found:
            raise ValueError(f"there are two {what}s {item.name!r}, expected one of each name")
        found[item.name] = item
    return found


def _link(element: ET.Element) -> Link:
    name, mass = element.get("name", ""), _number(element.find("inertial/mass"), "value", 0.0)
    if mass < 0.0:
        raise ValueError(f"link {name!r} has the mass {mass} kg, expected one of at least 0")
    geometries = [
        Geometry(_shape(next(collision.iterfind("geometry/*"))), _pose(collision.find("origin")))
        for collision in element.findall("collision")
    ]
    friction = element.find("contact/lateral_friction")
    return Link(
        name,
        mass,
        _pose(element.find("inertial/origin")),
        _inertia(element.find("inertial/inertia")),
        tuple(geometries),
        None if friction is None else _number(friction, "value", 0.0),
    )


def _shape(shape: ET.Element) -> Box | Sphere | Cylinder | MeshFile:
    if shape.tag == "box":
        return Box(_numbers(shape, "size", ()))
    if shape.tag == "sphere":
        return Sphere(_number(shape, "radius", 0.0))
    if shape.tag == "cylinder":
        return Cylinder(_number(shape, "radius", 0.0), _number(shape, "length", 0.0))
    scale = np.broadcast_to(_numbers(shape, "scale", (1.0,)), 3).tolist()
    return MeshFile(shape.get("filename", ""), tuple(scale))


def _joint(element: ET.Element) -> Joint:
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


def _inertia(element: ET.Element | None) -> NDArray[np.float64] | None:
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


def _root(links: dict[str, Link], joints: dict[str, Joint]) -> str:
    """The link that no joint carries, if all others hang on it."""
    carried: dict[str, str] = {}
    for joint in joints.values():
        for of, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                known = ", ".join(links)
                raise ValueError(
                    f"joint {joint.name!r} has the {of} {link!r}, expected one of {known}"
                )
        if joint.child in carried:
            raise ValueError(
                f"joints {carried[joint.child]!r} and {joint.name!r} both carry {joint.child!r}, "
                "expected one: loops are not simulated"
            )
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        raise ValueError(f"the robot has {len(roots)} root links, expected one: {roots}")
    hanging = reached(roots[0], [(joint.parent, joint.child) for joint in joints.values()])
    for name in links:
        if name not in hanging:
            raise ValueError(f"the joints above link {name!r} form a loop, expected a tree")
    return roots[0]


def _followed(joints: dict[str, Joint], limit: Limit) -> dict[str, Joint]:
    """The joints, each mimic joint with the moving joint at the end of its chain."""
    followed = {}
    for name, joint in joints.items():
        limit.require(f"joint {name!r} was read")
        mimic = _source(joint, joints) if joint.mimic else None
        followed[name] = replace(joint, mimic=mimic)
    return followed


def _source(joint: Joint, joints: dict[str, Joint]) -> Mimic:
    seen, multiplier, offset, at = {joint.name}, 1.0, 0.0, joint
    if joint.type == "fixed":
        raise ValueError(f"joint {joint.name!r} is fixed, and yet a mimic; expected one of the two")
    while at.mimic is not None:
        name = at.mimic.joint
        offset += multiplier * at.mimic.offset
        multiplier *= at.mimic.multiplier
        if name not in joints or joints[name].type == "fixed" or name in seen:
            raise ValueError(
                f"joint {at.name!r} mimics {name!r}, expected one that moves, without a circle, "
                f"below the root of a subtree; ignore=({MIMIC!r},) makes each one of its own"
            )
        seen.add(name)
        at = joints[name]
    return Mimic(at.name, multiplier, offset)
