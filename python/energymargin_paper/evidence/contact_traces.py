"""What bodies of a scene do in one simulation: their places and velocities over time."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from energymargin._core import Plan, Scene, World
from energymargin.base.aliases import Floats
from energymargin.base.plausibility import PlausibilityWarning

__all__ = ["GRAVITY", "MILLI", "Trace", "simulated", "steps_of"]

GRAVITY = 9.81  # m/s^2
MILLI = 1e3  # mm in a metre


@dataclass(frozen=True, eq=False)
class Trace:
    """The states that one simulation goes through, the start first."""

    scene: Scene
    times: Floats
    """Shape (K,) [s]."""
    states: Floats
    """Shape (K, n)."""

    def of(self, body: str, what: str) -> Floats:
        """Its position, orientation, velocity or angular_velocity, shape (K, 3) or (K, 4)."""
        return np.array([self.scene.unpack(state)[body][what] for state in self.states])

    def position(self, body: str) -> Floats:
        """Positions of the body's frame, shape (K, 3) [m]."""
        return self.of(body, "position")

    def height(self, body: str) -> Floats:
        """Heights of the body's frame, shape (K,) [m]."""
        return self.position(body)[:, 2]

    def at(self, time: float) -> int:
        """The frame that is nearest to a time [s]."""
        return int(np.abs(self.times - time).argmin())


def steps_of(scene: Scene, duration: float) -> int:
    """Steps of a scene in a duration [s]."""
    return max(1, round(duration / scene.step))


def simulated(
    scene: Scene,
    duration: float,
    *,
    plan: Plan | None = None,
    state: Floats | None = None,
    every: int = 1,
    drives: dict[str, Floats] | None = None,
    targets: dict[str, Floats] | None = None,
) -> Trace:
    """The scene from its start on, with a frame after every so many steps and one at the end.

    `drives` are wrenches on bodies, shape (steps, 6) [N, N m], `targets` those of joints, shape
    (steps,). With either there is no plan.
    """
    steps = steps_of(scene, duration)
    frames = sorted({*range(0, steps + 1, every), steps})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)  # masses of random scenes are odd
        world = World(scene, plan)
        start = scene.pack() if state is None else state
        result = world.simulate(start, steps, drives or {}, targets or {}, frames)
    return Trace(scene, scene.step * np.array(frames, dtype=float), np.array(result.states))
