"""A disturbance that grows while all candidates withstand it, so that a search still has a slope.

Where every plan holds for certain, no draw tells which holds best. The strongest disturbance that a
plan withstands does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.actions.trials import Disturbance
from energymargin.disturbances import Gaussian, OfPlan, Uniform, of_plan

__all__ = ["adapted", "scaled"]

GROWTH = 1.25  # of the disturbance, from one generation to the next
HOLD = 0.9  # where half of the candidates hold so well, it grows
FAIL = 0.5  # where no candidate holds so well, it shrinks again
MOST = 20.0  # times the stated one


def adapted(factor: float, scores: NDArray[np.float64]) -> float:
    """The factor of the next generation, after the scores of one, shape (P,)."""
    if len(scores) == 0:
        return factor
    if float(np.median(scores)) > HOLD:
        return min(factor * GROWTH, MOST)
    return max(factor / GROWTH, 1.0) if max(scores) < FAIL else factor


def scaled(disturbance: Disturbance | None, factor: float) -> Disturbance | None:
    """So many times as strong."""
    if factor == 1.0:
        return disturbance
    if disturbance is None:
        return Uniform(factor)
    if isinstance(disturbance, Uniform):
        return Uniform(factor * disturbance.strength, disturbance.objects, disturbance.hold)
    if isinstance(disturbance, Gaussian):
        force, torque = factor * disturbance.force, factor * disturbance.torque
        return Gaussian(force, torque, disturbance.correlation_time)
    if isinstance(disturbance, OfPlan):
        force_, torque_ = factor * disturbance.force, factor * disturbance.torque
        return of_plan(force_, torque_, factor * disturbance.targets, disturbance.hold)
    return _Scaled(disturbance, factor) if callable(disturbance) else disturbance


@dataclass(frozen=True)
class _Scaled:
    """A user's function, so many times as strong."""

    function: Callable[[Any, Any], Any]
    factor: float

    def __call__(self, random: Any, times: Any) -> Any:
        """Wrenches of all steps."""
        return self.factor * np.asarray(self.function(random, times))
