"""The authors' simulated pushes of Table I."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Cylinder, Region, Scene
from energymargin.tasks.base import STEP, Params
from energymargin_paper.paper.authors.task import (
    COLUMNS,
    SimulatedTask,
    Sweep,
    SweptTask,
    Vector,
    between,
    placed,
)

__all__ = ["PublishedPush"]

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
FRICTION = 0.3  # of every body
OBJECT_SIZE = (1.2, 0.4, 0.1)  # m
OBJECT_MASS = 1.0  # kg
EFFECTOR_RADIUS, EFFECTOR_HEIGHT = 0.1, 0.1  # m
EFFECTOR_MASS = 4.0  # kg
WALL_SIZE = (14.0, 1.0, 0.1)  # m
WALL_Y = 9.0  # m, its near side

# Not recorded: this force meets the next recorded frame best, within 3 mm in the median.
PUSH = 10.5  # N along y

FORCE_BOUND, TORQUE_BOUND = 2.0, 0.05  # N, N m
SUCCESS = (8.6, 9.0)  # m, of the object's y


class PublishedPush(SweptTask, SimulatedTask):
    """Push a box to a wall: the authors' simulated trajectories."""

    name = "published-push"
    part = "push"
    columns = COLUMNS
    interval = 0.25
    duration, rate = 0.5, 3.0
    sweep = Sweep(half_width=0.57, ahead=1.5, ends=0.057, least_speed=0.3, disc_radius=1.14)
    # Not recorded: of all discs that were tried it gives their scores back best.
    search_sweep = replace(sweep, disc_radius=0.855)

    def scene(self, params: Params) -> Scene:
        """Table, wall, box and pusher."""
        made = Scene(gravity=GRAVITY, step=STEP)
        made.add_plane("table", friction=FRICTION)
        made.add_body(
            "wall",
            Box(WALL_SIZE),
            mass=0,
            position=(5.0, WALL_Y + WALL_SIZE[1] / 2, WALL_SIZE[2] / 2),
            friction=FRICTION,
        )
        made.add_body(
            "object",
            Box(OBJECT_SIZE),
            mass=OBJECT_MASS,
            position=(4.5, 7.0, OBJECT_SIZE[2] / 2),
            friction=FRICTION,
            role="object",
        )
        made.add_body(
            "effector",
            Cylinder(EFFECTOR_RADIUS, EFFECTOR_HEIGHT),
            mass=EFFECTOR_MASS,
            position=(4.5, 6.5, EFFECTOR_HEIGHT / 2),
            friction=FRICTION,
            role="effector",
        )
        return made

    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (26,), of a row of `columns`."""
        return np.asarray(
            scene.pack(
                object=placed(row[:6], OBJECT_SIZE[2] / 2),
                effector=placed(row[6:], EFFECTOR_HEIGHT / 2),
            )
        )

    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """A steady force on the pusher."""
        return {"effector": (0.0, PUSH, 0.0, 0.0, 0.0, 0.0)}

    def succeeded(self, params: Params) -> Region:
        """The box lies at the wall."""
        return between((0.0, 1.0, 0.0), *SUCCESS)

    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """On x and y, and about z."""
        return (FORCE_BOUND, FORCE_BOUND, 0.0), (0.0, 0.0, TORQUE_BOUND)
