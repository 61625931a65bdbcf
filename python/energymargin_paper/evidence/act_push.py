"""Pushing a box to a wall: where the pusher touches it, in which direction, and how fast it goes.

The task's scene and sets, from a start that is known to a centimetre and two degrees. The nominal
script is the task's: a steady force straight ahead, at the middle of the box.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Problem
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform
from energymargin.tasks.push import EFFECTOR_HEIGHT, OBJECT_SIZE, OBJECT_START, PushTask
from energymargin_paper.evidence.act_demo import Demo, Values, World, held, noise

__all__ = ["PushDemo"]

FRICTION, FRICTION_SPREAD = 0.3, 0.04
PLACE_SPREAD = 0.01  # m, standard deviation of the box's place
YAW_SPREAD = math.radians(2.0)
GAP, START_SPEED = 0.36, 0.35  # m behind the box's centre, m/s ahead
LENGTH = 1.5  # s; the nominal push is at the wall after 1.1 s

# Held out: other frictions, drawn evenly, and noise with a memory in place of even pieces.
FRICTION_RANGE = (0.2, 0.4)
FORCE, TORQUE = 1.6, 0.1  # N, N m
CORRELATION = 0.2  # s


class PushDemo(Demo):
    """Direction and speed of a push to a goal."""

    name = "push"
    parameters: ClassVar[dict[str, tuple[float, float, float]]] = {
        "offset": (-0.3, 0.0, 0.3),  # m, of the pusher from the box's middle, along its side
        "ahead": (8.0, 9.0, 16.0),  # N, towards the wall
        "sideways": (-3.0, 0.0, 3.0),  # N, at the start
        "turn": (-3.0, 0.0, 3.0),  # N that the sideways force gains until the end
    }
    disturbance = Uniform(2.0)
    uncertainty = Uncertainty(
        friction=dict.fromkeys(("object", "effector", "table"), FRICTION_SPREAD),
        pose=(PLACE_SPREAD, PLACE_SPREAD, 0.0, 0.0, 0.0, YAW_SPREAD),
    )

    def __init__(self) -> None:
        """The task whose scene and sets it has."""
        self._task = PushTask(FRICTION)

    def problem(self, values: Values, world: World | None = None) -> Problem:
        """As Demo.problem; a world has friction, x, y and yaw of the box."""
        drawn = {"friction": FRICTION, "x": 0.0, "y": 0.0, "yaw": 0.0, **(world or {})}
        params = {"friction": drawn["friction"]}
        x, y = OBJECT_START
        state = self._task.scene(params).pack(
            object={
                "position": (x + drawn["x"], y + drawn["y"], OBJECT_SIZE[2] / 2),
                "yaw": drawn["yaw"],
            },
            effector={
                "position": (x + values["offset"], y - GAP, EFFECTOR_HEIGHT / 2),
                "velocity": (0.0, START_SPEED, 0.0),
            },
        )
        asked = self._task.future(state, 0.0, params, LENGTH, None)
        # A box that lies at the wall is not lost, whatever the pusher does then.
        assert asked.succeeded is not None
        held_or_there = asked.captured | asked.succeeded
        planned: Problem = asked.replace(plan=self._plan(values), captured=held_or_there)
        return planned

    def _plan(self, values: Values) -> Plan:
        steps = round(LENGTH / self._task.step)
        share, rows = np.arange(steps) / steps, np.zeros((steps, 6))
        rows[:, 0] = values["sideways"] + values["turn"] * share
        rows[:, 1] = values["ahead"]
        return Plan(self._task.step, wrenches={"effector": rows})

    def draw(self, random: np.random.Generator) -> World:
        """Friction, and where the box lies."""
        return {
            "friction": random.uniform(*FRICTION_RANGE),
            "x": random.normal(scale=PLACE_SPREAD),
            "y": abs(random.normal(scale=PLACE_SPREAD)),  # away from the pusher
            "yaw": random.normal(scale=YAW_SPREAD),
        }

    def wrenches(
        self, random: np.random.Generator, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """As Demo.wrenches."""
        deviations = np.array([FORCE, FORCE, 0.0, 0.0, 0.0, TORQUE])
        return held(times, lambda pieces: noise(random, pieces, deviations, CORRELATION))
