"""Balanced transport: a support bar carries a square up a steep slope (Section VI-A, task 2).

The slope is so steep that it carries no load: in its plane, x and y, gravity acts fully along -y.
It succeeds when the square arrives above the goal height, still on the support. The square is
captured while it is on the support's upper side: a support that tilts too far lets it slide off.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import Box, Scene, World
from energymargin.base.aliases import Floats
from energymargin.tasks.base import NONE_DRAWN, PLANAR, STEP, Params
from energymargin.tasks.questions import QuestionTask
from energymargin.tasks.scripted import Drive

# Unless another source is named, a number is the one of the authors' public implementation
# (EnergyMarginDynCage, 2024).

# The scene: bodies that move in the plane of the slope alone.
GRAVITY = (0.0, -9.81, 0.0)  # m/s^2
OBJECT_SIZE = (0.4, 0.4, 0.1)  # m
OBJECT_MASS = 1.0  # kg
SUPPORT_SIZE = (1.2, 0.2, 0.1)  # m
SUPPORT_MASS = 1000.0  # kg
HOLDING = -(SUPPORT_MASS + OBJECT_MASS) * GRAVITY[1]  # N along y, against both weights
FRICTION = 0.4  # coefficient of every body, so 0.16 in a contact: it slides from 9.1 deg of tilt
FLOOR_SIZE = (40.0, 0.2, 0.1)  # m; ours, as wide as a fallen square can get
FLOOR_POSITION = (5.5, -0.1, 0.0)  # m; so that its upper side is at y = 0

# The start of a trajectory: uniform draws.
OBJECT_START = (5.5, 4.8)  # m
SUPPORT_Y = 4.5  # m
SUPPORT_X_SPREAD = 0.3  # m, to both sides of the object's centre
SPEED_SPREAD = 0.01  # m/s, to both sides of 0, on both axes and of both bodies
OVERLAP = 1e-5  # m, of the support with the square; ours: contact between boxes needs some

# The drive: on the support, drawn anew at each step, and the force that holds its weight.
LIFT_RANGE = (0.0, 1000.0)  # N along y
TORQUE_SPREAD = 1000.0  # N m about z, to both sides

# The success set: the paper asks for a goal region. The lift raises the support by 1.5 m on
# average, so a square that stays on it passes this height, which is ours.
GOAL_Y = 5.8  # m, of the object: 1 m above its start

# On the support: the object's centre is above the upper side, and in the height at which a square
# lies or stands on an edge there.
RESTING_HEIGHT = (SUPPORT_SIZE[1] + OBJECT_SIZE[1]) / 2  # m, of the object in the support's frame
HEIGHT_SPREAD = 0.1  # m, to both sides; it stands on an edge 0.083 m higher

# The disturbance.
FORCE_BOUND = 5.0  # N on x and on y, half the object's weight; no torque, as in the public code
LONGEST_EDGE = 0.5  # s
RATE = 0.5  # 1/J, lambda of eq. 4


class BalanceTask(QuestionTask):
    """Carry a square up a steep slope on a support bar (planar)."""

    name = "balance"
    # Both readings of the effector predict alike, since so heavy a support hardly feels the square;
    # "coast", the paper's, is the default.
    length = 2.5  # s
    longest_edge, rate = LONGEST_EDGE, RATE

    def __init__(self, effector: str = "coast") -> None:
        """A task of these parameters; raises ValueError on others.

        `effector`: "coast", the support is held against its own weight and the object's and not
        actuated otherwise, or "drive", each edge of the search also starts with the support at its
        velocity of the start state.
        """
        super().__init__(effector)
        self._scene = scene()

    def scene(self, params: Params) -> Scene:
        """Floor, square and support; the drive alone holds the support."""
        return self._scene

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """A random start state: the square on the support, both all but at rest."""
        x = OBJECT_START[0] + random.uniform(-SUPPORT_X_SPREAD, SUPPORT_X_SPREAD)
        speeds = random.uniform(-SPEED_SPREAD, SPEED_SPREAD, (2, 2))
        support = {"position": (x, SUPPORT_Y + OVERLAP, 0.0), "velocity": (*speeds[1], 0.0)}
        return self._scene.pack(object={"velocity": (*speeds[0], 0.0)}, effector=support)

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """Lift and torque on the support, drawn anew at each step, against its weight."""
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, 1] = -SUPPORT_MASS * GRAVITY[1] + random.uniform(*LIFT_RANGE, self.steps)
        wrenches[:, 5] = random.uniform(-TORQUE_SPREAD, TORQUE_SPREAD, self.steps)
        return Drive({"effector": wrenches})

    def afterwards(self, params: Params) -> dict[str, Floats]:
        """The support is held against its weight and the object's."""
        return {"effector": np.array([0.0, HOLDING, 0.0, 0.0, 0.0, 0.0])}

    def asked_scene(self, params: Params) -> Scene:
        """Floor, square and support, which is held against its weight and the object's."""
        return scene(HOLDING)

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Forces act on the square."""
        return {"force": (FORCE_BOUND, FORCE_BOUND, 0.0), "torque": (0.0, 0.0, 0.0)}

    def captured_throughout(self, params: Params) -> regions.Region:
        """Z_cap of every instant: the square is on the support, wherever that has come to."""
        size = (SUPPORT_SIZE[0], 2 * HEIGHT_SPREAD, math.inf)
        return regions.Box("object", (0.0, RESTING_HEIGHT, 0.0), size, frame="effector")

    def succeeded(self, params: Params = NONE_DRAWN) -> regions.Region:
        """Z_suc: the square is on the support, above the goal height."""
        high = regions.HalfSpace("object", (0.0, -1.0, 0.0), -GOAL_Y)
        return self.captured_throughout(params) & high


def scene(holding: float = 0.0) -> Scene:
    """Floor, square and support, with a force of `holding` [N] along y on the support."""
    made = Scene(gravity=GRAVITY, step=STEP)
    made.add_body("floor", Box(FLOOR_SIZE), mass=0, position=FLOOR_POSITION, friction=FRICTION)
    add = partial(made.add_body, friction=FRICTION)
    square, place = Box(OBJECT_SIZE), (*OBJECT_START, 0.0)
    add("object", square, mass=OBJECT_MASS, position=place, role="object", **PLANAR)
    add = partial(made.add_body, friction=FRICTION, force=(0.0, holding, 0.0))
    support, place = Box(SUPPORT_SIZE), (OBJECT_START[0], SUPPORT_Y + OVERLAP, 0.0)
    add("effector", support, mass=SUPPORT_MASS, position=place, role="effector", **PLANAR)
    return made
