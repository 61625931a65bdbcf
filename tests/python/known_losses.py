"""Problems whose probability of loss is known: a block on a spring, pushed at random.

The spring holds the block at the bottom of a well; it is lost once it is farther than `way` from
there. Its damping and the random force are matched as those of a body in a fluid of temperature T
(k_B T in joules; fluctuation and dissipation): a force of standard deviation sigma, drawn anew each
step of dt, heats it as much as the damping c cools it at T = sigma² dt / 2 c. Where the damping is
strong, the displacement is an Ornstein-Uhlenbeck process, and the loss its first passage; where it
is weak, this is the escape from a well of Kramers (1940).

A step is linear: v' = a v + b x + g F, x' = x + dt v', with a normal F. So the probability u of
being lost within n steps from (x, v) follows from that of n - 1 steps (Kolmogorov's backward
equation):

    u_n(x, v) = E[1 if x' > way, else u_{n-1}(x', v')].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Problem, Scene, Sphere, World
from energymargin.disturbances import Gaussian

__all__ = ["HORIZON", "STEP", "STIFFNESS", "STRONG", "WAY", "WEAK", "Well"]

MASS, STIFFNESS, WAY = 1.0, 64.0, 0.1  # kg, N/m, m
STEP, HORIZON = 1 / 60, 2.0  # s
ARM = 10.0  # m, from the spring's fixed end to the block: its direction is that of the motion
REACH = 7.0  # standard deviations of the block at rest in its fluid, as far as the grid goes
CELLS = 3  # of the grid of velocities, in what one step's force changes at one standard deviation


@dataclass(frozen=True)
class Well:
    """A block on a damped spring in a random force."""

    damping: float
    """[N s/m]"""
    temperature: float
    """k_B T [J]"""

    @property
    def effort(self) -> float:
        """Least work [J] that takes the block out, in the limit of a slow way: k way²/2."""
        return 0.5 * STIFFNESS * WAY**2

    @property
    def disturbance(self) -> Gaussian:
        """The random force at this temperature."""
        force = math.sqrt(2.0 * self.damping * self.temperature / STEP)
        return Gaussian(force=force, torque=0.0, correlation_time=0.0)

    @cached_property
    def problem(self) -> Problem:
        """Whether the block is in the well for the next two seconds, looked at in each step."""
        scene = Scene(gravity=(0.0, 0.0, 0.0), step=STEP)
        scene.add_body("anchor", Sphere(0.01), mass=0.0, position=(-ARM, 0.0, 0.0))
        scene.add_body(
            "block",
            Sphere(0.05),
            mass=MASS,
            role="object",
            linear_factor=(1.0, 0.0, 0.0),
            angular_factor=(0.0, 0.0, 0.0),
        )
        scene.add_spring(
            "anchor", "block", stiffness=STIFFNESS, rest_length=ARM, damping=self.damping
        )
        return Problem(
            scene,
            scene.pack(),
            force=(1.0, 0.0, 0.0),
            torque=(0.0, 0.0, 0.0),
            duration=STEP,
            captured=regions.HalfSpace("block", normal=(1.0, 0.0, 0.0), offset=WAY),
            horizon=HORIZON,
            check=STEP,
        )

    def step(self, x: float, v: float, force: float) -> tuple[float, float]:
        """Displacement [m] and velocity [m/s] after one step of the simulation."""
        scene = self.problem.scene
        block = {"position": (x, 0.0, 0.0), "velocity": (v, 0.0, 0.0)}
        wrench = (force, 0.0, 0.0, 0.0, 0.0, 0.0)
        state = World(scene).rollout(scene.pack(block=block), wrench, STEP).state
        after = scene.unpack(state)["block"]
        return float(after["position"][0]), float(after["velocity"][0])

    def loss(self, cells: int = CELLS) -> float:
        """Probability of loss within the horizon, by the backward equation on a grid.

        Places are so far apart that a step of any velocity of the grid leads from one to another.
        """
        unit = 1e-3  # of each: the step is linear
        a, b = self.step(0.0, unit, 0.0)[1] / unit, self.step(unit, 0.0, 0.0)[1] / unit
        kick = self.step(0.0, 0.0, unit)[1] / unit * self.disturbance.force
        cell = kick / cells
        span = math.sqrt(self.temperature)
        fastest = round(REACH * span / math.sqrt(MASS) / cell)
        shifts = np.arange(-fastest, fastest + 1)
        velocities = cell * shifts
        count = round((WAY + REACH * span / math.sqrt(STIFFNESS)) / (STEP * cell))
        places = WAY - STEP * cell * np.arange(count)
        kernels = self._kernels(a * velocities, b * places, velocities, kick)
        after = np.arange(count)[:, None] - shifts[None, :]  # row of x' by those of x and v'
        lost = np.where(after < 0, 1.0, np.where(after == 0, 0.5, 0.0))  # the edge's cell: half
        rows = np.clip(after, 0, count - 1)
        columns = np.broadcast_to(np.arange(len(shifts)), after.shape)
        chance = np.zeros((count, len(shifts)))
        for _ in range(round(HORIZON / STEP)):
            value = lost + (1.0 - lost) * chance[rows, columns]
            chance = np.matmul(kernels, value[:, :, None])[:, :, 0]
        return float(np.interp(0.0, places[::-1], chance[::-1, fastest]))

    @staticmethod
    def _kernels(
        from_v: NDArray[np.floating[Any]],
        from_x: NDArray[np.floating[Any]],
        velocities: NDArray[np.floating[Any]],
        kick: float,
    ) -> NDArray[np.float64]:
        """Probabilities of each v' by x and v, shape (places, velocities, velocities)."""
        mean = from_x[:, None] + from_v[None, :]
        distance = (velocities[None, None, :] - mean[:, :, None]) / kick
        weights = np.exp(-0.5 * distance**2)
        weights /= math.sqrt(2.0 * math.pi) * kick / (velocities[1] - velocities[0])
        return np.asarray(weights)


WEAK, STRONG = 4.0, 24.0  # N s/m: a quarter of the critical damping, and one and a half
