"""Scooping several objects: a scoop drives under small boxes on a table and lifts them.

Boxes that the scoop does not get under are pushed ahead of it, and stay behind when it lifts; the
rougher the scoop, the more. The smoother it is, the more slide off its ramp again. A box is
captured while it lies in the scoop, or in what the scoop is about to sweep. The sets are those of
each box, so there are two questions of each: are all boxes in it, and is at least one?
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import Box, Compound, Part, Scene, World
from energymargin.base.aliases import Floats
from energymargin.tasks.base import NONE_DRAWN, STEP, Params
from energymargin.tasks.questions import FrictionTask, places_apart
from energymargin.tasks.scripted import Drive

# All numbers are ours.

# The scene. The table is the plane z = 0.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
BOXES = tuple(f"box_{number}" for number in range(4))
BOX_EDGE = 0.04  # m
BOX_MASS = 0.05  # kg
BOX_FRICTION = 1.0  # so a contact's coefficient is the other body's
TABLE_FRICTION = 0.7

# The scoop, in its own frame: x = 0 is its back wall's inner face, y = 0 its middle, and z = 0 its
# lower side. It opens towards x.
LENGTH = 0.12  # m, of the floor along x
RAMP = 0.08  # m along x, in front of it
WIDTH = 0.20  # m, between the side walls
FLOOR = 0.012  # m, thickness
RAMP_PLATE = 0.004  # m, thickness of the ramp
EDGE = -0.0005  # m, height of the ramp's front edge: just below the table's surface
WALL_HEIGHT = 0.06  # m
WALL = 0.008  # m, thickness of the side walls
BACK = 0.02  # m, thickness of the back wall
SCOOP_MASS = 1000.0  # kg, with the arm behind it: the boxes hardly slow it down
NO_TURNS = (0.0, 0.0, 0.0)
FRICTION_RANGE = (0.02, 0.8)  # of the scoop, one draw a trajectory

# The start of a trajectory: uniform draws.
BOX_AREA = ((0.24, 0.34), (-0.09, 0.09))  # m, of the boxes' centres on x and y
BOX_GAP = 0.06  # m between their centres, at least
SPEED_RANGE = (0.2, 0.35)  # m/s, of the scoop along x

# The script: on along x, in a bend, and up.
BEND_TIME = 0.8  # s
BEND_RANGE = (0.3, 0.6)  # s that the bend takes; one draw a trajectory
LIFT_SPEED = 0.2  # m/s, after it
NOISE = (2.0, 1.0, 0.0)  # m/s^2 on each axis, to both sides, drawn anew at each step

# The success set.
SUCCESS_HEIGHT = 0.08  # m of a box's centre above the table, and more

# The capture set: the scoop's inside, and what it is about to sweep along x.
CAPTURE_AHEAD = 1.0  # s of the scoop's motion
CAPTURE_HEIGHT = 0.10  # m above the scoop's lower side

# The disturbance, of each box.
FORCE_BOUND = 0.15  # N on all axes, a third of a box's weight
TORQUE_BOUND = 0.002  # N m about all axes
LONGEST_EDGE = 0.2  # s
RATE = 20.0  # 1/J, lambda of eq. 4


class ScoopTask(FrictionTask):
    """Scoop four boxes from a table and lift them.

    `friction`: the coefficient of the scoop; None draws one for each trajectory. `effector`:
    "coast", the scoop is held against its weight and not actuated otherwise, or "drive", each edge
    of the search also starts with the scoop at its velocity of the start state.
    """

    name = "scoop"
    plane = ("x", "z")
    length = 2.0  # s
    longest_edge, rate, friction_range = LONGEST_EDGE, RATE, FRICTION_RANGE

    def scene(self, params: Params) -> Scene:
        """Table, boxes and scoop, with the friction in `params`."""
        made = Scene(gravity=GRAVITY, step=STEP)
        made.add_plane("table", friction=TABLE_FRICTION)
        add = partial(made.add_body, mass=BOX_MASS, friction=BOX_FRICTION, role="object")
        for number, box in enumerate(BOXES):
            place = (BOX_AREA[0][0], number * BOX_GAP, BOX_EDGE / 2)
            add(box, Box((BOX_EDGE,) * 3), position=place)
        held = tuple(-SCOOP_MASS * np.array(GRAVITY))
        add = partial(made.add_body, mass=SCOOP_MASS, friction=params["friction"], force=held)
        add("scoop", scoop(), role="effector", angular_factor=NO_TURNS)
        made.disable_collisions("scoop", "table")  # it glides over the table
        return made

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """The friction, if the task leaves it open, the scoop's speed, and how long its bend is."""
        drawn, speed = super().draw(random), random.uniform(*SPEED_RANGE)
        return {**drawn, "speed": speed, "bend": random.uniform(*BEND_RANGE)}

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """Boxes at random places in front of the scoop, at rest; the scoop moves."""
        places = places_apart(random, BOX_AREA, len(BOXES), BOX_GAP)
        moved: dict[str, dict[str, Any]] = {
            box: {"position": (*place, BOX_EDGE / 2), "yaw": random.uniform(-np.pi, np.pi)}
            for box, place in zip(BOXES, places, strict=True)
        }
        moved["scoop"] = {"velocity": (params["speed"], 0.0, 0.0)}
        return np.asarray(self.layout.pack(**moved))

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """The scoop goes on, and in a bend up, with an unsteady hand."""
        accelerations = np.array(NOISE) * random.uniform(-1.0, 1.0, (self.steps, 3))
        times = np.arange(self.steps) * self.step
        bending = (times >= BEND_TIME) & (times < BEND_TIME + params["bend"])
        change = np.array([-params["speed"], 0.0, LIFT_SPEED])
        accelerations[bending] += change / (bending.sum() * self.step)
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, :3] = SCOOP_MASS * accelerations
        return Drive({"scoop": wrenches})

    def question(self, state: Floats, params: Params) -> dict[str, Any]:
        """Wrenches act on each box."""
        return {"force": (FORCE_BOUND,) * 3, "torque": (TORQUE_BOUND,) * 3}

    def captured(self, state: Floats, params: Params = NONE_DRAWN) -> dict[str, regions.Region]:
        """Z_cap(z) of a state, shape (n,), for each box; it moves with the scoop."""
        speed = float(self.layout.unpack(state)["scoop"]["velocity"][0])
        ahead = CAPTURE_AHEAD * max(speed, 0.0)
        return {box: _in_scoop(box, ahead) for box in BOXES}

    def captured_throughout(self, params: Params) -> dict[str, regions.Region]:
        """Z_cap of every instant for each box: it is in the scoop, or in what that is about to
        sweep along x at its speed then."""
        return {box: _in_or_ahead(box) for box in BOXES}

    def succeeded(self, params: Params) -> dict[str, regions.Region]:
        """Z_suc for each box: it is in the scoop, and lifted."""
        up = (0.0, 0.0, -1.0)
        return {box: _in_scoop(box) & regions.HalfSpace(box, up, -SUCCESS_HEIGHT) for box in BOXES}


def _in_scoop(box: str, ahead: float = 0.0) -> regions.Region:
    """A box's centre is between the walls, or up to `ahead` [m] in front of the edge."""
    reach = LENGTH + RAMP + ahead
    center, size = (reach / 2, 0.0, CAPTURE_HEIGHT / 2), (reach, WIDTH, CAPTURE_HEIGHT)
    return regions.Box(box, center, size, frame="scoop")


def _in_or_ahead(box: str) -> regions.Region:
    """As `_in_scoop`, with what the scoop sweeps in CAPTURE_AHEAD ahead of its edge."""
    center, size = (0.0, 0.0, CAPTURE_HEIGHT / 2), (np.inf, WIDTH, CAPTURE_HEIGHT)
    between = regions.Box(box, center, size, frame="scoop")
    ahead, edge = (1.0, 0.0, 0.0), LENGTH + RAMP
    not_behind = regions.HalfSpace(box, (-1.0, 0.0, 0.0), 0.0, frame="scoop")
    near = regions.HalfSpace(box, ahead, edge, frame="scoop", ahead=CAPTURE_AHEAD)
    return between & not_behind & near


def scoop() -> Compound:
    """Floor, ramp, back wall and side walls."""
    back = Box((BACK, WIDTH + 2 * WALL, WALL_HEIGHT))
    side = Box((LENGTH, WALL, WALL_HEIGHT))
    beside = (WIDTH + WALL) / 2
    return Compound(
        [
            Part(Box((LENGTH, WIDTH, FLOOR)), position=(LENGTH / 2, 0.0, FLOOR / 2)),
            _ramp(),
            Part(back, position=(-BACK / 2, 0.0, WALL_HEIGHT / 2)),
            Part(side, position=(LENGTH / 2, beside, WALL_HEIGHT / 2)),
            Part(side, position=(LENGTH / 2, -beside, WALL_HEIGHT / 2)),
        ]
    )


def _ramp() -> Part:
    """A plate that leads from the front edge up to the floor.

    Its lower side dips into the table there, with which the scoop does not collide.
    """
    slope = np.arctan2(FLOOR - EDGE, RAMP)
    length = np.hypot(FLOOR - EDGE, RAMP)
    up = np.array([np.sin(slope), 0.0, np.cos(slope)])
    middle = np.array([LENGTH + RAMP / 2, 0.0, (FLOOR + EDGE) / 2])  # of its upper side
    turn = (0.0, np.sin(slope / 2), 0.0, np.cos(slope / 2))
    plate = Box((length, WIDTH, RAMP_PLATE))
    return Part(plate, position=middle - RAMP_PLATE / 2 * up, orientation=turn)
