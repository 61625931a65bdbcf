"""What disturbs things that stand: knocks, and a support that is shaken or leans."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from energymargin import Problem, Scene
from energymargin.placing.boxes import Floats, frame_of

PIECE = 0.1  # s, of a knock
RATES = (1.0, 6.0)  # Hz, of a shake


@dataclass(frozen=True, eq=False)
class Jolts:
    """Random forces on the objects of a scene, as a disturbance of `em.rank`.

    A knock is a force along each axis, even up to `knock` times their mean weight, on each body,
    for 0.1 s after 0.1 s. In a support that is shaken along a random horizontal direction, or leans
    in one, a body feels a force in proportion to its mass.
    """

    masses: Floats
    """Of the objects [kg], (k,)."""
    mean: float
    """Of those, as they are believed most [kg]."""
    frame: Floats
    """Two horizontal axes and the one that is up, (3, 3)."""
    gravity: float
    """[m/s^2]"""
    knock: float = 0.0
    """Largest force along each axis, as a share of the mean weight."""
    shake: float = 0.0
    """Largest peak of the support's acceleration [m/s^2]."""
    tilt: float = 0.0
    """Largest slope of the support [rad]."""

    @staticmethod
    def of(scene: Scene, *, knock: float, shake: float, tilt: float) -> Jolts:
        """Those of a scene's objects."""
        masses, gravity = _masses(scene), float(np.linalg.norm(scene.gravity))
        return Jolts(masses, float(masses.mean()), frame_of(scene), gravity, knock, shake, tilt)

    def of_problem(self, problem: Problem) -> Jolts:
        """The same in a problem whose objects have other masses: what is heavy feels more."""
        return replace(self, masses=_masses(problem.scene))

    def __call__(self, random: np.random.Generator, times: Floats) -> Floats:
        """Forces [N] and torques [N m] at these times (steps,), shape (steps, 6 k)."""
        count, (one, other, up) = len(self.masses), self.frame
        pieces = 1 + int(times[-1] / PIECE)
        knocks = self.knock * self.gravity * random.uniform(-1, 1, (pieces, count, 3))
        leaning, size, shaken, phase = random.random(4)
        rate = random.uniform(*RATES)
        angle, tilt = 2 * np.pi * leaning, self.tilt * size
        along = np.cos(angle) * one + np.sin(angle) * other
        change = self.gravity * (np.sin(tilt) * along + (1 - np.cos(tilt)) * up)
        angle = 2 * np.pi * shaken
        along = np.cos(angle) * one + np.sin(angle) * other
        wave = self.shake * random.random() * np.sin(2 * np.pi * (rate * times + phase))
        wrenches = np.zeros((len(times), count, 6))
        wrenches[:, :, :3] = self.mean * knocks[(times / PIECE).astype(int)]
        wrenches[:, :, :3] += self.masses[:, None] * (change + wave[:, None] * along)[:, None]
        return wrenches.reshape(len(times), -1)


def _masses(scene: Scene) -> Floats:
    """Of the objects [kg], (k,), as the scene's engine has them."""
    objects = [body for body in scene.bodies if body.role == "object"]
    varied = getattr(scene.engine, "varies", {})
    return np.array([varied.get(f"mass.{body.name}", body.mass) for body in objects])
