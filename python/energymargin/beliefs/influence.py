"""Which parameter matters most: first-order shares of a score's variance, from the particles alone.

The first-order share of a source (its Sobol index) is the part of the score's variance that would
go if the source were known. It is read off an additive regression on the points at which particles
were drawn: Legendre polynomials of the first and the second degree of each input. The sources are
independent, so their shares add up to at most 1; what is left are interactions, what two degrees do
not follow, and the randomness of the searches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["PARTICLES_A_TERM", "Share", "shares"]

PARTICLES_A_TERM = 4  # below, a regression says more of the particles than of the score


@dataclass(frozen=True)
class Share:
    """Of a score's variance, that of one source."""

    value: float
    """Adjusted for the number of terms; of a source that does not matter it may be below 0. NaN of
    too few particles."""
    stderr: float
    """By the jackknife."""


def shares(
    points: NDArray[np.float64], inputs: Sequence[int], scores: NDArray[np.float64]
) -> list[Share]:
    """Of each source, which has so many of the columns of `points`, shape (N, D); scores (N,).

    NaN with fewer than four particles for each term of the regression, scores that are not finite,
    or that do not differ.
    """
    last = np.cumsum(inputs, dtype=int)
    columns = [_terms(points[:, b - a : b]) for a, b in zip(inputs, last, strict=True)]
    found = []
    for terms in columns:
        enough = len(scores) >= PARTICLES_A_TERM * (1 + terms.shape[1])
        if not enough or not np.isfinite(scores).all() or np.ptp(scores) == 0:
            found.append(Share(np.nan, np.nan))
            continue
        without = np.array([_share(*_without(k, terms, scores)) for k in range(len(scores))])
        count = len(scores)
        spread = float(np.sqrt((count - 1) / count * ((without - without.mean()) ** 2).sum()))
        found.append(Share(_share(terms, scores), spread))
    return found


def _terms(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Legendre polynomials of degree 1 and 2 of each column, (N, 2 D)."""
    x = 2 * points - 1
    return np.concatenate([x, (3 * x**2 - 1) / 2], axis=1)


def _share(terms: NDArray[np.float64], scores: NDArray[np.float64]) -> float:
    """R squared, adjusted (Wherry) for the number of terms."""
    count, degrees = terms.shape
    total = float(((scores - scores.mean()) ** 2).sum())
    if total == 0:
        return 0.0
    matrix = np.column_stack([np.ones(count), terms])
    fitted = matrix @ np.linalg.lstsq(matrix, scores, rcond=None)[0]
    left = float(((scores - fitted) ** 2).sum())
    return float(1 - (left / (count - degrees - 1)) / (total / (count - 1)))


def _without(
    k: int, terms: NDArray[np.float64], scores: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.delete(terms, k, axis=0), np.delete(scores, k)
