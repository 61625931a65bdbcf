"""A race of candidates on the same draws: who is out, who leads, and how sure that is.

Two candidates are compared by the draws in which they differ, as McNemar's test does: of those, the
better one wins more than half. It needs no model of the values, so efforts are compared in the same
way.

Who is out is a forecast, with Jeffreys' prior: it decides what is simulated. What is claimed at the
end has to hold although a race looks often and ends when it likes. So it is tested by betting: the
likelihood of what came, in the mean over what may be true, as a multiple of the likelihood if the
claim is false. That multiple exceeds 1/a at any look with a probability of at most a (Ville 1939).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, betaln, logsumexp, ndtr

__all__ = ["Duel", "beaten", "duel", "looks"]

FIRST_LOOK = 16  # draws of each candidate before the first is out
GROWTH = 1.5  # from look to look
PRIOR = 0.5  # Jeffreys
TINY = 1e-300  # for the logarithm of a share that rounds to 0
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
    def bet(self) -> float:
        """Logarithm of the multiple of a bet that the first one wins more than half of the draws in
        which they differ: the mean over all such shares. Half of it, as the other half of the
        stakes is on the second one."""
        differ = self.wins + self.losses
        of_share = betaln(self.wins + 1, self.losses + 1)
        upper = np.log(betainc(self.losses + 1, self.wins + 1, 0.5) + TINY)
        return float(differ * np.log(2.0) + of_share + upper)

    @property
    def better(self) -> float:
        """Confidence, whenever one looks, that the first one wins more than half of the draws in
        which they differ."""
        return _confidence(self.bet)

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

    def hardly_worse(self, tolerance: float) -> float:
        """Probability that it is worse in at most this share of all draws: a forecast for races."""
        if tolerance == 0:
            return 0.0
        return float(betainc(self.losses + PRIOR, self.draws - self.losses + PRIOR, tolerance))

    def as_good(self, tolerance: float) -> float:
        """Confidence, whenever one looks, that it is worse in at most this share of all draws.

        So a probability of its own is lower by at most as much. Two thirds of the bet are on no
        losses at all, the rest on any share of losses up to the tolerance, even ones.
        """
        if tolerance == 0:
            return 0.0
        if tolerance == 1:
            return 1.0
        kept = self.draws - self.losses
        below = betainc(self.losses + 1, kept + 1, tolerance)
        if below == 0.0:
            return 0.0
        likely = betaln(self.losses + 1, kept + 1) + np.log(below / tolerance)
        none = np.log(2.0) if self.losses == 0 else -np.inf
        bets = np.logaddexp(likely, none) - np.log(3.0)
        edge = self.losses * np.log(tolerance) + kept * np.log1p(-tolerance)
        return _confidence(float(bets - edge))


def duel(first: NDArray[np.float64], second: NDArray[np.float64]) -> Duel:
    """Of the draws that both have, from the first one on; more is better."""
    both = min(len(first), len(second))
    ours, theirs = first[:both], second[:both]
    return Duel(int((ours > theirs).sum()), int((ours < theirs).sum()), both)


def beaten(against: list[Duel]) -> float:
    """Confidence, whenever one looks, that one candidate is not the best. It is the second of these
    duels, each other one is the first of one.

    If it is the best, no bet against it pays in the mean, so their mean does not either.
    """
    if not against:
        return 0.0
    bets = [one.bet for one in against]
    return _confidence(float(logsumexp(bets) - np.log(len(bets))))


def _confidence(log: float) -> float:
    """Of a bet that has this logarithm of a multiple."""
    return float(max(0.0, -np.expm1(-log))) if log > 0.0 else 0.0


def looks(draws: int) -> list[int]:
    """Numbers of draws after which a race looks at its candidates; the last is `draws`."""
    numbers, wanted = list[int](), FIRST_LOOK
    while wanted < draws:
        numbers.append(wanted)
        wanted = int(np.ceil(GROWTH * wanted))
    return [*numbers, draws]
