"""Carrying a square up a steep slope on a bar: how the lift goes on, and how the bar moves aside.

The task's scene and sets. The square lies far off the bar's middle, and its place is known to two
centimetres. The nominal script is the task's: a steady lift. What the parameters add is a jerk of
the bar that draws it under the square.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Problem
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform
from energymargin.tasks.balance import (
    FRICTION,
    GOAL_Y,
    GRAVITY,
    OBJECT_START,
    OVERLAP,
    SUPPORT_MASS,
    SUPPORT_Y,
    BalanceTask,
)
from energymargin_paper.evidence.act_demo import Demo, Values, World, held

__all__ = ["BalanceDemo"]

FRICTION_SPREAD = 0.04
ASIDE = 0.4  # m, of the square from the bar's middle; the task draws up to 0.3
PLACE_SPREAD = 0.02  # m, standard deviation of where it lies
LIFT = 500.0  # N, the mean of the task's
SLOWER = 1.05  # times the nominal script's time, at most
RUSH, EASE = 0.4, 1.5  # s, in which the bar jerks aside, and then comes to rest

# Held out: other frictions and masses, drawn evenly, and one kick in place of even pieces.
FRICTION_RANGE = (0.32, 0.48)
MASS_RANGE = (0.9, 1.1)  # kg
KICK_RANGE = (4.0, 8.0)  # N, from the left or from the right
KICK_PIECES = 4  # of HOLD


class BalanceDemo(Demo):
    """The lift's profile."""

    name = "balance"
    parameters: ClassVar = {
        "early": (0.0, LIFT, 2 * LIFT),  # N, the lift at the start
        "late": (0.0, LIFT, 2 * LIFT),  # N, the lift at the end
        "peak": (-2.5, 0.0, 2.5),  # m/s, the bar's speed aside in the middle of its jerk
        "after": (-1.0, 0.0, 1.0),  # m/s, at its end
    }
    budget = 3_000_000
    disturbance = Uniform(1.0, hold=0.1)
    uncertainty = Uncertainty(
        friction=dict.fromkeys(("object", "effector"), FRICTION_SPREAD),
        mass={"object": 0.05},
        pose=(PLACE_SPREAD, 0.0, 0.0, 0.0, 0.0, 0.0),
    )

    def __init__(self) -> None:
        """The task whose scene and sets it has."""
        self._task = BalanceTask()

    @property
    def constraints(self) -> tuple[Callable[[dict[str, float]], float], ...]:
        """In time at the goal."""
        nominal = self._arrival(self.nominal)
        return (lambda values: SLOWER * nominal - self._arrival(values),)

    def problem(self, values: Values, world: World | None = None) -> Problem:
        """As Demo.problem; a world has friction, mass and x of the square."""
        drawn = {"friction": FRICTION, "mass": 1.0, "x": 0.0, **(world or {})}
        scene = self._task.scene({})
        for body in ("object", "effector"):
            scene = scene.with_body(body, friction=drawn["friction"])
        scene = scene.with_body("object", mass=drawn["mass"])
        x, y = OBJECT_START
        state = scene.pack(
            object={"position": (x + drawn["x"], y, 0.0)},
            effector={"position": (x - ASIDE, SUPPORT_Y + OVERLAP, 0.0)},
        )
        asked = self._task.future(state, 0.0, {}, self._task.length)
        planned: Problem = asked.replace(scene=scene, plan=self._plan(values))
        return planned

    def _plan(self, values: Values) -> Plan:
        rows = np.zeros((self._task.steps, 6))
        rows[:, 0] = SUPPORT_MASS * np.diff(self._speed(values)) / self._task.step
        rows[:, 1] = self._lift(values) - SUPPORT_MASS * GRAVITY[1]
        return Plan(self._task.step, wrenches={"effector": rows})

    def _lift(self, values: Values) -> NDArray[np.float64]:
        return np.linspace(values["early"], values["late"], self._task.steps)

    def _speed(self, values: Values) -> NDArray[np.float64]:
        """Speed of the bar along x [m/s], at the ends of the steps, shape (steps + 1,)."""
        times = np.arange(self._task.steps + 1) * self._task.step
        speeds = (0.0, values["peak"], values["after"], 0.0)
        return np.asarray(np.interp(times, (0.0, RUSH / 2, RUSH, RUSH + EASE), speeds))

    def _arrival(self, values: Values) -> float:
        """When a square that stays on the bar passes the goal height [s]."""
        speed = np.cumsum(self._lift(values)) * self._task.step / SUPPORT_MASS
        height = OBJECT_START[1] + np.cumsum(speed) * self._task.step
        above = np.flatnonzero(height > GOAL_Y)
        return float(above[0] * self._task.step) if len(above) else math.inf

    def draw(self, random: np.random.Generator) -> World:
        """Friction, mass, and where the square lies."""
        return {
            "friction": random.uniform(*FRICTION_RANGE),
            "mass": random.uniform(*MASS_RANGE),
            "x": random.normal(scale=PLACE_SPREAD),
        }

    def wrenches(
        self, random: np.random.Generator, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """As Demo.wrenches: a kick at any time."""

        def kick(pieces: int) -> NDArray[np.float64]:
            rows = np.zeros((pieces, 6))
            begin = random.integers(0, pieces)
            side = random.choice((-1.0, 1.0))
            rows[begin : begin + KICK_PIECES, 0] = side * random.uniform(*KICK_RANGE)
            return rows

        return held(times, kick)
