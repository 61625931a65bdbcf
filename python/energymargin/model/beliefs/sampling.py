"""How many particles a belief about a state has: settings of a scoring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energymargin.base.checks import check_type, whole_number
from energymargin.base.metrics import TIMED
from energymargin.model.beliefs.uncertainty import Uncertainty

PARTICLES = 16
"""Default number of particles of a belief."""
MOST_PARTICLES = 2**16


@dataclass(frozen=True)
class Sampling:
    """What is not known, and how many particles each state has."""

    uncertainty: Uncertainty
    particles: int = PARTICLES

    def __post_init__(self) -> None:
        """Raises ValueError on what cannot be."""
        check_type("uncertainty", self.uncertainty, Uncertainty, "an em.beliefs.Uncertainty")
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
