"""The best of k actions by their capture probabilities, under the same disturbances.

All candidates are asked with one seed, so they meet the same disturbances, draw by draw: common
random numbers. What they differ in is the action.

The policy's own action is kept unless another one is better by more than the statistical error. The
error is that of two independent shares, after Agresti and Caffo (2000), one-sided and shared out
over the candidates after Bonferroni. Common random numbers make the true error smaller, so the
choice errs towards the policy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from energymargin._core import CaptureProbability
from energymargin.divergence import is_unknown
from energymargin.reprs import short_repr

__all__ = ["Choice", "check_confidence", "choose", "share_of"]


@dataclass(frozen=True, eq=False)
class Choice:
    """Which candidate is taken."""

    __repr__ = short_repr

    number: int
    """Of the chosen candidate; 0 is the policy's action."""
    probabilities: NDArray[np.float64]
    """Of the candidates, NaN of those that were not asked, or of which too many rollouts diverged,
    shape (k,)."""


def choose(
    count: int, probability: Callable[[int], CaptureProbability], confidence: float
) -> Choice:
    """The best of `count` candidates by `probability(number)`; 0 unless another one is better by
    more than the statistical error.

    Candidates are asked until one is captured for certain, which none can exceed. Where even that
    would not be better by more than the error, the others are not asked. Nor are they where the
    policy's probability is unknown, since too many of its rollouts diverged.
    """
    probabilities = np.full(count, np.nan)
    first = probability(0)
    probabilities[0] = share_of(first)
    others = max(count - 1, 1)
    z = NormalDist().inv_cdf(1 - (1 - confidence) / others)
    if is_unknown(first) or not _better(1.0, first.effective, first, z):
        return Choice(0, probabilities)
    best, highest = 0, first.captured
    for number in range(1, count):
        found = probability(number)
        probabilities[number] = share = share_of(found)
        if share > highest and _better(share, found.effective, first, z):
            best, highest = number, share
        if highest == 1.0:
            break
    return Choice(best, probabilities)


def share_of(found: CaptureProbability) -> float:
    """The probability of staying captured; NaN if too many rollouts diverged."""
    return float("nan") if is_unknown(found) else float(found.captured)


def _better(share: float, size: float, than: CaptureProbability, z: float) -> bool:
    """Whether a share of `size` rollouts exceeds another by more than z standard errors."""
    ours, our_size = _adjusted(share, size)
    theirs, their_size = _adjusted(than.captured, than.effective)
    variance = ours * (1 - ours) / our_size + theirs * (1 - theirs) / their_size
    return bool(ours - theirs > z * np.sqrt(variance))


def _adjusted(share: float, size: float) -> tuple[float, float]:
    """With one success and one failure more (Agresti and Caffo)."""
    return (share * size + 1) / (size + 2), size + 2


def check_confidence(confidence: float) -> None:
    """Raises ValueError on a confidence with which nothing can be chosen."""
    if not (isinstance(confidence, Real) and 0.5 <= confidence < 1):
        raise ValueError(f"confidence is {confidence!r}, expected a number from 0.5 to below 1")
