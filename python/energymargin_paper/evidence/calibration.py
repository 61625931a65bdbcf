"""Whether a probability means what it says: of the states that have .7, are 70 % captured?"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BINS", "Reliability", "brier", "calibration_error", "reliability"]

BINS = 10


class Reliability(NamedTuple):
    """Bins of about equal mass, from the lowest probabilities to the highest, shape (B,) each."""

    predicted: NDArray[np.float64]
    """Mean probability."""
    happened: NDArray[np.float64]
    """Share of what happened, or its mean."""
    size: NDArray[np.int64]
    """How many are in it."""


def reliability(
    probabilities: NDArray[np.float64], outcomes: NDArray[np.float64], *, bins: int = BINS
) -> Reliability:
    """Probabilities, shape (N,), and outcomes from 0 to 1, shape (N,), in up to `bins` bins.

    The borders are quantiles; equal probabilities are never in two bins, so there may be fewer.
    """
    borders = np.unique(np.quantile(probabilities, np.linspace(0, 1, bins + 1)[1:-1]))
    number = np.searchsorted(borders, probabilities, side="left")
    _, number, size = np.unique(number, return_inverse=True, return_counts=True)
    return Reliability(
        np.bincount(number, probabilities) / size, np.bincount(number, outcomes) / size, size
    )


def calibration_error(
    probabilities: NDArray[np.float64], outcomes: NDArray[np.float64], *, bins: int = BINS
) -> float:
    """Expected calibration error: the mean over the bins of `reliability` of how far the mean
    probability is from what happened, each by its size. Arguments: as `reliability`."""
    found = reliability(probabilities, outcomes, bins=bins)
    return float(np.average(np.abs(found.predicted - found.happened), weights=found.size))


def brier(probabilities: NDArray[np.float64], outcomes: NDArray[np.float64]) -> float:
    """Brier score: the mean squared difference, 0 at best; .25 if all is .5."""
    return float(np.mean((probabilities - outcomes) ** 2))
