"""The authors' simulated grasps of Table I."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Region, Scene, World
from energymargin.tasks.base import STEP, Params
from energymargin.tasks.questions import drawn
from energymargin_paper.paper.authors.task import DEEPEST, SimulatedTask, Vector

__all__ = ["PublishedGrasp"]

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
OBJECT_EDGE = 0.6  # m
TABLE_MASS, TABLE_SIZE = 100.0, (4.0, 4.0, 0.2)  # kg, m
TABLE_TOP = 0.3087  # m, above the recorded height of the table: boxes rest there
SINKING = 0.7  # m/s^2, of the table
SUNK = 1e-4  # m, from which on it sinks
HAND = (-1.1, 0.0, 1.9)  # m
ROLL, PITCH = -math.pi / 2, -0.3  # rad, of the hand
FINGERS = ("1", "2", "middle")
BENDING = tuple(f"finger_{finger}_joint_{n}" for finger in FINGERS for n in (1, 2, 3))
SPREADING = ("palm_finger_1_joint", "palm_finger_2_joint")

# Not recorded: this control meets the next recorded frame best, within 2 cm in the median.
TARGETS = (0.39, 0.385, 0.4)  # rad, of each finger's joints
STIFFNESS, DAMPING, TORQUE = 1000.0, 100.0, 10.0  # N m/rad, N m s/rad, N m

ACCELERATION = 3.0  # m/s^2 on x and z
LEAST_HEIGHT, FALL = 0.25, 0.5  # m, m/s

OPENING, MOST_OPENED = 0.01, 40  # rad, by which a finger is opened at a time; how often


class PublishedGrasp(SimulatedTask):
    """Grasp a box from a sinking table: the authors' simulated trajectories."""

    name = "published-grasp"
    plane = ("x", "z")
    part = "grasp"
    columns = (
        *("xo", "zo", "yo", "thetaxo", "thetayo", "thetazo"),
        *("vxo", "vyo", "vzo", "omegaxo", "omegayo", "omegazo"),
        *(f"j{n}" for n in range(9)),
        "zt",
        *(f"jv{n}" for n in range(9)),
        "vzt",
    )
    interval = 0.2
    duration, rate = 0.1, 3.0
    effector = "coast"
    drawn: ClassVar = {"friction": "lateral_friction_coef", "mass": "mass_object"}

    def __init__(self, data: str = ".") -> None:
        """`data`: the folder of the published data, which has the hand."""
        self.data = str(data)
        self._last: tuple[dict[str, float], Scene] | None = None

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return {"data": self.data}

    def scene(self, params: Params) -> Scene:
        """Table, box and hand, with the friction coefficient of all and the mass of the box."""
        if self._last is None or self._last[0] != params:
            self._last = (dict(params), self._made(params, TARGETS * len(FINGERS), held=True))
        return self._last[1]

    def search_scene(self, state: NDArray[np.float64], params: Params) -> Scene:
        """The scene with fingers that hold their angles, and a table that falls freely once it has
        begun to sink."""
        scene = self.scene(params)
        joints = scene.unpack(state)["joints"]
        targets = tuple(float(joints[joint]["position"]) for joint in BENDING)
        table = state[scene.slice("table").start + 2] + TABLE_SIZE[2] / 2 - TABLE_TOP
        return self._made(params, targets, held=bool(table >= -SUNK))

    def _made(self, params: Params, targets: tuple[float, ...], *, held: bool) -> Scene:
        """`targets`: of the joints in BENDING [rad]; `held`: whether the table's weight is."""
        from energymargin.scenes import from_urdf

        friction = drawn("friction", params, None)
        with_hand = from_urdf(
            Path(self.data) / "robotiq" / "robotiq10.urdf",
            _table_and_box(friction, drawn("mass", params, None), held),
            position=HAND,
            orientation=_orientation(ROLL, PITCH, 0.0),
            friction=friction,
            role="effector",
            joints=_finger_control(targets),
            inertia="shapes",
            self_collision=False,
            decompose=False,  # the authors' simulator takes the hull of each link's mesh
        )
        # The authors' table is small: in their states fingers reach below its top.
        links = [body.name for body in with_hand.bodies if body.name not in ("table", "object")]
        for link in links:
            with_hand.disable_collisions("table", link)
        return with_hand

    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (n,), of a row of `columns`."""
        x, z, y, *rest = row.tolist()
        turns, velocity, spin = rest[:3], rest[3:6], rest[6:9]
        joints, table, rates, table_speed = rest[9:18], rest[18], rest[19:28], rest[28]
        height = table + TABLE_TOP - TABLE_SIZE[2] / 2
        return np.asarray(
            scene.pack(
                object={
                    "position": (x, y, z),
                    "orientation": _orientation(*turns),
                    "velocity": tuple(velocity),
                    "angular_velocity": tuple(spin),
                },
                table={"position": (0.0, 0.0, height), "velocity": (0.0, 0.0, table_speed)},
                joints={
                    name: {"position": position, "velocity": rate}
                    for name, position, rate in zip(BENDING, joints, rates, strict=True)
                },
            )
        )

    def separated(self, world: World, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, with fingers opened that are in the box by more than a centimetre."""
        opened = state.copy()
        for finger in FINGERS:
            first = world.scene.joint_slice(f"finger_{finger}_joint_1").start
            for _ in range(MOST_OPENED):
                links = (f"finger_{finger}_link_{n}" for n in (1, 2, 3))
                if min(world.distance(opened, link, "object") for link in links) > -DEEPEST:
                    break
                opened[first] -= OPENING
        return opened

    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """The table sinks."""
        return {"table": (0.0, 0.0, -TABLE_MASS * SINKING, 0.0, 0.0, 0.0)}

    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """The box is in the hand; the same for all states."""
        return self.captured_throughout(params)

    def captured_throughout(self, params: Params) -> Region:
        """The box is above a height, and does not fall fast."""
        high = regions.HalfSpace("object", (0.0, 0.0, -1.0), -LEAST_HEIGHT)
        return high & regions.Speed("object", FALL, along=(0.0, 0.0, -1.0))

    def succeeded(self, params: Params) -> Region:
        """As captured."""
        return self.captured_throughout(params)

    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """On x and z, no torque."""
        force = ACCELERATION * drawn("mass", params, None)
        return (force, 0.0, force), (0.0, 0.0, 0.0)


def _table_and_box(friction: float, mass: float, held: bool) -> Scene:
    made = Scene(gravity=GRAVITY, step=STEP)
    made.add_body(
        "table",
        Box(TABLE_SIZE),
        mass=TABLE_MASS,
        position=(0.0, 0.0, TABLE_TOP - TABLE_SIZE[2] / 2),
        friction=friction,
        linear_factor=(0.0, 0.0, 1.0),
        angular_factor=(0.0, 0.0, 0.0),
        force=(0.0, 0.0, -TABLE_MASS * GRAVITY[2] if held else 0.0),
    )
    made.add_body(
        "object",
        Box((OBJECT_EDGE,) * 3),
        mass=mass,
        position=(-0.9, 0.0, TABLE_TOP + OBJECT_EDGE / 2),
        friction=friction,
        role="object",
    )
    return made


def _finger_control(targets: tuple[float, ...]) -> dict[str, dict[str, Any]]:
    """By joint, as `from_urdf` takes it: drives close the fingers, which do not spread."""
    control: dict[str, dict[str, Any]] = {joint: {"held": True} for joint in SPREADING}
    for joint, target in zip(BENDING, targets, strict=True):
        control[joint] = {
            "target": target,
            "stiffness": STIFFNESS,
            "damping": DAMPING,
            "torque_limit": TORQUE,
        }
    return control


def _orientation(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """The quaternion x, y, z, w of turns about x, then y, then z [rad]."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_euler("xyz", (roll, pitch, yaw)).as_quat().tolist()
    return x, y, z, w
