"""Rollouts that diverge, whose numbers are not finite any more: how many a result may have.

They are left out and counted. One may always diverge, and of many rollouts one in a hundred. Above
that a direct call raises, and a stream of scores has NaN, with the count.
"""

from __future__ import annotations

from energymargin._core import CaptureProbability, too_many_diverged

__all__ = ["ANY", "MOST", "is_unknown", "too_many_diverged"]

MOST = 0.01
"""The `most_diverged` of a direct call."""
ANY = 1.0
"""The `most_diverged` of a stream, which asks `is_unknown` of each probability."""


def is_unknown(probability: CaptureProbability) -> bool:
    """Whether too many of its rollouts diverged."""
    diverged = probability.diverged
    return bool(too_many_diverged(diverged, probability.rollouts + diverged))
