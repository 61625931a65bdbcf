"""Rollouts that diverge, whose numbers are not finite any more: how many a result may have.

They are left out and counted. One may always diverge, and of many rollouts one in a hundred. Above
that a direct call raises, and a stream of scores has NaN, with the count.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from energymargin._core import CaptureProbability

__all__ = ["ANY", "is_unknown", "too_many_diverged"]

ANY = 1.0
"""The `most_diverged` of a stream, which asks `is_unknown` of each probability."""

MOST = 0.01  # of a result's rollouts; DivergedError says it


def _most_of(rollouts: int) -> int:
    """How many of so many rollouts may diverge, if others are left."""
    return min(max(1, int(MOST * rollouts)), rollouts - 1)


def too_many_diverged(diverged: int, rollouts: int) -> bool:
    """Whether so many of the rollouts, those that diverged among them, are too many."""
    return diverged > _most_of(rollouts)


def is_unknown(probability: CaptureProbability) -> bool:
    """Whether too many of its rollouts diverged."""
    return too_many_diverged(probability.diverged, probability.rollouts + probability.diverged)
