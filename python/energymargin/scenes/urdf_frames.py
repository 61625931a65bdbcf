"""Links without mass are frames: what they carry is part of the link they are fixed to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from energymargin.scenes.poses import Pose
from energymargin.scenes.urdf_model import Geometry, Joint, Link, Robot

__all__ = ["without_frames"]


def without_frames(robot: Robot, *, free: bool) -> Robot:
    """The same robot with a mass for each link that can move.

    A `free` robot whose root has no mass has its base in the link that is fixed to the root.
    Raises ValueError on a link that moves and has no mass.
    """
    if free and robot.links[robot.root].mass == 0.0:
        robot = without_frames(_onto_child(robot), free=True)
    for joint in robot.joints.values():
        if robot.links[joint.child].mass > 0.0:
            continue
        if joint.type != "fixed":
            raise ValueError(
                f"link {joint.child!r} has no mass and moves with joint {joint.name!r}, "
                "expected an <inertial> with a mass above 0"
            )
        return without_frames(_merged(robot, joint, joint.child, joint.parent), free=free)
    return robot


def _onto_child(robot: Robot) -> Robot:
    """The root merged into the one link that is fixed to it."""
    fixed = [j for j in robot.joints.values() if j.parent == robot.root and j.type == "fixed"]
    if len(fixed) != 1:
        raise ValueError(
            f"link {robot.root!r} has no mass, expected a root with mass, or one link fixed to it, "
            "for base='free'"
        )
    merged = _merged(robot, fixed[0], robot.root, fixed[0].child)
    return replace(merged, root=fixed[0].child, base=robot.base @ fixed[0].origin)


def _merged(robot: Robot, joint: Joint, frame: str, into: str) -> Robot:
    """Without the frame at one end of a fixed joint: what it carries is carried by the other."""
    at = joint.origin if into == joint.parent else np.asarray(np.linalg.inv(joint.origin), float)
    links = dict(robot.links)
    links[into] = _carrying(links[into], links.pop(frame), at)
    joints = {
        name: replace(other, parent=into, origin=at @ other.origin)
        if other.parent == frame
        else other
        for name, other in robot.joints.items()
        if name != joint.name
    }
    merged = {name: into if of == frame else of for name, of in robot.merged.items()}
    return replace(robot, links=links, joints=joints, merged={**merged, frame: into})


def _carrying(link: Link, frame: Link, at: Pose) -> Link:
    """A link with the shapes of a frame that is fixed to it."""
    if not frame.geometries:
        return link
    if link.geometries and link.friction != frame.friction:
        raise ValueError(
            f"link {frame.name!r} has no mass and is part of {link.name!r}, which has another "
            "friction; ignore=('lateral_friction',) and frictions={...} say which one holds"
        )
    shapes = tuple(Geometry(shape, at @ pose) for shape, pose in frame.geometries)
    return replace(link, geometries=link.geometries + shapes, friction=frame.friction)
