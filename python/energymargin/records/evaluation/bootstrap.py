"""AUC and AP, with bootstrap intervals over trajectories."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import Floats, Ints, Mask

__all__ = ["auc_ap", "auc_ap_draws", "bootstrap_weights", "central", "intervals", "ranked"]

DRAWS = 1000  # bootstrap draws
MOST_WEIGHTS = 2**18  # at a time, which fit into a cache
CONFIDENCE = 0.95

Interval = tuple[float, float]


def auc_ap(scores: Floats, labels: Mask) -> tuple[float, float]:
    """AUC and AP of scores, shape (N,), that may be infinite; there are labels of both kinds."""
    from sklearn.metrics import average_precision_score, roc_auc_score

    ranks = ranked(scores)
    return float(roc_auc_score(labels, ranks)), float(average_precision_score(labels, ranks))


def ranked(scores: Floats) -> Ints:
    """Ranks of the scores from 0, shape (N,); scikit-learn refuses inf."""
    return np.asarray(np.unique(scores, return_inverse=True)[1])


def intervals(
    ranks: Ints, labels: Mask, trajectory: Ints, weights: Ints
) -> tuple[Interval | None, Interval | None]:
    """Bootstrap intervals of AUC and AP; arguments as of `auc_ap_draws`.

    None if there are fewer than two trajectories, or no draw has both labels. If no draw has an
    error, as of a perfect score, draws do not tell how rare errors are: then the other end is the
    least share of successes that is still likely with so many trajectories without an error
    (`_error_free`).
    """
    if len(np.unique(trajectory)) < 2:
        return None, None
    draws = auc_ap_draws(ranks, labels, trajectory, weights)
    aucs, aps = (values[~np.isnan(values)] for values in draws)
    trials = min(len(np.unique(trajectory[labels == kind])) for kind in (False, True))
    return _interval(aucs, trials), _interval(aps, trials)


def auc_ap_draws(
    ranks: Ints, labels: Mask, trajectory: Ints, weights: Ints
) -> tuple[Floats, Floats]:
    """AUC and AP for each draw of whole trajectories, shape (draws,); NaN where a draw has one
    label alone.

    Each of N samples takes the column of its trajectory, (N,), of the (draws, T) weights.
    """
    if not len(ranks):
        return np.full(len(weights), np.nan), np.full(len(weights), np.nan)
    order, first = thresholds(ranks)
    labels, trajectory = labels[order], trajectory[order]
    small = weights.astype(np.int32)  # what takes the time is memory
    block = max(1, MOST_WEIGHTS // len(trajectory))
    blocks = (small[start : start + block] for start in range(0, len(weights), block))
    draws = [weighted_auc_ap(labels, own.take(trajectory, axis=1), first) for own in blocks]
    aucs, aps = (np.concatenate(values) for values in zip(*draws, strict=True))
    return aucs, aps


def thresholds(ranks: Ints) -> tuple[Ints, Ints]:
    """The samples from the best score down, (N,), and where among them a new threshold starts."""
    order = np.argsort(-ranks, kind="stable")
    return order, np.flatnonzero(np.diff(ranks[order], prepend=np.inf))


def weighted_auc_ap(labels: Mask, weights: NDArray[Any], first: Ints) -> tuple[Floats, Floats]:
    """AUC and AP for each row of `weights`, (draws, N), the number of times each of N samples
    counts; labels (N,) and weights from the best score down, as `thresholds` orders them.

    The values of scikit-learn with `sample_weight`, for all draws at once; one by one they take a
    minute for a table. NaN for draws in which only one label is left.
    """
    positive, every = weights * labels, weights
    if len(first) < len(labels):
        positive, every = (np.add.reduceat(each, first, axis=1) for each in (positive, every))
    true, above = (each.cumsum(axis=1, dtype=each.dtype) for each in (positive, every))
    positives = true[:, -1]
    negatives = (above[:, -1] - positives).astype(np.float64)
    one_label = (positives == 0) | (negatives == 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        pairs = ((every - positive) * (true - 0.5 * positive)).sum(axis=1)  # a tie counts half
        auc = pairs / (positives * negatives)
        ap = (positive * (true / np.maximum(above, 1))).sum(axis=1) / positives
    auc[one_label] = ap[one_label] = np.nan
    return auc, ap


def bootstrap_weights(trajectories: int, draws: int, seed: int) -> Ints:
    """How often each trajectory is drawn, shape (draws, T)."""
    even = np.full(trajectories, 1 / trajectories)
    return np.random.default_rng(seed).multinomial(trajectories, even, size=draws)


def _interval(values: Floats, trials: int) -> Interval | None:
    """Quantiles of the draws; one-sided, from `trials` trajectories, if no draw has an error."""
    if len(values) and (values == 1.0).all():
        return _error_free(trials), 1.0
    if len(values) and (values == 0.0).all():
        return 0.0, 1.0 - _error_free(trials)
    return central(values)


def central(values: Floats) -> Interval | None:
    """Between what the middle 95 % of the values lie that are not NaN; None if there are none."""
    if np.isnan(values).all():
        return None
    tail = (1 - CONFIDENCE) / 2
    low, high = np.nanquantile(values, [tail, 1 - tail])
    return float(low), float(high)


def _error_free(trials: int) -> float:
    """The least share of successes with which `trials` in a row are still likely, at CONFIDENCE."""
    return float((1 - CONFIDENCE) ** (1 / trials))
