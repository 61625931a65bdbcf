"""Engines in numpy whose answers are known."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
from known_losses import STEP as WELL_STEP

import energymargin as em

__all__ = ["NumpyWell", "PointMass", "floating", "pushed_evenly"]

spec = spec_from_file_location(
    "own_engine_example", Path(__file__).parents[2] / "examples/07_own_engine.py"
)
example = sys.modules[spec.name] = module_from_spec(spec)  # pickle looks for it there
spec.loader.exec_module(example)
PointMass = example.PointMass


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
    """The example's question: does a ball of 1 kg stay within 2 cm for half a second?"""
    return example.problem(engine).replace(force=(force, 0, 0))


def pushed_evenly(problem, force):
    """One push a rollout, even within the force along x."""
    steps = round(problem.horizon / problem.scene.step)

    def draw(random, times):
        wrench = np.zeros((steps, 6))
        wrench[:, 0] = random.uniform(-force, force)
        return wrench

    return draw
