"""A race of candidates on the same draws: who is out, who leads, and how sure that is.

Two candidates are compared by the draws in which they differ, as McNemar's test does: of those, the
better one wins more than half. It needs no model of the values, so efforts are compared in the same
way.

A claim has to hold although a race looks often and ends when it likes. So it is tested by betting:
the likelihood of what came, in the mean over what may be true, as a multiple of the likelihood if
the claim is false. That multiple exceeds 1/a at any look with a probability of at most a (Ville
1939). It asks for independent draws. The same bets decide who is out and what is said at the end.

One of several probabilities is the largest, so who is beaten by any other is not the best. Efforts
may beat each other in a circle, A in most draws B, B in most C and C in most A. Then none is the
best: the best one beats each other one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, betaln, logsumexp

FIRST_LOOK = 16  # draws of each candidate before the first is out
GROWTH = 1.5  # from look to look
TINY = 1e-300  # for the logarithm of a share that rounds to 0


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
        """Log e-value that the first candidate beats the second one: it wins more than half of the
        draws in which they differ. The mean over all such shares, halved, as the other half of the
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
    """Duel on the draws that both have, from the first one on; more is better, NaN is no draw."""
    both = min(len(first), len(second))
    ours, theirs = first[:both], second[:both]
    draws = ~(np.isnan(ours) | np.isnan(theirs))
    return Duel(int((ours > theirs).sum()), int((ours < theirs).sum()), int(draws.sum()))


def beaten(against: list[Duel]) -> float:
    """Confidence, whenever one looks, that one candidate is not the best. It is the second of these
    duels, each other one is the first of one.

    If it is the best, no bet against it pays in the mean, so their mean does not either.
    """
    if not against:
        return 0.0
    bets = [one.bet for one in against]
    return _confidence(float(logsumexp(bets) - np.log(len(bets))))


def beats(one: Duel, candidates: int) -> float:
    """Confidence, whenever one looks, that the first one beats the second one, where any of so many
    candidates may be chosen as the one that beats each other one.

    A candidate that is chosen by mistake has won a bet against one that it does not beat. The mean
    of one such bet of each candidate does not pay.
    """
    return _confidence(one.bet - float(np.log(candidates)))


def mistaken(candidates: int, *, circle: bool) -> int:
    """How many candidates may come first by mistake: all but the best one; all, where they may beat
    each other in a circle."""
    return candidates if circle else max(candidates - 1, 1)


def _confidence(log: float) -> float:
    """Confidence of a bet with this log e-value."""
    return float(max(0.0, -np.expm1(-log))) if log > 0.0 else 0.0


def looks(draws: int) -> list[int]:
    """Numbers of draws after which a race looks at its candidates; the last is `draws`."""
    numbers, wanted = list[int](), FIRST_LOOK
    while wanted < draws:
        numbers.append(wanted)
        wanted = int(np.ceil(GROWTH * wanted))
    return [*numbers, draws]
