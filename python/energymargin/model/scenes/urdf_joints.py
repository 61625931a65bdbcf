"""Joints of a URDF file as those of a scene, with what a caller says of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from energymargin._core import Mimic
from energymargin.base.plausibility import warn
from energymargin.model.scenes import additions
from energymargin.model.scenes.additions import Control, FileMistakes
from energymargin.model.scenes.poses import place
from energymargin.model.scenes.urdf_parts import Joint

UNLIMITED = (-math.inf, math.inf)
SLACK = 1e-6  # rad or m, of a mimic joint beyond its own limits: files are rounded
CLOSE = 0.01  # share of its range by which a mimic joint may be beyond its limits, with a warning


def joint_keywords(
    joints: Mapping[str, Joint],
    control: Control,
    prefix: str,
    mistakes: FileMistakes,
    *,
    mimic_limits: str,
) -> list[dict[str, Any]]:
    """Keywords of `Scene.add_joint`, in an order in which joints may be added.

    `control` of a joint replaces what the file has. Lists unknown joints and keywords, and limits
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
            leader, mimic, own = joint.mimic.joint, joint.mimic, control.get(joint.name, {})
            with mistakes.listed():
                if mimic_limits == "file" or "limits" in own:
                    _check_reach(joint, mimic, own, keywords[leader]["limits"])
                prefixed = Mimic(prefix + leader, mimic.multiplier, mimic.offset)
                keywords[joint.name] = {**_joint_frames(joint, prefix), "mimic": prefixed}
    return list(keywords.values())


def _settable(joint: Joint) -> Sequence[str]:
    """What `joints` may set of a joint."""
    return () if joint.type == "fixed" else ("limits",) if joint.mimic else additions.CONTROL


def _joint_frames(joint: Joint, prefix: str) -> dict[str, Any]:
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


def _drive(joint: Joint, damping: float, friction: float, own: Mapping[str, Any]) -> dict[str, Any]:
    """Limits, start, and what resists."""
    if joint.type == "fixed":
        return {}
    lower, upper = _given(joint.name, own["limits"]) if "limits" in own else _limits(joint)
    return {
        "limits": (lower, upper),
        "start": min(max(0.0, lower), upper),
        "damping": damping,
        "friction": friction,
        "torque_limit": _torque_limit(joint, own),
    }


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
    raise ValueError(
        f"joint {joint.name!r} is {joint.type} and has {has}; "
        f"joints={{{joint.name!r}: {{'limits': (lower, upper)}}}} says which hold"
    )


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
        text = (
            f"joint {joint.name!r} follows {name!r} from {least:.6g} to {most:.6g}, and its own "
            f"limits are from {lower:.6g} to {upper:.6g}: they differ by less than 1 %, and those "
            f"of {name!r} hold."
        )
        warn([(text, text)], text)
        return
    raise ValueError(
        f"joint {joint.name!r} has limits from {lower} to {upper} and follows {name!r} from "
        f"{least} to {most}; joints={{{name!r}: {{'limits': ...}}}} or "
        f"joints={{{joint.name!r}: {{'limits': ...}}}} says which hold, mimic_limits='leader' "
        "that those of the joints that lead do, for all"
    )
