"""Engines in numpy whose answers are known."""

import numpy as np
from known_losses import STEP as WELL_STEP

import energymargin as em

__all__ = ["NumpyWell", "PointMass", "floating", "pushed_evenly"]

STEP = 1 / 240


class PointMass(em.engines.Engine):
    """Forces move it, a wind along x among them, and nothing turns it."""

    name, step, commands = "point mass", STEP, {"wind": 0.0}

    def __init__(self, mass=1.0):
        self.mass = mass

    def digest(self):
        return f"{type(self).__name__} of {self.mass!r} kg"

    def play(self, batch):
        position, velocity = batch.states[:, :3].copy(), batch.states[:, 7:10].copy()
        states, work = [], np.empty((len(position), batch.steps, 1))
        for step in range(batch.steps):
            push = batch.pushes[:, step, 0, :3]
            force = push.copy()
            if "wind" in batch.commands:
                force[:, 0] += batch.commands["wind"][:, step]
            before, velocity = velocity, velocity + self.step / self.mass * force
            position = position + self.step * velocity
            work[:, step, 0] = self.step * (push * (before + velocity) / 2).sum(axis=1)
            if (step + 1) % batch.every == 0:
                states.append(batch.states.copy())
                states[-1][:, :3], states[-1][:, 7:10] = position, velocity
        return np.stack(states, axis=1), batch.memory, work


class NumpyWell(em.engines.Engine):
    """The block of a known well, on its spring."""

    name, step = "numpy well", WELL_STEP

    def __init__(self, well):
        self.well, unit = well, 1e-3
        self.a, self.b, self.g = (
            well.step(*start)[1] / unit for start in np.diag([unit] * 3)[[1, 0, 2]]
        )

    def digest(self):
        return repr(self.well)

    def play(self, batch):
        x, v = batch.states[:, 0].copy(), batch.states[:, 7].copy()
        states, work = [], np.empty((len(x), batch.steps, 1))
        for step in range(batch.steps):
            push = batch.pushes[:, step, 0, 0]
            before = v
            v = self.advance(x, v, push)
            x = x + self.step * v
            work[:, step, 0] = self.step * push * (before + v) / 2
            if (step + 1) % batch.every == 0:
                states.append(batch.states.copy())
                states[-1][:, 0], states[-1][:, 7] = x, v
        return np.stack(states, axis=1), batch.memory, work

    def advance(self, x, v, push):
        """Of the velocity: the law of the block, which is linear, in a native step."""
        return self.a * v + self.b * x + self.g * push


def floating(engine, force=0.5):
    """A ball of 1 kg that floats: does it stay within 2 cm for half a second?"""
    scene = em.Scene(gravity=(0, 0, 0), step=STEP, engine=engine)
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    inside = em.regions.Ball("ball", center=(0, 0, 0), radius=0.02)
    return em.Problem(
        scene,
        scene.pack(),
        captured=inside,
        force=(force, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        horizon=0.5,
    )


def pushed_evenly(problem, force):
    """One push a rollout, even within the force along x."""
    steps = round(problem.horizon / problem.scene.step)

    def draw(random, times):
        wrench = np.zeros((steps, 6))
        wrench[:, 0] = random.uniform(-force, force)
        return wrench

    return draw
