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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Scene

Vector = NDArray[np.float64]
FeaturesOf = Callable[[Vector], Vector]
"""A function of states, shape (N, n), that returns their features, shape (N, F)."""

PLACES, SPEEDS = ("x", "y", "z"), ("vx", "vy", "vz")
OF_BODY = (*PLACES, "yaw", "tilt_x", "tilt_y", "tilt_z", *SPEEDS, "wx", "wy", "wz")
OF_PAIR = (*PLACES, *SPEEDS, "distance")


@dataclass(frozen=True, eq=False)
class Layout:
    """Which numbers of a state are whose."""

    bodies: dict[str, int]
    """By body that moves freely: the first of its 13 numbers."""
    objects: list[str]
    """Those of them that are objects."""
    joints: dict[str, int]
    """By joint: the first of its two numbers."""
    dimension: int
    """Numbers of a state."""

    @staticmethod
    def of(scene: Scene) -> Layout:
        """That of a scene."""
        places = {body.name: _place(scene, body.name) for body in scene.bodies}
        bodies = {name: place for name, place in places.items() if place is not None}
        objects = [b.name for b in scene.bodies if b.role == "object" and b.name in bodies]
        joints = {joint.name: scene.joint_slice(joint.name).start for joint in scene.joints}
        return Layout(bodies, objects, joints, scene.dimension)

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Each object, after each body that is none."""
        others = [name for name in self.bodies if name not in self.objects]
        return [(other, own) for own in self.objects for other in others]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the F features."""
        return (
            *(f"{body}.{what}" for body in self.bodies for what in OF_BODY),
            *(f"{other}_in_{body}.{what}" for other, body in self.pairs for what in OF_PAIR),
            *(f"{joint}.{what}" for joint in self.joints for what in ("position", "velocity")),
        )

    def features(self, states: Vector) -> Vector:
        """Of states, shape (N, n): the features, shape (N, F)."""
        bodies = {name: states[:, k : k + 13].T for name, k in self.bodies.items()}
        turned = {name: _rotations(body[3:7]) for name, body in bodies.items()}
        rows = [
            row
            for body, turn in zip(bodies.values(), turned.values(), strict=True)
            for row in (*body[:3], np.arctan2(turn[1, 0], turn[0, 0]), *turn[2], *body[7:])
        ]
        for other, own in self.pairs:
            rows += _seen_from(bodies[own], turned[own], bodies[other])
        rows += [states[:, k + place] for k in self.joints.values() for place in (0, 1)]
        return np.array(rows).reshape(len(rows), len(states)).T


def _place(scene: Scene, name: str) -> int | None:
    try:
        return int(scene.slice(name).start)
    except ValueError:  # it is fixed, or a link
        return None


def _rotations(quaternions: Vector) -> Vector:
    """Of N quaternions x, y, z, w, shape (4, N): the rotation matrices, shape (3, 3, N)."""
    x, y, z, w = quaternions
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _seen_from(body: Vector, rotation: Vector, other: Vector) -> list[Vector]:
    """Place and velocity of another body in a body's frame."""
    apart, (p, q, r) = other[:3] - body[:3], body[10:]
    x, y, z = apart
    turning = np.array([q * z - r * y, r * x - p * z, p * y - q * x])  # a point fixed to the body
    speed = other[7:10] - body[7:10] - turning
    place, velocity = (np.einsum("jik,jk->ik", rotation, each) for each in (apart, speed))
    return [*place, *velocity, np.sqrt((apart * apart).sum(axis=0))]
