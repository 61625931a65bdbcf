"""A simulator of your own answers the same questions: here a point mass, in numpy.

What has to be written is `play`: many rollouts at once, from any state, one row each.
"""

import numpy as np

import energymargin as em

STEP = 1 / 240


class PointMass(em.engines.Engine):
    """Forces move it, a wind along x among them, which plans command, and nothing turns it."""

    name, step, commands = "point mass", STEP, {"wind": 0.0}

    def __init__(self, mass: float = 1.0) -> None:
        """`mass`: in kg."""
        self.mass = mass

    def digest(self) -> str:
        """What else would be another engine."""
        return f"{type(self).__name__} of {self.mass!r} kg"

    def play(self, batch):
        """States at the check times, no memory, and the work of the push in each step."""
        position, velocity = batch.states[:, :3].copy(), batch.states[:, 7:10].copy()
        states, work = [], np.empty((len(position), batch.steps, 1))
        wind = np.zeros_like(batch.pushes[:, :, 0, :3])
        wind[..., 0] = batch.commands.get("wind", 0.0)
        for step in range(batch.steps):
            push = batch.pushes[:, step, 0, :3]
            before, velocity = velocity, velocity + STEP / self.mass * (push + wind[:, step])
            position = position + STEP * velocity
            work[:, step, 0] = STEP * (push * (before + velocity) / 2).sum(axis=1)
            if (step + 1) % batch.every == 0:
                states.append(batch.states.copy())
                states[-1][:, :3], states[-1][:, 7:10] = position, velocity
        return np.stack(states, axis=1), batch.memory, work


def problem(engine: em.engines.Engine) -> em.Problem:
    """A ball of 1 kg that floats: does it stay within 2 cm for half a second?"""
    scene = em.Scene(gravity=(0, 0, 0), step=STEP, engine=engine)
    scene.add_body("ball", em.Sphere(0.05), mass=1.0, role="object")
    inside = em.regions.Ball("ball", center=(0, 0, 0), radius=0.02)
    return em.Problem(
        scene,
        scene.pack(),
        captured=inside,
        force=(0.5, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        horizon=0.5,
    )


if __name__ == "__main__":
    asked = problem(PointMass())
    em.engines.check(PointMass(), asked)
    print(em.capture_probability(asked, rollouts=400))
    print(f"effort {em.escape_effort(asked, nodes=2000).effort:.4f} J")
