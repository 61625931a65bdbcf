"""Links without mass are frames: what they carry is part of the link they are fixed to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from energymargin.limits import Limit
from energymargin.scenes.poses import Pose
from energymargin.scenes.urdf_model import Geometry, Link, Robot

__all__ = ["without_frames"]


def without_frames(robot: Robot, limit: Limit, *, free: bool) -> Robot:
    """The same robot with a mass for each link that can move.

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
        """The link that a frame is part of at last."""
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
