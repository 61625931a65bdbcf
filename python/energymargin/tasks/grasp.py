"""Grasping from a table: a three-finger gripper clenches a box and lifts it (Section VI-A, task 4).

The hand stays and the table sinks, which is the lift as the hand sees it. It succeeds when the box
is 10 cm above the desktop and does not fall. The box is captured while it is in the hand.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar

import numpy as np

from energymargin import regions
from energymargin._core import Box, Scene, World
from energymargin.base.aliases import Floats
from energymargin.model.scenes import data_file, from_urdf
from energymargin.tasks.base import Params
from energymargin.tasks.questions import FrictionTask
from energymargin.tasks.scripted import Drive

# Numbers of the authors' public implementation (EnergyMarginDynCage, 2024) are named so; what the
# paper says is named so; the others are ours, chosen so that about half of the grasps hold.

# The scene, with the palm above the origin, looking down. z = 0 is the desktop at the start.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
GRIPPER = "three_finger_gripper.urdf"
FINGERS = (1, 2, 3)
PALM_HEIGHT = 0.21  # m; so the second links meet the box, a little above its middle
FACING_DOWN = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # the palm's y axis along -z
OBJECT_EDGE = 0.10  # m; the paper
OBJECT_MASS = 1.0  # kg; that of water
OBJECT_FRICTION = 1.0  # so a contact's coefficient is that of the fingers
TABLE_SIZE = (0.6, 0.6, 0.1)  # m
TABLE_MASS = 1e5  # kg; so what stands on it does not move it
TABLE_FRICTION = 0.5
SINKING: dict[str, Any] = {"linear_factor": (0, 0, 1), "angular_factor": (0, 0, 0)}
OVERLAP = 1e-6  # m of the box in the table, which makes the contact there from the first step on

# The fingers: position control with compliance. Palm joints hold (public implementation).
OPEN = (0.0495, 0.0, -0.0523)  # rad, of a finger's bending joints: at their limits
CLENCHED = (0.5, 0.6, -0.3)  # rad; the box stops the fingers on the way, at about (0.2, 0.5, -0.3)
STIFFNESS = 2.5  # N m/rad; so a finger presses with 6 to 13 N, and half of the frictions hold 10 N
DAMPING = 0.05  # N m s/rad; the fingers close in 0.1 s without a bounce

# One draw a trajectory.
FRICTION_RANGE = (0.1, 1.0)  # of the gripper's links; public implementation
CLENCH_RANGE = (0.8, 1.2)  # share of CLENCHED that the fingers aim at
OBJECT_SPREAD = 0.01  # m, of the box on x and y, to both sides
OBJECT_YAW_SPREAD = math.radians(5.0)  # rad, to both sides

# The script.
CLENCH_TIME = 0.05  # s; public implementation
TARGET_NOISE = 0.02  # rad on each target, to both sides, drawn anew at each step
LIFT_TIME = 0.3  # s; public implementation
LIFT_DURATION = 0.1  # s, from rest to
# A steady lift, in which a box that slips takes its time, instead of all but a free fall of the
# table (public implementation), which leaves no state between held and lost.
LIFT_SPEED = 0.1  # m/s; so the desktop is 0.165 m below at the end

# The success set.
SUCCESS_HEIGHT = 0.10  # m of the box above the desktop; the paper
SUCCESS_SPEED = 0.05  # m/s; a box that falls is faster

# The capture set: below this height of its centre the box has slipped out of the fingers.
CAPTURE_HEIGHT = -0.01  # m
CAPTURE_SPEED = 0.5  # m/s; a box that is faster has left the fingers, or is about to

# The disturbance.
ACCELERATION_BOUND = 3.0  # m/s^2 of the object's mass on all axes; public implementation
TORQUE_BOUND = 0.05  # N m about all axes: the force, a third of half an edge off the middle
LONGEST_EDGE = 0.1  # s; public implementation
RATE = 3.0  # 1/J, lambda of eq. 4; public implementation


class GraspTask(FrictionTask):
    """Grasp a box with a three-finger gripper and lift it from a table.

    `friction`: the coefficient of the gripper's links; None draws one for each trajectory.
    `effector`: "coast", the fingers are held by their compliance alone, or "drive", each edge of
    the search starts with the velocities that they have at the start.
    """

    name = "grasp"
    # "coast", the paper's reading, is the default: the fingers stand still while they hold, and
    # both readings predict alike.
    plane = ("x", "z")
    length = 2.0  # s
    longest_edge, rate, friction_range = LONGEST_EDGE, RATE, FRICTION_RANGE
    usual: ClassVar[Params] = {"clench": 1.0}

    def scene(self, params: Params) -> Scene:
        """Table, box and gripper, whose fingers clench."""
        made = Scene(gravity=GRAVITY, step=self.step)
        below, held = (0.0, 0.0, -TABLE_SIZE[2] / 2), tuple(-TABLE_MASS * np.array(GRAVITY))
        add = partial(made.add_body, mass=TABLE_MASS, friction=TABLE_FRICTION)
        add("table", Box(TABLE_SIZE), position=below, force=held, **SINKING)
        add = partial(made.add_body, mass=OBJECT_MASS, friction=OBJECT_FRICTION, role="object")
        above = (0.0, 0.0, OBJECT_EDGE / 2 - OVERLAP)
        add("object", Box((OBJECT_EDGE,) * 3), position=above)
        from_urdf(
            data_file(GRIPPER),
            made,
            position=(0.0, 0.0, PALM_HEIGHT),
            orientation=FACING_DOWN,
            friction=params["friction"],
            role="effector",
            joints=_control(params),
            inertia="shapes",
        )
        return made

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """The friction, if the task leaves it open, and how far the fingers clench."""
        return {**super().draw(random), "clench": random.uniform(*CLENCH_RANGE)}

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """The box on the table, about under the middle of the open hand."""
        x, y = random.uniform(-OBJECT_SPREAD, OBJECT_SPREAD, 2)
        yaw = random.uniform(-OBJECT_YAW_SPREAD, OBJECT_YAW_SPREAD)
        return world.scene.pack(object={"position": (x, y, OBJECT_EDGE / 2 - OVERLAP), "yaw": yaw})

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """The fingers wait, and then clench with some noise; the table sinks."""
        times = np.arange(self.steps) * self.step
        targets = {}
        for joint, target in _clenched(params).items():
            clenched = target + random.uniform(-TARGET_NOISE, TARGET_NOISE, self.steps)
            targets[joint] = np.where(times < CLENCH_TIME, OPEN[int(joint[-1]) - 1], clenched)
        sinking = (times >= LIFT_TIME) & (times < LIFT_TIME + LIFT_DURATION)
        table = np.zeros((self.steps, 6))
        table[sinking, 2] = -TABLE_MASS * LIFT_SPEED / (sinking.sum() * self.step)
        return Drive({"table": table}, targets)

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Wrenches act on the box.

        The fingers' control keeps aiming at the clench, that of `params` or CLENCHED, and the table
        keeps the speed it has.
        """
        return {"force": (OBJECT_MASS * ACCELERATION_BOUND,) * 3, "torque": (TORQUE_BOUND,) * 3}

    def captured_throughout(self, params: Params) -> regions.Region:
        """Z_cap of every instant: the box has not slipped out of the hand, nor does it fall.

        Downwards is the way out that counts: beside the hand nothing carries a box.
        """
        high = regions.HalfSpace("object", (0.0, 0.0, -1.0), -CAPTURE_HEIGHT)
        return high & regions.Speed("object", CAPTURE_SPEED)

    def succeeded(self, params: Params) -> regions.Region:
        """Z_suc: the box is well above the desktop, and does not fall."""
        height = TABLE_SIZE[2] / 2 + SUCCESS_HEIGHT + OBJECT_EDGE / 2
        lifted = regions.HalfSpace("object", (0.0, 0.0, -1.0), -height, frame="table")
        return lifted & regions.Speed("object", SUCCESS_SPEED)


def _joint(finger: int, number: int) -> str:
    return f"finger_{finger}_joint_{number}"


def _control(params: Params) -> dict[str, dict[str, Any]]:
    """Keywords of each joint: the bases of the fingers are held, the others clench."""
    control: dict[str, dict[str, Any]] = {_joint(finger, 0): {"held": True} for finger in FINGERS}
    for name, target in _clenched(params).items():
        law = {"stiffness": STIFFNESS, "damping": DAMPING}
        control[name] = {"start": OPEN[int(name[-1]) - 1], "target": target, **law}
    return control


def _clenched(params: Params) -> dict[str, float]:
    """Where the control of each bending joint aims [rad]."""
    angles = list(enumerate(CLENCHED, 1))
    return {_joint(f, k): params["clench"] * angle for f in FINGERS for k, angle in angles}
