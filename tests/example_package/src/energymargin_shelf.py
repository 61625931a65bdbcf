"""A finger carries a block sideways along a tilted shelf, down which the block would slide
without it.

The shelf's surface is the plane of x and y, and falls off towards -y. The finger below the block
moves along x, with an unsteady hand; where there is too little friction between the two, it leaves
the block behind, which then slides down.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import energymargin as em
from energymargin.tasks import Drive, Params, ScriptedTask

BLOCK = em.Box((0.04, 0.04, 0.02))  # m
FINGER = em.Box((0.10, 0.02, 0.02))  # m
FINGER_MASS = 1.0  # kg
ON_FINGER = 0.03  # m between their centres along y

# The block's centre is right above the finger, wherever that has come to.
CARRIED = em.regions.Box(
    "object", center=(0.0, ON_FINGER, 0.0), size=(FINGER.size[0], 0.02, np.inf), frame="effector"
)


@dataclass(frozen=True)
class ShelfTask(ScriptedTask):
    """Carry a block along a tilted shelf, on a finger (planar)."""

    # The keywords are the task's parameters: `energymargin generate shelf -p tilt=0.4`.
    tilt: float = 0.3  # rad, of the shelf
    pull: float = 1.0  # N, the finger's drive along x

    name = "shelf"  # as in pyproject.toml
    length = 1.0  # s of a trajectory

    def scene(self, params: Params) -> em.Scene:
        """What there is. Gravity is tilted instead of the shelf."""
        gravity = 9.81 * np.array([0.0, -np.sin(self.tilt), -np.cos(self.tilt)])
        scene = em.Scene(gravity=gravity)
        scene.add_plane("shelf", friction=0.1)
        scene.add_body(
            "object",
            BLOCK,
            mass=0.1,
            position=(0.0, ON_FINGER, BLOCK.size[2] / 2),
            friction=params["friction"],
            role="object",
        )
        scene.add_body(
            "effector",
            FINGER,
            mass=FINGER_MASS,
            position=(0.0, 0.0, FINGER.size[2] / 2),
            friction=1.0,
            role="effector",
            linear_factor=(1, 0, 0),  # it is held on its way along x
            angular_factor=(0, 0, 0),
        )
        return scene

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """What is drawn once for each trajectory, and kept with it."""
        return {"friction": random.uniform(0.05, 0.5)}

    def start(
        self, world: em.World, params: Params, random: np.random.Generator
    ) -> NDArray[np.float64]:
        """A random start: the block lies somewhere on the finger."""
        x = random.uniform(-0.03, 0.03)
        return world.scene.pack(object={"position": (x, ON_FINGER, BLOCK.size[2] / 2)})

    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """The script: a wrench on the finger for each step of the simulation."""
        wrenches = np.zeros((self.steps, 6))
        wrenches[:, 0] = self.pull * random.uniform(0.0, 2.0, self.steps)
        return Drive({"effector": wrenches})

    def captured(self, state: NDArray[np.float64], params: Params) -> em.regions.Region:
        """The capture set at a state."""
        return CARRIED

    def succeeded(self, params: Params) -> em.regions.Region:
        """The success set, for the end of a trajectory."""
        return CARRIED

    def problem(
        self,
        state: NDArray[np.float64],
        params: Params | None = None,
        contacts: Sequence[em.Contact] | None = None,
    ) -> em.Problem:
        """What is asked at each state: which disturbance shakes the block off?"""
        params = params or {"friction": 0.3}
        return em.Problem(
            self.scene(params),
            state,
            force=(0.1, 0.1, 0.0),  # N, on the block
            torque=(0.0, 0.0, 0.0),
            duration=0.2,  # s, longest edge of the search
            captured=self.captured(state, params),
            succeeded=self.succeeded(params),
            rate=50.0,  # 1/J
            contacts=contacts,
        )
