"""From a URDF file to a checked model."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Cylinder, Sphere
from energymargin.limits import Limit
from energymargin.scenes.poses import Pose
from energymargin.scenes.urdf_frames import without_frames
from energymargin.scenes.urdf_grammar import checked
from energymargin.scenes.urdf_model import TYPES, Geometry, Joint, Link, MeshFile, Robot

__all__ = ["read"]


def read(path: Path, ignore: Collection[str], limit: Limit, *, free: bool) -> Robot:
    """The model of a file, without its frames: they are merged into the links that carry them.

    Raises FileNotFoundError, ValueError that names what is wrong, or what is not simulated, and
    TimeoutError or Cancelled at the limit.
    """
    element = checked(path, ignore, limit)
    links = _by_name("link", [_link(link) for link in element.findall("link")])
    joints = _by_name("joint", [_joint(joint) for joint in element.findall("joint")])
    limit.require(f"{path} was read")
    robot = Robot(_root(links, joints), links, _followed(joints, limit))
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
    """From xyz [m] and rpy [rad]: turns about the fixed axes x, then y, then z."""
    angles = np.array(_numbers(origin, "rpy", (0.0,) * 3))
    (sx, sy, sz), (cx, cy, cz) = np.sin(angles), np.cos(angles)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cz, sy * (sx * cz) - cx * sz, sy * (cx * cz) + sx * sz],
        [cy * sz, sy * (sx * sz) + cx * cz, sy * (cx * sz) - sx * cz],
        [-sy, cy * sx, cy * cx],
    ]
    matrix[:3, 3] = _numbers(origin, "xyz", (0.0,) * 3)
    return matrix + 0.0  # no -0


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
    reached, new = {root}, [root]
    while new:
        children = below[new.pop()]
        reached.update(children)
        new += children
    for name in links:
        if name not in reached:
            raise ValueError(f"the joints above link {name!r} form a loop, expected a tree")


def _followed(joints: dict[str, Joint], limit: Limit) -> dict[str, Joint]:
    """The joints, each mimic joint with the moving joint that it follows at last."""
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
                f"joint {at.name!r} mimics {name!r}, expected a joint that moves, without a circle"
            )
        seen.add(name)
        at = joints[name]
    return at.name, multiplier, offset
