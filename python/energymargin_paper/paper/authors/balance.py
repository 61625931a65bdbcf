"""The authors' simulated transports of Table I."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Region, Scene
from energymargin.tasks.base import STEP, Params
from energymargin_paper.paper.authors.task import (
    COLUMNS,
    SimulatedTask,
    Sweep,
    SweptTask,
    Vector,
    placed,
)

__all__ = ["PublishedBalance"]

GRAVITY = (0.0, -9.81, 0.0)  # m/s^2; the slope is vertical
FREE_AXES, FREE_TURNS = (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)  # x and y, yaw
OBJECT_SIZE = (0.4, 0.4, 0.1)  # m
OBJECT_MASS = 1.0  # kg
SUPPORT_SIZE = (1.2, 0.2, 0.1)  # m
SUPPORT_MASS = 1000.0  # kg
FLOOR_SIZE = (40.0, 0.2, 0.1)  # m
FLOOR_Y = 0.55  # m, its upper side

# Of square and support, as in hyperparams.csv: with the 0.4 of the authors' later code a rollout
# misses the next recorded frame by 2.3 cm in the median, with this by 0.9 cm.
FRICTION = 0.8
FLOOR_FRICTION = 1.0

LIFT = 500.0  # N along y, the mean of the script; it meets the next frame of the support to 1 mm

FORCE_BOUND = 5.0  # N
GOAL_Y = 6.5  # m, of the object; the authors' later code


class PublishedBalance(SweptTask, SimulatedTask):
    """Carry a square on a support: the authors' simulated trajectories."""

    name = "published-balance"
    part = "balance"
    columns = COLUMNS
    interval = 0.3
    duration, rate = 0.5, 0.5
    sweep = Sweep(half_width=0.6, ahead=1.0, ends=0.0, least_speed=0.3, disc_radius=1.2)
    search_sweep = Sweep(half_width=0.6, ahead=1.5, ends=0.6, least_speed=0.03, disc_radius=0.9)

    def scene(self, params: Params) -> Scene:
        """Floor, square and support, which is held against its weight and the square's."""
        made = Scene(gravity=GRAVITY, step=STEP)
        made.add_body(
            "floor",
            Box(FLOOR_SIZE),
            mass=0,
            position=(5.0, FLOOR_Y - FLOOR_SIZE[1] / 2, 0.0),
            friction=FLOOR_FRICTION,
        )
        made.add_body(
            "object",
            Box(OBJECT_SIZE),
            mass=OBJECT_MASS,
            position=(5.0, 5.0, 0.0),
            friction=FRICTION,
            role="object",
            linear_factor=FREE_AXES,
            angular_factor=FREE_TURNS,
        )
        made.add_body(
            "effector",
            Box(SUPPORT_SIZE),
            mass=SUPPORT_MASS,
            position=(5.0, 4.7, 0.0),
            friction=FRICTION,
            role="effector",
            linear_factor=FREE_AXES,
            angular_factor=FREE_TURNS,
            force=(0.0, -(SUPPORT_MASS + OBJECT_MASS) * GRAVITY[1], 0.0),
        )
        return made

    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (26,), of a row of `columns`."""
        return np.asarray(scene.pack(object=placed(row[:6], 0.0), effector=placed(row[6:], 0.0)))

    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """A steady lift; the scene holds the square's weight already, the script does not."""
        return {"effector": (0.0, LIFT + OBJECT_MASS * GRAVITY[1], 0.0, 0.0, 0.0, 0.0)}

    def succeeded(self, params: Params) -> Region:
        """The square is high."""
        return regions.HalfSpace("object", (0.0, -1.0, 0.0), -GOAL_Y)

    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """On x and y."""
        return (FORCE_BOUND, FORCE_BOUND, 0.0), (0.0, 0.0, 0.0)
