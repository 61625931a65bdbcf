"""What may act on the objects at random over a horizon: models that `capture_probability` takes.

Each says what it draws; a probability means something under a stated disturbance alone.
"""

from energymargin._core.disturbances import Boltzmann, Gaussian, OfPlan, Uniform, of_plan

__all__ = ["Boltzmann", "Gaussian", "OfPlan", "Uniform", "of_plan"]
