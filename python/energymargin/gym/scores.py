"""The score of one state, as the wrapper tells it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Any

from energymargin._core import CaptureProbability, Problem
from energymargin._core.disturbances import Boltzmann, Gaussian, OfPlan, Uniform
from energymargin.divergence import ANY, is_unknown
from energymargin.metrics import TIMED, check_metrics
from energymargin.searches import SearchSettings, chosen_metrics, metric_search, value_of

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
            found = self._search(problem, self.metric, seed)
            return {"score": value_of(self.metric, found)}
        found = self._search(problem, self.metric, seed, most_diverged=ANY)
        if is_unknown(found):
            return {**dict.fromkeys(("score", "low", "high"), nan), "diverged": found.diverged}
        low, high = found.interval(which=SIDES[self.metric])
        value = value_of(self.metric, found)
        return {"score": value, "low": low, "high": high, "diverged": found.diverged}

    def probability(self, problem: Problem, seed: int) -> CaptureProbability:
        """The capture probability of these settings; the same seed draws the same disturbances.

        Any number of the rollouts may diverge.
        """
        found: CaptureProbability = self._search(problem, "probability", seed, most_diverged=ANY)
        return found

    def _search(self, problem: Problem, metric: str, seed: int, **keywords: Any) -> Any:
        """As of problem 0 of a batch with this seed, and with common random numbers."""
        settings = replace(self.settings, seed=seed, common_random_numbers=True)
        if metric in TIMED:
            keywords |= {"disturbance": self.disturbance, "undisturbed": False}
        return metric_search(problem, metric, settings, 0, threads=self.threads, **keywords)
