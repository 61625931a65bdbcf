"""Mean probability of many states from rollouts of a few: a surrogate as control variate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from energymargin.act.surrogates.model import Estimates
from energymargin.base.checks import numbers_of

WIDE = 1.959964  # standard errors of a 95 % interval


class ControlledMean(NamedTuple):
    """The mean probability of a population of states."""

    mean: float
    """Unbiased, however wrong the surrogate is."""
    interval: tuple[float, float]
    """95 % interval of the mean."""
    gain: float
    """Variance of the scores by that of what the surrogate leaves: so many times as many rollouts
    would say as much without it. Below 1 it does harm."""


def controlled_mean(
    scores: ArrayLike, estimates: Estimates, population: Estimates
) -> ControlledMean:
    """The mean probability of the N states of a `population`, of which n, drawn at random, have
    scores.

    Args:
        scores: probabilities of rollouts, one or more of each drawn state, from 0 to 1, shape (n,).
        estimates: of the surrogate for these n states.
        population: of the surrogate for all N states.

    It is the mean of all estimates and that of the n differences of scores and estimates
    (prediction-powered inference: Angelopoulos et al., 2023). A state that the surrogate refuses
    has the mean estimate. The interval counts one more difference, of 1: a surrogate that is rarely
    wrong may be right on all of a few states. Raises ValueError on fewer than two scores, on other
    shapes, and where all of the population is refused.
    """
    own = numbers_of("scores", scores)
    if own.ndim != 1 or len(own) < 2 or not ((own >= 0) & (own <= 1)).all():
        raise ValueError(f"scores is {own}, expected two or more from 0 to 1, shape (n,)")
    if np.shape(estimates.value) != own.shape:
        found = np.shape(estimates.value)
        raise ValueError(f"estimates has shape {found}, expected {own.shape}, one a score")
    if population.refused.all():
        raise ValueError("population is refused as a whole: learn from states like these")
    usual = float(np.nanmean(population.value))
    differences = own - np.where(estimates.refused, usual, estimates.value)
    squares, n = float(((differences - differences.mean()) ** 2).sum()), len(own)
    mean = usual + float(differences.mean())
    half = WIDE * float(np.sqrt((squares + 1) / (n - 1) / n))
    left = squares / (n - 1)
    gain = float(own.var(ddof=1)) / left if left else float("inf")
    return ControlledMean(mean, (max(mean - half, 0.0), min(mean + half, 1.0)), gain)
