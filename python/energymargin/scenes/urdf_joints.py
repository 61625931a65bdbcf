"""Joints of a robot as those of a scene: limits, control, and joints that follow others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from energymargin._core import Mimic
from energymargin.scenes.poses import place
from energymargin.scenes.urdf_model import Joint

__all__ = ["joint_keywords"]

# What the caller may say of a joint; the rest is the file's.
CONTROL = (
    "start",
    "start_velocity",
    "held",
    "target",
    "target_velocity",
    "stiffness",
    "damping",
    "torque_limit",
    "limits",
)
UNLIMITED = (-math.inf, math.inf)
SLACK = 1e-6  # rad or m, of a mimic joint beyond its own limits: files are rounded

Control = Mapping[str, Mapping[str, Any]]


def joint_keywords(joints: Mapping[str, Joint], said: Control, prefix: str) -> list[dict[str, Any]]:
    """Keywords of `Scene.add_joint`, in an order in which joints may be added.

    What is `said` of a joint goes before the file. Raises ValueError on unknown joints and
    keywords, and on limits that contradict each other.
    """
    _check(joints, said)
    moving = [joint for joint in joints.values() if joint.mimic is None]
    following = [joint for joint in joints.values() if joint.mimic is not None]
    followers: dict[str, list[Joint]] = {joint.name: [] for joint in moving}
    for joint in following:
        if joint.mimic:
            followers[joint.mimic[0]].append(joint)
    keywords = {}
    for joint in moving:
        own = said.get(joint.name, {})
        drive = _drive(joint, followers[joint.name], own)
        keywords[joint.name] = {**_frames(joint, prefix), **drive, **own}
    for joint in following:
        source, multiplier, offset = joint.mimic or ("", 1.0, 0.0)
        _check_reach(joint, said.get(joint.name, {}), keywords[source]["limits"])
        mimic = Mimic(prefix + source, multiplier, offset)
        keywords[joint.name] = {**_frames(joint, prefix), "mimic": mimic}
    return list(keywords.values())


def _check(joints: Mapping[str, Joint], said: Control) -> None:
    for name, own in said.items():
        if name not in joints:
            raise ValueError(f"joints has {name!r}, expected one of {', '.join(joints)}")
        joint = joints[name]
        known: tuple[str, ...] = CONTROL
        if joint.type == "fixed":
            known = ()
        elif joint.mimic is not None:
            known = ("limits",)
        for keyword in own:
            if keyword not in known:
                of = f" for one that follows {joint.mimic[0]!r}" if joint.mimic else ""
                expected = ", ".join(known) or "none for a fixed joint"
                raise ValueError(f"joints[{name!r}] has {keyword!r}, expected {expected}{of}")


def _frames(joint: Joint, prefix: str) -> dict[str, Any]:
    """Which bodies a joint connects, where, and how they move."""
    at = place(joint.origin)
    keywords = {
        "name": prefix + joint.name,
        "parent": prefix + joint.parent,
        "child": prefix + joint.child,
        "type": "revolute" if joint.type == "continuous" else joint.type,
        "origin": at["position"],
        "orientation": at["orientation"],
    }
    if joint.type == "fixed":
        return keywords
    length = float(np.linalg.norm(joint.axis))
    if length == 0.0:
        raise ValueError(f"joint {joint.name!r} has the axis 0 0 0, expected a direction")
    return {**keywords, "axis": joint.axis / length}


def _drive(joint: Joint, followers: list[Joint], own: Mapping[str, Any]) -> dict[str, Any]:
    """Limits, start, and what resists: the damping of the joints that follow acts here too."""
    if joint.type == "fixed":
        return {}
    lower, upper = _given(joint.name, own["limits"]) if "limits" in own else _limits(joint)
    damping = joint.damping
    for other in followers:
        multiplier = other.mimic[1] if other.mimic else 0.0
        damping += multiplier**2 * other.damping  # the same power at the same motion
    return {
        "limits": (lower, upper),
        "start": min(max(0.0, lower), upper),
        "damping": damping,
        "torque_limit": joint.effort,
    }


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
    raise ValueError(
        f"joint {joint.name!r} is {joint.type} and has {has}; "
        f"joints={{{joint.name!r}: {{'limits': (lower, upper)}}}} says which hold"
    )


def _check_reach(joint: Joint, own: Mapping[str, Any], source: tuple[float, float]) -> None:
    """A joint that follows stays within its own limits wherever the other one may go."""
    if "limits" in own:
        lower, upper = _given(joint.name, own["limits"])
    elif joint.limits is None or joint.type == "continuous":
        return
    else:
        lower, upper = joint.limits
    name, multiplier, offset = joint.mimic or ("", 1.0, 0.0)
    least, most = sorted(multiplier * limit + offset for limit in source)
    if least < lower - SLACK or most > upper + SLACK:
        raise ValueError(
            f"joint {joint.name!r} has limits from {lower} to {upper} and follows {name!r} from "
            f"{least} to {most}; joints={{{name!r}: {{'limits': ...}}}} or "
            f"joints={{{joint.name!r}: {{'limits': ...}}}} says which hold"
        )
