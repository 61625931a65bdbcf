"""From a URDF file to a checked model (yourdfpy)."""

from __future__ import annotations

import io
import math
import xml.etree.ElementTree as ET
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Box, Cylinder, Sphere
from energymargin.limits import Limit
from energymargin.meshes import needs_extra
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
    with needs_extra():
        import yourdfpy
    text = io.BytesIO(ET.tostring(element, encoding="utf-8"))
    limit.require(f"{path} was read")
    parsed = yourdfpy.URDF.load(text, build_scene_graph=False, load_meshes=False).robot
    frictions = {
        link.get("name"): float(value.get("value", ""))
        for link in element.findall("link")
        for value in link.findall("contact/lateral_friction")
    }
    limit.require(f"{path} was read")
    links = _by_name("link", [_link(link, frictions.get(link.name)) for link in parsed.links])
    joints = _by_name("joint", [_joint(joint) for joint in parsed.joints])
    robot = Robot(_root(links, joints), links, _followed(joints, limit))
    return without_frames(robot, limit, free=free)


def _by_name(what: str, items: list[Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for item in items:
        if item.name in found:
            raise ValueError(f"there are two {what}s {item.name!r}, expected one of each name")
        found[item.name] = item
    return found


def _link(parsed: Any, friction: float | None) -> Link:
    geometries = tuple(
        Geometry(_shape(collision.geometry), _pose(collision.origin))
        for collision in parsed.collisions
    )
    inertial = parsed.inertial
    mass = inertial.mass if inertial else 0.0
    if mass < 0.0:
        raise ValueError(f"link {parsed.name!r} has the mass {mass} kg, expected one of at least 0")
    return Link(
        parsed.name,
        mass,
        _pose(inertial.origin if inertial else None),
        inertial.inertia if inertial else None,
        geometries,
        friction,
    )


def _shape(geometry: Any) -> Box | Sphere | Cylinder | MeshFile:
    if geometry.box is not None:
        return Box(geometry.box.size)
    if geometry.sphere is not None:
        return Sphere(geometry.sphere.radius)
    if geometry.cylinder is not None:
        return Cylinder(geometry.cylinder.radius, geometry.cylinder.length)
    scale = 1.0 if geometry.mesh.scale is None else geometry.mesh.scale
    return MeshFile(geometry.mesh.filename, tuple(np.broadcast_to(scale, 3).tolist()))


def _joint(parsed: Any) -> Joint:
    name, kind, limit = f"joint {parsed.name!r}", parsed.type, parsed.limit
    if kind not in TYPES:
        hint = "; base='free' lets the root move" if kind == "floating" else ""
        raise ValueError(f"{name} is {kind!r}, expected one of {', '.join(TYPES)}{hint}")
    limits = None
    if limit is not None and (limit.lower, limit.upper) != (None, None):
        limits = (limit.lower or 0.0, limit.upper or 0.0)
    return Joint(
        parsed.name,
        kind,
        parsed.parent,
        parsed.child,
        _pose(parsed.origin),
        parsed.axis,
        limits,
        math.inf if limit is None or limit.effort is None else limit.effort,
        float((parsed.dynamics and parsed.dynamics.damping) or 0.0),
        parsed.mimic and (parsed.mimic.joint, parsed.mimic.multiplier, parsed.mimic.offset),
    )


def _pose(matrix: Any) -> Pose:
    return np.eye(4) if matrix is None else np.asarray(matrix, float)


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
