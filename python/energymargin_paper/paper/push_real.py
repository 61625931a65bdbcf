"""Pushing printed objects over a table to a wall, by an arm that a person steers (Section VI-E).

All is at true scale, centimetres and grams: the World keeps its accuracy there, for its margins and
reaches are shares of the shapes' sizes.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Box, Inertial, Scene, World
from energymargin.base.checks import one_of
from energymargin.tasks.base import NONE_DRAWN, STEP, Params
from energymargin.tasks.questions import QuestionTask, swept_from
from energymargin.tasks.scripted import Drive
from energymargin_paper.paper.printed import OBJECTS, TOOLS, Printed, printed

__all__ = ["PushRealTask"]

# Facts of the authors' recordings are named so; what is scaled is PushTask's number, by the width
# of the objects; the others are ours.

# The scene. The table is the plane z = 0.
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2
WALL_Y = 0.15  # m, its near face; a fact
WALL_SIZE = (1.0, 0.1, 0.06)  # m
FRICTION = 27 / 68  # of the object with all else, measured; a fact
CLEARANCE = 0.001  # m, of the arm's tool above the table
ARM_MASS = 5.0  # kg that moves with the printed effector, so that its speed lasts over an edge
ARM_INERTIA = 0.2  # kg m^2, the same about 0.2 m: the arm all but holds the effector's yaw

# The script of simulated pushes: a steady push from behind.
OBJECT_Y = (0.0, 0.02)  # m
OBJECT_YAW_SPREAD = math.radians(15.0)  # rad, to both sides
EFFECTOR_X_SPREAD = 0.4  # to both sides of the object's centre; a share of its width
EFFECTOR_SPEED_RANGE = (0.055, 0.075)  # m/s
EFFECTOR_NOISE = 2.0  # N on x and on y, to both sides, drawn anew at each step
START = 0.15  # m behind the object, from where the effector is brought near
NEAR = 0.005  # m

# The success set: the longest edge lies at the wall; the paper asks for the position alone.
SUCCESS_HALF_WIDTH = 0.02  # m
SUCCESS_YAW = math.radians(25.0)  # rad, to both sides

# The capture set, scaled.
CAPTURE_HALF_WIDTH = 0.475  # of the object's width, to both sides of the effector's path
CAPTURE_BEHIND = 0.0475  # of the object's width
CAPTURE_AHEAD = 1.5  # s of the effector's motion
CAPTURE_LEAST_SPEED = 0.03  # m/s, half of that of a push
CAPTURE_DISC_RADIUS = 0.7125  # of the object's width

# The disturbance, as a share of the friction between object and table.
FORCE_SHARE = 1.0  # so much that it just moves the object
TORQUE_SHARE = 0.3  # with the width as lever, so that it just turns the object
LONGEST_EDGE = 0.25  # s; on which an effector moves by as much of the width as in PushTask
RATE = 500.0  # 1/J; a fact is 0.05 / J, in a scene enlarged 10 times, whose works are 10^4 as large


class PushRealTask(QuestionTask):
    """Push a printed object over a table to a wall, with an arm (planar)."""

    name = "push-real"
    length = 3.0  # s
    longest_edge, rate = LONGEST_EDGE, RATE

    def __init__(
        self,
        object: str = "rectangle",
        tool: str = "jaw",
        effector: str = "drive",
    ) -> None:
        """A task of these parameters; raises ValueError on others.

        `object`: rectangle, triangle, convex, concave or irregular. `tool`: jaw or round.
        `effector`: "drive", each edge of the search starts with the arm at its velocity of the
        start state, or "coast", it is not actuated.
        """
        super().__init__(effector)
        self._object = one_of("object", object, OBJECTS)
        self._tool = one_of("tool", tool, TOOLS)

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return {"object": self._object, "tool": self._tool, "effector": self.effector}

    def scene(self, params: Params) -> Scene:
        """Table, wall, object and the arm's tool."""
        return self._scene

    def start(
        self, world: World, params: Params, random: np.random.Generator
    ) -> NDArray[np.float64]:
        """An object at rest, and the effector close behind it, on its way."""
        aim = EFFECTOR_X_SPREAD * self._body.width
        x, y = random.uniform(-aim, aim), random.uniform(*OBJECT_Y)
        yaw = random.uniform(-OBJECT_YAW_SPREAD, OBJECT_YAW_SPREAD)
        speed = random.uniform(*EFFECTOR_SPEED_RANGE)
        height = world.scene.pack()[world.scene.slice("effector")][2]
        behind = START
        while True:
            state: NDArray[np.float64] = world.scene.pack(
                object={"position": (0.0, y, self._body.height / 2), "yaw": yaw},
                effector={
                    "position": (x, y - behind, height),
                    "velocity": (0.0, speed, 0.0),
                },
            )
            distance = world.distance(state, "object", "effector")
            if distance <= NEAR or behind <= 0:
                return state
            behind -= distance - 0.9 * NEAR

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """The arm keeps its speed, but for noise."""
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, :2] = random.uniform(-EFFECTOR_NOISE, EFFECTOR_NOISE, (self.steps, 2))
        return Drive({"effector": wrenches})

    def question(self, state: NDArray[np.float64], params: Params) -> dict[str, Any]:
        """Wrenches act on the object."""
        friction = FRICTION * self._body.mass * -GRAVITY[2]  # N, between object and table
        force, torque = FORCE_SHARE * friction, TORQUE_SHARE * friction * self._body.width
        return {"force": (force, force, 0.0), "torque": (0.0, 0.0, torque)}

    def captured(self, state: NDArray[np.float64], params: Params = NONE_DRAWN) -> regions.Region:
        """Z_cap(z) of a state, shape (26,), as that of PushTask: the object lies in what the
        effector was about to sweep at z, and still does from where it has come to."""
        return self._swept(swept_from(self._scene, state, "effector")) & self._swept(None)

    def captured_throughout(self, params: Params) -> regions.Region:
        """Z_cap of every instant: the object lies in what the effector is about to sweep."""
        return self._swept(None)

    def succeeded(self, params: Params) -> regions.Region:
        """Z_suc: the object's longest edge lies at the wall."""
        flush = WALL_Y - self._body.ahead
        ahead = np.array([0.0, 1.0, 0.0])
        near = regions.HalfSpace("object", ahead, flush + SUCCESS_HALF_WIDTH)
        not_far = regions.HalfSpace("object", -ahead, SUCCESS_HALF_WIDTH - flush)
        return near & not_far & regions.Tilt("object", ahead, ahead, SUCCESS_YAW)

    @cached_property
    def _body(self) -> Printed:
        return printed("objects", self._object)

    @cached_property
    def _scene(self) -> Scene:
        return scene(self._body, printed("effectors", self._tool))

    def _swept(self, at: dict[str, Any] | None) -> regions.Region:
        """What the effector is about to sweep, from a fixed motion or from where it is."""
        width = self._body.width
        return regions.Swept(
            "object",
            by="effector",
            half_width=CAPTURE_HALF_WIDTH * width,
            behind=CAPTURE_BEHIND * width,
            ahead=CAPTURE_AHEAD,
            least_speed=CAPTURE_LEAST_SPEED,
            disc_radius=CAPTURE_DISC_RADIUS * width,
            at=at,
        )


def scene(body: Printed, tool: Printed) -> Scene:
    """Table, wall, object and the arm's tool."""
    made = Scene(gravity=GRAVITY, step=STEP)
    made.add_plane("table", friction=FRICTION)
    made.add_body(
        "wall",
        Box(WALL_SIZE),
        mass=0,
        position=(0.0, WALL_Y + WALL_SIZE[1] / 2, WALL_SIZE[2] / 2),
        friction=FRICTION,
    )
    made.add_body(
        "object",
        body.shape,
        mass=body.mass,
        position=(0.0, 0.0, body.height / 2),
        friction=1.0,
        role="object",
    )
    made.add_body(
        "effector",
        tool.shape,
        mass=tool.mass + ARM_MASS,
        inertial=Inertial(inertia=(ARM_INERTIA,) * 3),
        position=(0.0, -START, tool.height / 2 + CLEARANCE),
        friction=FRICTION,
        role="effector",
        linear_factor=(1, 1, 0),
        angular_factor=(0, 0, 1),
    )
    made.disable_collisions("effector", "table")  # the arm carries it
    return made
