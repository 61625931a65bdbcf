"""Planar pushing: a round pusher drives a box over a table to a wall (Section VI-A, task 1).

It succeeds when the box lies with its long side at the wall. The box is captured while it lies in
the region that the pusher is about to sweep, given its instantaneous centre of rotation.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import Box, Cylinder, Scene, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import yes_or_no
from energymargin.tasks.base import NONE_DRAWN, STEP, Params
from energymargin.tasks.questions import FrictionTask, swept_from
from energymargin.tasks.scripted import Drive

# Unless another source is named, a number is the one of the authors' public implementation
# (EnergyMarginDynCage, 2024).

# The scene. The table is the plane z = 0.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
OBJECT_SIZE = (1.2, 0.4, 0.1)  # m
OBJECT_MASS = 1.0  # kg
EFFECTOR_RADIUS = 0.1  # m
EFFECTOR_HEIGHT = 0.1  # m
EFFECTOR_MASS = 4.0  # kg
WALL_SIZE = (14.0, 1.0, 0.1)  # m
WALL_POSITION = (5.0, 2.1, 0.05)  # m; so its near face is at y = 1.6 m
FRICTION_RANGE = (0.2, 0.4)  # coefficient of all bodies, one draw a trajectory
FRICTION_MIDDLE = 0.3  # the forces below are for this friction, and grow with it

# The start of a trajectory: uniform draws.
OBJECT_START = (1.0, 0.4)  # m
OBJECT_YAW_SPREAD = math.radians(10.0)  # rad, to both sides
EFFECTOR_X_SPREAD = 0.5  # m, to both sides of the object's centre
EFFECTOR_GAP_RANGE = (0.35, 0.37)  # m, from the object's centre back to the pusher's
EFFECTOR_SPEED_RANGE = (0.2, 0.5)  # m/s, along y

# The drive: a force on the pusher, drawn anew at each step.
DRIVE_SIDEWAYS = 0.4  # N, to both sides along x
DRIVE_AHEAD_RANGE = (7.0, 11.0)  # N along y, times friction / FRICTION_MIDDLE

# The success set: the paper asks for the long side at the wall, which is y = 1.4 m; the width is
# ours.
SUCCESS_Y = 1.4  # m
SUCCESS_HALF_WIDTH = 0.2  # m

# The capture set: the paper names the swept sector, these are its measures.
SWEPT: dict[str, Any] = {
    "half_width": 0.57,  # m, to both sides of the pusher's path
    "behind": 0.057,  # m of path behind the pusher
    "ahead": 1.5,  # s of its motion ahead
    "least_speed": 0.3,  # m/s; a slower pusher has no clear direction, so it gets a disc
    "disc_radius": 0.855,  # m
}

# The disturbance.
FORCE_BOUND = 0.8  # N on x and on y, times friction / FRICTION_MIDDLE
TORQUE_BOUND = 0.05  # N m about z, times friction / FRICTION_MIDDLE
LONGEST_EDGE = 0.5  # s
WORKSPACE = (-0.1, 2.1)  # m, of the object's x and y
RATE = 5.0  # 1/J, lambda of eq. 4


class PushTask(FrictionTask):
    """Push a box over a table to a wall, with a round pusher (planar)."""

    name = "push"
    # "drive" is the default: the table's friction stops a pusher that coasts before the box slips
    # off, and the capture score's AUC falls by .02, its AP by .04.
    length = 2.5  # s
    longest_edge, rate, friction_range = LONGEST_EDGE, RATE, FRICTION_RANGE

    def __init__(
        self, friction: float | None = None, effector: str = "drive", follow: bool = True
    ) -> None:
        """A task of these parameters; raises ValueError on others.

        `friction` is the coefficient of all bodies; None draws one for each trajectory.
        `effector`: "drive", each edge of the search starts with the pusher at its velocity of the
        start state, or "coast", it is not actuated. `follow`: the capture set also moves with the
        pusher.
        """
        super().__init__(friction, effector)
        self.follow = yes_or_no("follow", follow)

    def scene(self, params: Params) -> Scene:
        """Table, wall, box and pusher, all of the friction in `params`."""
        return scene(params["friction"])

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """A random start state, drawn again while box and pusher overlap."""
        while True:
            yaw = random.uniform(-OBJECT_YAW_SPREAD, OBJECT_YAW_SPREAD)
            x = OBJECT_START[0] + random.uniform(-EFFECTOR_X_SPREAD, EFFECTOR_X_SPREAD)
            y = OBJECT_START[1] - random.uniform(*EFFECTOR_GAP_RANGE)
            speed = (0.0, random.uniform(*EFFECTOR_SPEED_RANGE), 0.0)
            pusher = {"position": (x, y, EFFECTOR_HEIGHT / 2), "velocity": speed}
            state: Floats = self.layout.pack(object={"yaw": yaw}, effector=pusher)
            if world.distance(state, "object", "effector") > 0:
                return state

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """A force on the pusher, drawn anew at each step."""
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, 0] = random.uniform(-DRIVE_SIDEWAYS, DRIVE_SIDEWAYS, self.steps)
        ahead = random.uniform(*DRIVE_AHEAD_RANGE, self.steps)
        wrenches[:, 1] = ahead * params["friction"] / FRICTION_MIDDLE
        return Drive({"effector": wrenches})

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Wrenches act on the box; one that has left the workspace has no bounds left to keep."""
        scale = params["friction"] / FRICTION_MIDDLE
        force, torque = FORCE_BOUND * scale, TORQUE_BOUND * scale
        workspace = _between("x", *WORKSPACE) & _between("y", *WORKSPACE)
        within = workspace if workspace.contains(self.layout, state) else None
        return {"force": (force, force, 0.0), "torque": (0.0, 0.0, torque), "within": within}

    def captured(self, state: Floats, params: Params = NONE_DRAWN) -> regions.Region:
        """Z_cap(z) of a state, shape (n,).

        The box lies in what the pusher was about to sweep at z (the paper's set) and, if the task
        is to `follow`, still does from where the pusher has come to: a box that was passed by is
        lost, wherever it lies. At z itself, which the labels ask for, both are the same.
        """
        motion = swept_from(self.layout, state, "effector")
        return _swept(at=motion) & _swept() if self.follow else _swept(at=motion)

    def captured_throughout(self, params: Params) -> regions.Region:
        """Z_cap of every instant: the box lies in what the pusher is about to sweep."""
        return _swept()

    def succeeded(self, params: Params = NONE_DRAWN) -> regions.Region:
        """Z_suc: the box lies with its long side at the wall."""
        return _between("y", SUCCESS_Y - SUCCESS_HALF_WIDTH, SUCCESS_Y + SUCCESS_HALF_WIDTH)


def _swept(at: dict[str, Any] | None = None) -> regions.Region:
    """What the pusher is about to sweep, from a fixed motion or from where it is."""
    return regions.Swept("object", by="effector", at=at, **SWEPT)


def scene(friction: float) -> Scene:
    """Table, wall, box and pusher, all of one friction coefficient."""
    made = Scene(gravity=GRAVITY, step=STEP)
    made.add_plane("table", friction=friction)
    add = partial(made.add_body, friction=friction)
    add("wall", Box(WALL_SIZE), mass=0, position=WALL_POSITION)
    place = (*OBJECT_START, OBJECT_SIZE[2] / 2)
    add("object", Box(OBJECT_SIZE), mass=OBJECT_MASS, position=place, role="object")
    behind = (OBJECT_START[0], OBJECT_START[1] - EFFECTOR_GAP_RANGE[1], EFFECTOR_HEIGHT / 2)
    pusher = Cylinder(EFFECTOR_RADIUS, EFFECTOR_HEIGHT)
    add("effector", pusher, mass=EFFECTOR_MASS, position=behind, role="effector")
    return made


def _between(axis: str, low: float, high: float) -> regions.Region:
    """The object's centre between two planes across the "x" or "y" axis [m]."""
    normal = np.array([axis == "x", axis == "y", 0.0], dtype=float)
    return regions.HalfSpace("object", normal, high) & regions.HalfSpace("object", -normal, -low)
