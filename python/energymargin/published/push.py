"""The authors' simulated pushes of Table I."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Box, Contact, Cylinder, Problem, Region, Scene
from energymargin.published.planar import COLUMNS, between, placed, swept
from energymargin.published.task import PublishedTask
from energymargin.tasks.base import STEP, Params

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
LONGEST_EDGE = 0.5  # s
RATE = 3.0  # 1/J
HALF_WIDTH, AHEAD, ENDS, LEAST_SPEED = 0.57, 1.5, 0.057, 0.3  # m, s, m, m/s: of the capture set
SUCCESS = (8.6, 9.0)  # m, of the object's y


class PublishedPush(PublishedTask):
    """Push a box to a wall: the authors' simulated trajectories."""

    name = "published-push"
    part = "push"
    columns = COLUMNS
    interval = 0.25

    def scene(self, params: Params) -> Scene:
        """Table, wall, box and pusher."""
        made = Scene(gravity=GRAVITY, step=STEP, friction_directions=1)
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

    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """What the pusher is about to sweep from where it is at this state, shape (26,)."""
        pusher = self.scene(params).unpack(state)["effector"]
        motion = {
            "position": pusher["position"][:2],
            "velocity": pusher["velocity"][:2],
            "yaw_rate": pusher["angular_velocity"][2],
        }
        return swept(HALF_WIDTH, AHEAD, ENDS, LEAST_SPEED, motion)

    def captured_throughout(self, params: Params) -> Region:
        """What the pusher is about to sweep from where it has come to."""
        return swept(HALF_WIDTH, AHEAD, ENDS, LEAST_SPEED, None)

    def succeeded(self, params: Params) -> Region:
        """The box lies at the wall."""
        return between((0.0, 1.0, 0.0), *SUCCESS)

    def problem(
        self,
        state: NDArray[np.float64],
        params: Params | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Problem:
        """The problem P of Section V-A at a state, shape (26,): wrenches act on the box."""
        return Problem(
            self.scene({}),
            state,
            force=(FORCE_BOUND, FORCE_BOUND, 0.0),
            torque=(0.0, 0.0, TORQUE_BOUND),
            duration=LONGEST_EDGE,
            captured=self.captured(state, {}),
            succeeded=self.succeeded({}),
            effector="drive",
            rate=RATE,
            contacts=contacts,
            start_outside=True,
        )
