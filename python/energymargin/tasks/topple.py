"""Toppling: a springy fingertip tips a box over one of its edges (Section VI-A, task 3).

It succeeds when the box has turned by 90 deg and stays so. The box is captured while the edge about
which it turns does not slide; where the friction is too low for that, the finger pushes the box
away instead of over.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import Box, ForceWeights, Scene, Sphere
from energymargin.base.aliases import Floats
from energymargin.tasks.base import NONE_DRAWN, STEP, Params
from energymargin.tasks.questions import FrictionTask
from energymargin.tasks.scripted import Drive

# Unless another source is named, a number is the one of the authors' public implementation
# (EnergyMarginDynCage, 2024).

# The scene: all moves in the plane of x and z. The ground is the plane z = 0.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
PITCHING: dict[str, Any] = {"linear_factor": (1.0, 0.0, 1.0), "angular_factor": (0.0, 1.0, 0.0)}
OBJECT_SIZE = (1.0, 1.0, 1.0)  # m
OBJECT_MASS = 0.3  # kg, so a push of 1.63 N at the finger's height tips it
OBJECT_START = (2.5, 0.0, 0.5)  # m, on the ground
FINGER_RADIUS = 0.1  # m, of both spheres, base and fingertip
FINGER_MASS = 0.1  # kg, of each
FINGER_HEIGHT = 0.9  # m, of the rail along x
FINGER_FRICTION = 0.2
BASE_X = 1.0  # m, start
TIP_X = 1.7  # m, start
STIFFNESS = 5.0  # N/m, of the spring between them
REST_LENGTH = 1.0  # m
ON_RAIL: dict[str, Any] = {"linear_factor": (1.0, 0.0, 0.0), "angular_factor": (0.0, 0.0, 0.0)}
# Coefficient of object and ground, one draw a trajectory; that of their contact is its square.
# Ours: below about 0.64 the box slides away, about every second one. (Public code: 0.6 to 1.5.)
FRICTION_RANGE = (0.4, 0.95)

# The drive: a push on the finger's base, drawn anew at each step. Ours: the 1 N of the public code
# cannot tip a box of this weight; 4 N can, and by the end of the push the box turns fast enough to
# go over. A push that went on would roll it over its next edge, too.
PUSH_RANGE = (3.0, 5.0)  # N along x
PUSH_TIME = 0.4  # s

# The success set.
TOPPLED_AXIS = (1.0, 0.0, 0.0)  # where the object's z axis points after 90 deg
TOPPLED_SPREAD = math.radians(3.0)  # rad

# The capture set (the paper): the lower edge on the far side is to keep its place.
PIVOT = (OBJECT_SIZE[0] / 2, 0.0, -OBJECT_SIZE[2] / 2)  # m, in the object's frame
PIVOT_SPEED = 0.1  # m/s

# The disturbance. Ours: a third of the object's weight, and a sixth of the torque that lifts it off
# its base: together they tip no box, and slide one at rest where the coefficient is below 0.6.
# (Public code: 15 N and 40 N m, which throw it.) As there, no force along z.
FORCE_BOUND = 1.0  # N on x
TORQUE_BOUND = 0.25  # N m about y
LONGEST_EDGE = 0.1  # s
RATE = 3.0  # 1/J, lambda of eq. 4

# The force score's weights, ours. What matters is that the box sticks to the ground; a metre of
# distance counts as much as a newton, for a finger that has done its work stays behind.
FORCE_WEIGHTS = ForceWeights(engage=1.0, stick=1.0, distance=1.0, ground_stick=10.0)


class ToppleTask(FrictionTask):
    """Topple a box with a springy fingertip (planar).

    `friction`: the coefficient of box and ground; None draws one for each trajectory. `effector`:
    "coast", base and fingertip are not actuated, the spring between them acts, or "drive", each
    edge of the search also starts with both at their velocity of the start state.
    """

    name = "topple"
    # "coast" is the default: in "drive" each edge stops the finger again where the start state has
    # it at rest, so that it never arrives, and the capture score's AP falls by a quarter.
    plane = ("x", "z")
    length = 1.5  # s
    longest_edge, rate, friction_range = LONGEST_EDGE, RATE, FRICTION_RANGE

    def scene(self, params: Params) -> Scene:
        """Ground, box and finger, with the friction in `params`."""
        made = Scene(gravity=GRAVITY, step=STEP)
        made.add_plane("ground", friction=params["friction"])
        add = partial(made.add_body, mass=OBJECT_MASS, friction=params["friction"], role="object")
        add("object", Box(OBJECT_SIZE), position=OBJECT_START, **PITCHING)
        add = partial(made.add_body, mass=FINGER_MASS, friction=FINGER_FRICTION, role="effector")
        for name, x in (("base", BASE_X), ("fingertip", TIP_X)):
            add(name, Sphere(FINGER_RADIUS), position=(x, 0.0, FINGER_HEIGHT), **ON_RAIL)
        made.add_spring("base", "fingertip", stiffness=STIFFNESS, rest_length=REST_LENGTH)
        return made

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """A push on the finger's base, drawn anew at each step, and then none."""
        wrenches, pushes = np.zeros((self.steps, 6)), round(PUSH_TIME / self.step)
        wrenches[:pushes, 0] = random.uniform(*PUSH_RANGE, pushes)
        return Drive({"base": wrenches})

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Wrenches act on the box."""
        bounds = {"force": (FORCE_BOUND, 0.0, 0.0), "torque": (0.0, TORQUE_BOUND, 0.0)}
        return {**bounds, "force_weights": FORCE_WEIGHTS}

    def captured_throughout(self, params: Params) -> regions.Region:
        """Z_cap of every instant: the edge about which the box turns is all but at rest."""
        return regions.Speed("object", PIVOT_SPEED, point=PIVOT)

    def succeeded(self, params: Params = NONE_DRAWN) -> regions.Region:
        """Z_suc: the box has turned by 90 deg."""
        return regions.Tilt("object", (0.0, 0.0, 1.0), TOPPLED_AXIS, TOPPLED_SPREAD)
