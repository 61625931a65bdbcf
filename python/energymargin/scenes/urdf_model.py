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

from energymargin._core import Box, Cylinder, Sphere
from energymargin.limits import Limit
from energymargin.scenes.poses import Pose, from_rpy
from energymargin.scenes.urdf_elements import MIMIC, checked, reached

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
    mimic: tuple[str, float, float] | None = None
    """Joint, multiplier and offset."""


@dataclass(frozen=True, eq=False)
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


def without_frames(robot: Robot, limit: Limit, *, free: bool) -> Robot:
    """A robot with a mass for each link that can move.

    A `free` robot whose root has no mass has its base in the link that is fixed to the root.
    Raises ValueError on a link that moves and has no mass, TimeoutError or Cancelled at the limit.
    """
    tree = _Tree(robot)
    while free and tree.links[tree.root].mass == 0.0:
        limit.require(f"the frame {tree.root!r} was merged")
        tree.merge_root()
    for name, joint in robot.joints.items():
        if name not in tree.joints or tree.links[joint.child].mass > 0.0:
            continue
        if joint.type != "fixed":
            raise ValueError(
                f"link {joint.child!r} has no mass and moves with joint {name!r}, "
                "expected an <inertial> with a mass above 0"
            )
        limit.require(f"the frame {joint.child!r} was merged")
        tree.merge(name, joint.child, tree.joints[name].parent)
    return replace(
        robot,
        root=tree.root,
        links=tree.links,
        joints=tree.joints,
        base=tree.base,
        merged={frame: tree.carrier(frame) for frame in tree.merged},
    )


class _Tree:
    """The links and joints of a robot, while its frames are merged into the links that stay."""

    def __init__(self, robot: Robot) -> None:
        self.root, self.base = robot.root, robot.base
        self.links, self.joints = dict(robot.links), dict(robot.joints)
        self.merged: dict[str, str] = {}  # into which link or frame each frame went
        self._below: dict[str, list[str]] = {name: [] for name in robot.links}
        for joint in robot.joints.values():
            self._below[joint.parent].append(joint.name)

    def merge_root(self) -> None:
        """Merges the root into the one link that is fixed to it."""
        joints = [self.joints[name] for name in self._below[self.root]]
        fixed = [joint for joint in joints if joint.type == "fixed"]
        if len(fixed) != 1:
            raise ValueError(
                f"link {self.root!r} has no mass, expected a root with mass, or one link fixed to "
                "it, for base='free'"
            )
        (joint,) = fixed
        self.merge(joint.name, self.root, joint.child)
        self.root, self.base = joint.child, self.base @ joint.origin

    def merge(self, name: str, frame: str, into: str) -> None:
        """Merges the frame at one end of a fixed joint: the other carries what it carried."""
        joint = self.joints.pop(name)
        at = (
            joint.origin if into == joint.parent else np.asarray(np.linalg.inv(joint.origin), float)
        )
        self.links[into] = _carrying(self.links[into], self.links.pop(frame), at)
        for moved in self._below.pop(frame):
            if moved in self.joints:
                other = self.joints[moved]
                self.joints[moved] = replace(other, parent=into, origin=at @ other.origin)
                self._below[into].append(moved)
        self.merged[frame] = into

    def carrier(self, frame: str) -> str:
        """The link that a frame is finally part of."""
        into = self.merged[frame]
        while into in self.merged:
            into = self.merged[into]
        self.merged[frame] = into
        return into


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
    return without_frames(robot, limit, free=free)


def _by_name(what: str, items: list[Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for item in items:
        if item.name in found:
            raise ValueError(f"there are two {what}s {item.name!r}, expected one of each name")
        found[item.name] = item
    return found


def _link(element: ET.Element) -> Link:
    name = element.get("name", "")
    inertial = element.find("inertial")
    mass = 0.0 if inertial is None else _number(inertial.find("mass"), "value", 0.0)
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
        _pose(None if inertial is None else inertial.find("origin")),
        None if inertial is None else _inertia(inertial.find("inertia")),
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
        _named_link(element, "parent"),
        _named_link(element, "child"),
        _pose(element.find("origin")),
        np.array(_numbers(element.find("axis"), "xyz", (1.0, 0.0, 0.0))),
        limits,
        _number(limit, "effort", math.inf),
        _number(element.find("dynamics"), "damping", 0.0),
        _mimic(element.find("mimic")),
    )


def _mimic(element: ET.Element | None) -> tuple[str, float, float] | None:
    if element is None:
        return None
    multiplier, offset = _number(element, "multiplier", 1.0), _number(element, "offset", 0.0)
    return element.get("joint", ""), multiplier, offset


def _named_link(joint: ET.Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


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
    _require_tree(roots[0], links, joints)
    return roots[0]


def _require_tree(root: str, links: dict[str, Link], joints: dict[str, Joint]) -> None:
    """Raises ValueError unless all links hang on the root; each hangs on one joint at most."""
    below: dict[str, list[str]] = {name: [] for name in links}
    for joint in joints.values():
        below[joint.parent].append(joint.child)
    hanging = reached(root, below)
    for name in links:
        if name not in hanging:
            raise ValueError(f"the joints above link {name!r} form a loop, expected a tree")


def _followed(joints: dict[str, Joint], limit: Limit) -> dict[str, Joint]:
    """The joints, each mimic joint with the moving joint at the end of its chain."""
    followed = {}
    for name, joint in joints.items():
        limit.require(f"joint {name!r} was read")
        mimic = _source(joint, joints) if joint.mimic else None
        followed[name] = replace(joint, mimic=mimic)
    return followed


def _source(joint: Joint, joints: dict[str, Joint]) -> tuple[str, float, float]:
    seen, multiplier, offset, at = {joint.name}, 1.0, 0.0, joint
    if joint.type == "fixed":
        raise ValueError(f"joint {joint.name!r} is fixed, and yet a mimic; expected one of the two")
    while at.mimic is not None:
        name, factor, shift = at.mimic
        offset += multiplier * shift
        multiplier *= factor
        if name not in joints or joints[name].type == "fixed" or name in seen:
            raise ValueError(
                f"joint {at.name!r} mimics {name!r}, expected one that moves, without a circle, "
                f"below the root of a subtree; ignore=({MIMIC!r},) makes each one of its own"
            )
        seen.add(name)
        at = joints[name]
    return at.name, multiplier, offset
