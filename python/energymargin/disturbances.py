"""What may act on the objects at random over a horizon: models that `capture_probability` takes.

Each says what it draws; a probability means something under a stated disturbance alone.
"""

import copyreg
import json
from typing import Any

import numpy as np

from energymargin._core.disturbances import ActuationNoise, Boltzmann, Gaussian, Uniform, of_plan

__all__ = [
    "ActuationNoise",
    "Boltzmann",
    "Disturbance",
    "Gaussian",
    "Uniform",
    "of_plan",
    "text_of",
]

Disturbance = Uniform | Gaussian | Boltzmann | ActuationNoise

# They travel to other processes as the calls that make them again.
copyreg.pickle(Uniform, lambda m: (Uniform, (m.strength, m.objects, m.hold)))
copyreg.pickle(Gaussian, lambda m: (Gaussian, (m.force, m.torque, m.correlation_time)))
copyreg.pickle(Boltzmann, lambda m: (Boltzmann, (m.rate, m.strength, m.objects, m.hold)))
copyreg.pickle(ActuationNoise, lambda m: (of_plan, (m.force, m.torque, m.targets, m.hold)))


def text_of(model: Disturbance) -> str:
    """A model as JSON text, the same for equal ones alone, to the last bit."""
    reduce: Any = copyreg.dispatch_table[type(model)]
    make, arguments = reduce(model)
    return json.dumps([make.__name__, *arguments], default=lambda array: np.asarray(array).tolist())
