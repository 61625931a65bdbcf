"""How the states of a dataset are sampled whose models are known with an error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energymargin.beliefs.gathering import MOST_PARTICLES
from energymargin.beliefs.uncertainty import Uncertainty
from energymargin.checks import whole_number
from energymargin.metrics import TIMED

__all__ = ["PARTICLES", "Sampling"]

PARTICLES = 16
"""Of a belief, where nothing else is said."""


@dataclass(frozen=True)
class Sampling:
    """What is not known, and how many particles each state has."""

    uncertainty: Uncertainty
    particles: int = PARTICLES

    def __post_init__(self) -> None:
        """Raises ValueError on what cannot be."""
        if not isinstance(self.uncertainty, Uncertainty):
            raise ValueError(
                f"uncertainty is {self.uncertainty!r}, expected an em.beliefs.Uncertainty"
            )
        count = whole_number("particles", self.particles, 1, MOST_PARTICLES)
        object.__setattr__(self, "particles", count)

    def __str__(self) -> str:
        """As a store's run names it."""
        return f"belief {self.uncertainty.to_json()}, {self.particles} particles"

    def all(self) -> dict[str, Any]:
        """As settings of a run."""
        return {"uncertainty": self.uncertainty.to_json(), "particles": self.particles}

    def of(self, metric: str) -> dict[str, Any]:
        """Those that change the value of a metric: a probability has a particle each rollout."""
        return {n: v for n, v in self.all().items() if n != "particles" or metric not in TIMED}

    @staticmethod
    def taken_from(settings: dict[str, Any]) -> Sampling | None:
        """That of the settings of a run, out of which it is taken; None if they have none."""
        uncertainty = settings.pop("uncertainty", None)
        if uncertainty is None:
            return None
        return Sampling(Uncertainty.from_json(uncertainty), settings.pop("particles"))
