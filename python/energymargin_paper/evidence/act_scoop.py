"""Scooping boxes from a table: how fast the scoop drives, when it rises, tilts and brakes.

The task's scoop, boxes and sets, with four boxes at places that are known to 5 mm and at any yaw.
The nominal script is the task's: ahead, and in a bend up, in which the scoop rises as it brakes.
All boxes are to stay in the scoop or ahead of it, and to be lifted in it at the end.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from energymargin._core import Box, Plan, Problem, Scene
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform
from energymargin.tasks.base import STEP
from energymargin.tasks.scoop import (
    BEND_RANGE,
    BEND_TIME,
    BOX_EDGE,
    BOX_FRICTION,
    BOX_MASS,
    BOXES,
    FORCE_BOUND,
    GRAVITY,
    LIFT_SPEED,
    LONGEST_EDGE,
    SPEED_RANGE,
    TABLE_FRICTION,
    TORQUE_BOUND,
    ScoopTask,
    scoop,
)
from energymargin_paper.evidence.act_demo import Demo, Values, World, held, noise

__all__ = ["ScoopDemo"]

PLACES = ((0.26, -0.06), (0.27, 0.02), (0.33, 0.07), (0.34, -0.03))  # m, of the boxes
PLACE_SPREAD = 0.005  # m, standard deviation of a box's place
YAW_SPREAD = 1.0  # rad, which is about any yaw of a square
FRICTION = 0.35  # of the scoop
MASS_SPREAD = 0.2  # share of a box's mass, to both sides
SPEED = sum(SPEED_RANGE) / 2  # m/s, at which the scoop arrives, and the nominal script's
BEND = sum(BEND_RANGE) / 2  # s
ARM_MASS = 100.0  # kg, of scoop and arm: the boxes hardly slow it down
SPEED_UP = 0.1  # s, from the one at the start to a plan's

# Held out: a wider range of frictions, and noise with a memory in place of even pieces.
FRICTION_RANGE = (0.08, 0.7)
FORCE, TORQUE = 0.04, 0.0005  # N, N m, standard deviations
CORRELATION = 0.1  # s


class ScoopDemo(Demo):
    """The bend's path."""

    name = "scoop"
    parameters: ClassVar[dict[str, tuple[float, float, float]]] = {
        "speed": (0.15, SPEED, 0.6),  # m/s ahead
        "begin": (0.3, BEND_TIME, 1.4),  # s, when the scoop begins to rise
        "rise": (0.15, BEND, 0.9),  # s, until it rises at full speed
        "lift": (0.1, LIFT_SPEED, 0.4),  # m/s, that speed
        "tilt": (0.0, 0.0, 0.6),  # rad, its front up, by the end of that time
        "lag": (-0.3, 0.0, 0.3),  # s, from where it rises to where it brakes
        "brake": (0.15, BEND, 0.9),  # s, until it stands ahead
    }
    objective = "probability/success"
    disturbance = Uniform(0.5)
    uncertainty = Uncertainty(
        friction={"scoop": stats.uniform(0.1, 2 * (FRICTION - 0.1))},
        mass=stats.uniform((1 - MASS_SPREAD) * BOX_MASS, 2 * MASS_SPREAD * BOX_MASS),
        pose=(PLACE_SPREAD, PLACE_SPREAD, 0.0, 0.0, 0.0, YAW_SPREAD),
    )
    budget = 3_000_000
    plane = ("x", "z")

    def __init__(self) -> None:
        """The task whose sets it has."""
        self._task = ScoopTask(FRICTION)

    def problem(self, values: Values, world: World | None = None) -> Problem:
        """As Demo.problem; a world has the scoop's friction, and mass, x, y and yaw of each box."""
        params = {"friction": FRICTION}
        made = _scene(world or {})
        return Problem(
            made,
            made.pack(),
            force=(FORCE_BOUND,) * 3,
            torque=(TORQUE_BOUND,) * 3,
            duration=LONGEST_EDGE,
            captured=self._task.captured_throughout(params),
            succeeded=self._task.succeeded(params),
            horizon=self._task.length,
            plan=self._plan(values),
            start_outside=True,
        )

    def _plan(self, values: Values) -> Plan:
        times = np.arange(self._task.steps) * STEP
        arrived = _ramp(times, 0.0, SPEED_UP)
        rising = _ramp(times, values["begin"], values["rise"])
        braking = _ramp(times, values["begin"] + values["lag"], values["brake"])
        rows = np.zeros((self._task.steps, 6))
        rows[:, 0] = (SPEED + (values["speed"] - SPEED) * arrived) * (1 - braking)
        rows[:, 2] = values["lift"] * rising
        rows[:, 4] = -values["tilt"] * np.gradient(rising, STEP)
        return Plan(STEP, velocities={"scoop": rows})

    def draw(self, random: np.random.Generator) -> World:
        """The scoop's friction, and masses, places and yaws of the boxes."""
        world = {"friction": random.uniform(*FRICTION_RANGE)}
        for box in BOXES:
            world[f"{box} mass"] = BOX_MASS * random.uniform(1 - MASS_SPREAD, 1 + MASS_SPREAD)
            for axis in ("x", "y"):
                world[f"{box} {axis}"] = random.normal(scale=PLACE_SPREAD)
            world[f"{box} yaw"] = random.normal(scale=YAW_SPREAD)
        return world

    def wrenches(
        self, random: np.random.Generator, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """As Demo.wrenches; each box has its own."""
        deviations = np.tile([FORCE] * 3 + [TORQUE] * 3, len(BOXES))
        return held(times, lambda pieces: noise(random, pieces, deviations, CORRELATION))


def _ramp(times: NDArray[np.floating[Any]], begin: float, duration: float) -> NDArray[np.float64]:
    """From 0 to 1."""
    return np.asarray(np.clip((times - begin) / duration, 0.0, 1.0))


def _scene(world: World) -> Scene:
    """The task's, with a scoop that can tilt and whose arm holds it."""
    made = Scene(gravity=GRAVITY, step=STEP)
    made.add_plane("table", friction=TABLE_FRICTION)
    for box, (x, y) in zip(BOXES, PLACES, strict=True):
        place = (x + world.get(f"{box} x", 0.0), y + world.get(f"{box} y", 0.0), BOX_EDGE / 2)
        made.add_body(
            box,
            Box((BOX_EDGE,) * 3),
            mass=world.get(f"{box} mass", BOX_MASS),
            position=place,
            yaw=world.get(f"{box} yaw", 0.0),
            friction=BOX_FRICTION,
            role="object",
        )
    made.add_body(
        "scoop",
        scoop(),
        mass=ARM_MASS,
        velocity=(SPEED, 0.0, 0.0),
        friction=world.get("friction", FRICTION),
        role="effector",
        angular_factor=(0, 1, 0),
    )
    made.disable_collisions("scoop", "table")  # it glides over the table
    return made
