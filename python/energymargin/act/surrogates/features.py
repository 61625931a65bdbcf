"""Named numbers of a state that trees can tell apart: where bodies are, how fast, and as an object
sees the others.

The numbers of a body are `object.x`, `.y`, `.z` [m], `.yaw` [rad], `.tilt_x`, `.tilt_y`, `.tilt_z`
(the vertical in the body's frame), `.vx`, `.vy`, `.vz` [m/s], `.wx`, `.wy`, `.wz` [rad/s]. A body
that is no object, as an object sees it in its own frame, has `effector_in_object.x` to `.vz`, and
`.distance` [m]. They do not change if both are moved or turned together. A joint has
`finger.position` and `finger.velocity`.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Scene

Vector = NDArray[np.float64]
FeaturesOf = Callable[[Vector], Vector]
"""A function of states, shape (N, n), that returns their features, shape (N, F)."""

OF_PAIR = ("x", "y", "z", "vx", "vy", "vz", "distance")
OF_BODY = (*OF_PAIR[:3], "yaw", "tilt_x", "tilt_y", "tilt_z", *OF_PAIR[3:6], "wx", "wy", "wz")


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the numbers of bodies and joints stand in a state."""

    bodies: dict[str, int]
    """First of the 13 numbers of each body that moves freely, by name."""
    pairs: list[tuple[str, str]]
    """Each body that is no object, with each object that sees it."""
    joints: dict[str, int]
    """First of the two numbers of each joint, by name."""
    dimension: int
    """Numbers of a state."""

    @staticmethod
    def of(scene: Scene) -> Layout:
        """The layout of a scene."""
        bodies = {}
        for body in scene.bodies:
            with suppress(ValueError):  # it is fixed, or a link
                bodies[body.name] = scene.slice(body.name).start
        objects = [body.name for body in scene.bodies if body.role == "object"]
        others = [name for name in bodies if name not in objects]
        pairs = [(other, seer) for seer in bodies if seer in objects for other in others]
        joints = {joint.name: scene.joint_slice(joint.name).start for joint in scene.joints}
        return Layout(bodies, pairs, joints, scene.dimension)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the F features."""
        return (
            *(f"{body}.{what}" for body in self.bodies for what in OF_BODY),
            *(f"{other}_in_{seer}.{what}" for other, seer in self.pairs for what in OF_PAIR),
            *(f"{joint}.{what}" for joint in self.joints for what in ("position", "velocity")),
        )

    def features(self, states: Vector) -> Vector:
        """Features, shape (N, F), of states, shape (N, n)."""
        bodies = {name: states[:, k : k + 13] for name, k in self.bodies.items()}
        columns = []
        for body in bodies.values():
            turn = Rotation.from_quat(body[:, 3:7]).as_matrix()
            yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
            columns += [body[:, :3], yaw, turn[:, 2], body[:, 7:]]
        for other, seer in self.pairs:
            own, apart = bodies[seer], (bodies[other] - bodies[seer])[:, :3]
            speed = (bodies[other] - own)[:, 7:10] - np.cross(own[:, 10:], apart)
            seen = Rotation.from_quat(own[:, 3:7]).inv()
            columns += [seen.apply(apart), seen.apply(speed), np.linalg.norm(apart, axis=1)]
        return np.column_stack([*columns, *(states[:, k : k + 2] for k in self.joints.values())])
