"""The authors' simulated topples of Table I."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Region, Scene, Sphere
from energymargin.tasks.base import STEP, Params
from energymargin.tasks.questions import drawn
from energymargin_paper.paper.authors.task import SimulatedTask, Vector

__all__ = ["PublishedTopple"]

# With the box's weight a rollout meets the next recorded frame of a box that topples to 8 mm in the
# median; without it, to 46 mm, and boxes go over in half of the time.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
OBJECT_EDGE = 4.0  # m
OBJECT_MASS = 0.3  # kg
FINGER_RADIUS, FINGER_MASS, FINGER_HEIGHT = 0.3, 0.1, 3.7  # m, kg, m
BASE_FRICTION, TIP_FRICTION = 0.0, 0.2
STIFFNESS, REST_LENGTH = 2.1, 3.0  # N/m, m; fitted to the base's motion, as the push

PUSH = 4.1  # N along x, on the base

ACCELERATION = 1.0  # m/s^2 on x, of the box
TORQUE_BOUND = 0.8  # N m: 1 rad/s^2 times the inertia of the authors' settings
EFFORTS = 50.0  # by which the bounds of the efforts are larger
PIVOT, PIVOT_SPEED = (2.0, 0.0, -2.0), 1.5  # m, m/s
TOPPLED = math.pi / 2 - 0.052  # rad


class PublishedTopple(SimulatedTask):
    """Topple a box with a springy fingertip: the authors' simulated trajectories."""

    name = "published-topple"
    plane = ("x", "z")
    part = "topple"
    columns = ("xo", "yo", "thetao", "vxo", "vyo", "omegao", "xg1", "xg2", "vxg1", "vxg2")
    interval = None
    duration, rate = 0.1, 3.0
    drawn: ClassVar = {"friction": "lateral_friction_coef"}

    def scene(self, params: Params) -> Scene:
        """Ground, box and finger, with the friction coefficient of ground and box."""
        return _scene(drawn("friction", params, None), GRAVITY)

    def search_scene(self, state: NDArray[np.float64], params: Params) -> Scene:
        """The scene without gravity, which their search leaves out."""
        return _scene(drawn("friction", params, None), (0.0, 0.0, 0.0))

    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (39,), of a row of `columns`."""
        x, z, pitch, vx, vz, rate, base, tip, base_speed, tip_speed = row.tolist()
        return np.asarray(
            scene.pack(
                object={
                    "position": (x, 0.0, z),
                    "orientation": (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2)),
                    "velocity": (vx, 0.0, vz),
                    "angular_velocity": (0.0, rate, 0.0),
                },
                base={
                    "position": (base, 0.0, FINGER_HEIGHT),
                    "velocity": (base_speed, 0.0, 0.0),
                },
                fingertip={
                    "position": (tip, 0.0, FINGER_HEIGHT),
                    "velocity": (tip_speed, 0.0, 0.0),
                },
            )
        )

    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """A steady push on the finger's base."""
        return {"base": (PUSH, 0.0, 0.0, 0.0, 0.0, 0.0)}

    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """The point that was the far lower edge at the start is slow; the same for all states."""
        return self.captured_throughout(params)

    def captured_throughout(self, params: Params) -> Region:
        """As `captured`."""
        return regions.Speed("object", PIVOT_SPEED, point=PIVOT, along_world=True)

    def succeeded(self, params: Params) -> Region:
        """The box has turned by 90 degrees, or nearly."""
        upright = (0.0, 0.0, 1.0)
        return ~regions.Tilt("object", upright, upright, TOPPLED)

    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """On x, and about y."""
        return (ACCELERATION * OBJECT_MASS, 0.0, 0.0), (0.0, TORQUE_BOUND, 0.0)

    def effort_bounds(self, params: Params) -> tuple[Vector, Vector]:
        """Fifty times as large."""
        wrench = self.bounds(params)
        force, torque = ((EFFORTS * x, EFFORTS * y, EFFORTS * z) for x, y, z in wrench)
        return force, torque


def _scene(friction: float, gravity: Vector) -> Scene:
    made = Scene(gravity=gravity, step=STEP)
    made.add_plane("ground", friction=friction)
    made.add_body(
        "object",
        Box((OBJECT_EDGE,) * 3),
        mass=OBJECT_MASS,
        position=(6.0, 0.0, OBJECT_EDGE / 2),
        friction=friction,
        role="object",
        linear_factor=(1.0, 0.0, 1.0),
        angular_factor=(0.0, 1.0, 0.0),
    )
    for name, x, own in (("base", 2.0, BASE_FRICTION), ("fingertip", 3.5, TIP_FRICTION)):
        made.add_body(
            name,
            Sphere(FINGER_RADIUS),
            mass=FINGER_MASS,
            position=(x, 0.0, FINGER_HEIGHT),
            friction=own,
            role="effector",
            linear_factor=(1.0, 0.0, 0.0),
            angular_factor=(0.0, 0.0, 0.0),
        )
    made.add_spring("base", "fingertip", stiffness=STIFFNESS, rest_length=REST_LENGTH)
    return made
