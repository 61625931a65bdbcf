"""Pushing several objects: a bar drives ten discs over a table into a goal region.

The bar moves as the hand that holds it, which shakes and turns; discs slip past its ends. A disc is
captured while it lies in what the bar is about to sweep, given its instantaneous centre of
rotation. The capture set and the success set are those of each disc, so there are two questions of
each: are all discs in it, and is at least one?
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import Box, Cylinder, Inertial, Scene, World
from energymargin.base.aliases import Floats
from energymargin.tasks.base import NONE_DRAWN, PLANAR, STEP, Params
from energymargin.tasks.questions import FrictionTask, places_apart, swept_from
from energymargin.tasks.scripted import Drive

# All numbers are ours.

# The scene. The table is the plane z = 0.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
DISCS = tuple(f"disc_{number}" for number in range(10))
DISC_RADIUS = 0.03  # m
DISC_HEIGHT = 0.03  # m
DISC_MASS = 0.1  # kg
BAR_SIZE = (0.6, 0.03, 0.03)  # m
BAR_MASS = 10.0  # kg, with the arm behind it
BAR_INERTIA = 1.0  # kg m^2, about all axes
BAR_Z = 0.02  # m, of its middle: the hand carries it above the table
MARGIN = 0.005  # m, of collisions: it rounds the edges of bar and discs
FRICTION_RANGE = (0.2, 0.4)  # coefficient of all bodies, one draw a trajectory
FRICTION_MIDDLE = 0.3  # the forces below are for this friction, and grow with its square

# The start of a trajectory: uniform draws.
DISC_AREA = ((-0.15, 0.15), (0.06, 0.30))  # m, of the discs' centres on x and y
DISC_GAP = 0.005  # m between discs, at least
BAR_X_SPREAD = 0.05  # m, to both sides of the middle
BAR_SPEED_RANGE = (0.15, 0.45)  # m/s, along y

# The drive.
TURN_SPREAD = 1.5  # rad/s, to both sides, times the cube of an even draw: most go about straight
PUSH_RANGE = (0.2, 1.6)  # of the friction of all discs, along y; one draw a trajectory
FORCE_SPREAD = 20.0  # N on x and on y, to both sides, drawn anew at each step
TORQUE_SPREAD = 3.0  # N m about z, to both sides, drawn anew at each step

# The success set: a rectangle.
GOAL = ((-0.5, 0.5), (0.72, 1.5))  # m, of a disc's centre on x and y

# The capture set: a disc in what the bar is about to sweep.
SWEPT: dict[str, Any] = {
    "half_width": BAR_SIZE[0] / 2,  # m; a disc whose centre is past an end slips off it
    "behind": 0.2,  # m of path behind the bar's middle
    "ahead": 1.5,  # s of its motion ahead
    "least_speed": 0.05,  # m/s; a slower bar has no clear direction, so it gets a disc
    "disc_radius": 0.3,  # m
}

# The disturbance, of each disc.
FORCE_BOUND = 0.15  # N on x and on y; a disc that lies on the table holds against 0.088 N
TORQUE_BOUND = 0.002  # N m about z
LONGEST_EDGE = 0.3  # s
RATE = 20.0  # 1/J, lambda of eq. 4


class PushMultiTask(FrictionTask):
    """Push ten discs over a table into a goal region, with a bar (planar).

    `friction`: the coefficient of all bodies; None draws one for each trajectory. `effector`:
    "coast", the bar is not actuated, or "drive", each edge of the search starts with the bar at its
    velocity of the start state.
    """

    name = "push-multi"
    length = 2.5  # s
    longest_edge, rate, friction_range = LONGEST_EDGE, RATE, FRICTION_RANGE

    def scene(self, params: Params) -> Scene:
        """Table, discs and bar, all of the friction in `params`."""
        made = Scene(gravity=GRAVITY, step=STEP, margin=MARGIN)
        made.add_plane("table", friction=params["friction"])
        friction, disc = params["friction"], Cylinder(DISC_RADIUS, DISC_HEIGHT)
        add = partial(made.add_body, mass=DISC_MASS, friction=friction, role="object")
        for number, name in enumerate(DISCS):
            x = 2 * (DISC_RADIUS + DISC_GAP) * number
            add(name, disc, position=(x, DISC_AREA[1][1], DISC_HEIGHT / 2))
        add = partial(made.add_body, mass=BAR_MASS, friction=friction, role="effector")
        inertial = Inertial(inertia=(BAR_INERTIA,) * 3)
        add("bar", Box(BAR_SIZE), inertial=inertial, position=(0.0, 0.0, BAR_Z), **PLANAR)
        return made

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """The friction, if the task leaves it open, how hard the hand pushes, and how it turns."""
        drawn, push = super().draw(random), random.uniform(*PUSH_RANGE)
        return {**drawn, "push": push, "turn": TURN_SPREAD * random.uniform(-1.0, 1.0) ** 3}

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """Discs at random places in front of the bar, at rest; the bar moves."""
        places = places_apart(random, DISC_AREA, len(DISCS), 2 * DISC_RADIUS + DISC_GAP)
        moved: dict[str, dict[str, Any]] = {
            disc: {"position": (*place, DISC_HEIGHT / 2)}
            for disc, place in zip(DISCS, places, strict=True)
        }
        place = (random.uniform(-BAR_X_SPREAD, BAR_X_SPREAD), 0.0, BAR_Z)
        speed, turn = (0.0, random.uniform(*BAR_SPEED_RANGE), 0.0), (0.0, 0.0, params["turn"])
        moved["bar"] = {"position": place, "velocity": speed, "angular_velocity": turn}
        return np.asarray(self.layout.pack(**moved))

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """An unsteady hand, which makes up for the discs' friction on average."""
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, :2] = random.uniform(-FORCE_SPREAD, FORCE_SPREAD, (self.steps, 2))
        wrenches[:, 5] = random.uniform(-TORQUE_SPREAD, TORQUE_SPREAD, self.steps)
        load = len(DISCS) * DISC_MASS * -GRAVITY[2] * params["friction"] ** 2
        wrenches[:, 1] += params["push"] * load
        return Drive({"bar": wrenches})

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Wrenches act on each disc."""
        scale = (params["friction"] / FRICTION_MIDDLE) ** 2
        force, torque = FORCE_BOUND * scale, TORQUE_BOUND * scale
        return {"force": (force, force, 0.0), "torque": (0.0, 0.0, torque)}

    def captured(self, state: Floats, params: Params = NONE_DRAWN) -> dict[str, regions.Region]:
        """Z_cap(z) of a state, shape (n,), for each disc.

        The disc lies in what the bar was about to sweep at z, and still does from where the bar has
        come to: a disc that was passed by is lost, wherever it lies.
        """
        motion = swept_from(self.layout, state, "bar")
        return {disc: _in_front(disc) & _swept(disc, at=motion) & _swept(disc) for disc in DISCS}

    def captured_throughout(self, params: Params) -> dict[str, regions.Region]:
        """Z_cap of every instant for each disc: it lies in what the bar is about to sweep."""
        return {disc: _in_front(disc) & _swept(disc) for disc in DISCS}

    def succeeded(self, params: Params) -> dict[str, regions.Region]:
        """Z_suc for each disc: it lies in the goal region."""
        low, high = np.transpose(GOAL)
        center, size = (*(low + high) / 2, 0.0), (*(high - low), np.inf)
        return {disc: regions.Box(disc, center, size) for disc in DISCS}


def _in_front(disc: str) -> regions.Region:
    """In front of the bar, between its ends."""
    size = (BAR_SIZE[0], 10.0, np.inf)
    return regions.Box(disc, center=(0.0, size[1] / 2, 0.0), size=size, frame="bar")


def _swept(disc: str, at: dict[str, Any] | None = None) -> regions.Region:
    """What the bar is about to sweep, from a fixed motion or from where it is."""
    return regions.Swept(disc, by="bar", at=at, **SWEPT)
