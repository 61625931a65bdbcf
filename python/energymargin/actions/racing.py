"""A race of candidates on the same draws: who is out, who leads, and how sure that is.

Two candidates are compared by the draws in which they differ, as McNemar's test does: of those, the
better one wins more than half. With a Jeffreys prior the posterior of that share is a beta
distribution. It needs no model of the values, so efforts are compared in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, ndtr

__all__ = ["Duel", "duel", "looks", "sure_of"]

FIRST_LOOK = 16  # draws of each candidate before the first is out
GROWTH = 1.5  # from look to look
PRIOR = 0.5  # Jeffreys
HALF = 0.5  # a draw: correction for continuity


@dataclass(frozen=True)
class Duel:
    """One candidate against another, on the same draws."""

    wins: int
    """Draws in which the first one is better."""
    losses: int
    """Draws in which it is worse."""
    draws: int

    @property
    def better(self) -> float:
        """Probability that the first one wins more than half of the draws in which they differ."""
        return float(betainc(self.losses + PRIOR, self.wins + PRIOR, 0.5))

    def overtaken(self, more: int) -> float:
        """Probability that after so many more draws, one at least, the second one leads.

        Of a normal distribution with the mean and variance of the number of wins less losses, whose
        rates have a Dirichlet posterior.
        """
        lead = self.wins - self.losses
        total = self.draws + 3 * PRIOR
        win, loss = (self.wins + PRIOR) / total, (self.losses + PRIOR) / total
        of_draw = win + loss - (win - loss) ** 2
        variance = more * of_draw * (1.0 + more / (total + 1.0))
        return float(ndtr((-lead - HALF - more * (win - loss)) / np.sqrt(variance)))

    def as_good(self, tolerance: float) -> float:
        """Probability that it is worse in at most this share of all draws.

        So a probability of its own is lower by at most as much.
        """
        if tolerance == 0:
            return 0.0
        return float(betainc(self.losses + PRIOR, self.draws - self.losses + PRIOR, tolerance))

    def settled(self, tolerance: float) -> float:
        """Probability that the first one may be chosen: it is better, or as good."""
        return max(self.better, self.as_good(tolerance))


def duel(first: NDArray[np.float64], second: NDArray[np.float64]) -> Duel:
    """Of the draws that both have, from the first one on; more is better."""
    both = min(len(first), len(second))
    ours, theirs = first[:both], second[:both]
    return Duel(int((ours > theirs).sum()), int((ours < theirs).sum()), both)


def sure_of(duels: list[Duel], tolerance: float) -> float:
    """Probability, at least, that the first one of all these duels may be chosen (Bonferroni)."""
    return max(0.0, 1.0 - sum(1.0 - duel.settled(tolerance) for duel in duels))


def looks(draws: int) -> list[int]:
    """Numbers of draws after which a race looks at its candidates; the last is `draws`."""
    numbers, wanted = list[int](), FIRST_LOOK
    while wanted < draws:
        numbers.append(wanted)
        wanted = int(np.ceil(GROWTH * wanted))
    return [*numbers, draws]
