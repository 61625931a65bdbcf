"""The score of one state, as the wrapper tells it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Any

from energymargin._core import CaptureProbability, Problem, capture_probability
from energymargin._core.disturbances import Boltzmann, Gaussian, OfPlan, Uniform
from energymargin.divergence import ANY, is_unknown
from energymargin.metrics import TIMED, check_metrics
from energymargin.scoring import SearchSettings, score
from energymargin.scoring.problem_metrics import chosen_metrics

__all__ = ["Disturbance", "Scorer"]

Disturbance = Uniform | Gaussian | Boltzmann | OfPlan

SIDES = {"probability": "captured", "probability/success": "success", "probability/any": "any"}


@dataclass(frozen=True)
class Scorer:
    """Scores problems by one metric."""

    metric: str
    settings: SearchSettings
    disturbance: Disturbance | None
    threads: int

    def __post_init__(self) -> None:
        """Checks the metric."""
        check_metrics([self.metric])

    def tell(self, problem: Problem, seed: int) -> dict[str, float]:
        """ "score" and, of a probability, "low" and "high", the ends of its 95 % interval, and
        "diverged", how many of its rollouts diverged; NaN but for that one if too many did.

        Raises ValueError on a problem that lacks what the metric asks about.
        """
        chosen_metrics([problem], [self.metric])
        if self.metric not in TIMED:
            table = score(
                [problem],
                [self.metric],
                settings=replace(self.settings, seed=seed),
                threads=self.threads,
            )
            return {"score": float(table[self.metric][0])}
        side = SIDES[self.metric]
        found = self.probability(problem, seed, success=side == "success", by_object=side == "any")
        if is_unknown(found):
            return {**dict.fromkeys(("score", "low", "high"), nan), "diverged": found.diverged}
        low, high = found.interval(which=side)
        value: Any = found.any.captured if found.any is not None else getattr(found, side)
        return {"score": float(value), "low": low, "high": high, "diverged": found.diverged}

    def probability(
        self, problem: Problem, seed: int, *, success: bool = False, by_object: bool = False
    ) -> CaptureProbability:
        """The capture probability of these settings; the same seed draws the same disturbances.

        Any number of the rollouts may diverge.
        """
        settings = self.settings
        uniform = Uniform(strength=settings.strength, objects=settings.objects)
        return capture_probability(
            problem,
            disturbance=self.disturbance or uniform,
            rollouts=settings.rollouts,
            seed=seed,
            threads=self.threads,
            success=success,
            by_object=by_object,
            undisturbed=False,
            most_diverged=ANY,
        )
