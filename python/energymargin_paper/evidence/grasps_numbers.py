"""Figures of scores beside labels, with intervals over whole objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.evaluation.bootstrap import (
    DRAWS,
    auc_ap,
    auc_ap_draws,
    bootstrap_weights,
    intervals,
    ranked,
)
from energymargin_paper.evidence.calibration import brier

__all__ = ["Figure", "area", "kappa", "learned", "others_mean", "paired", "scaled", "within"]

Numbers = NDArray[np.float64]
Groups = NDArray[np.int64]
TAIL = 0.025


class Figure(NamedTuple):
    """A number and the ends of its interval of 95 %; NaN if there is none."""

    value: float
    low: float = np.nan
    high: float = np.nan

    def __str__(self) -> str:
        """As in a table."""
        if np.isnan(self.value):
            return "-"
        ends = "" if np.isnan(self.low) else f" ({self.low:.2f} to {self.high:.2f})"
        return f"{self.value:.3f}{ends}"


def area(scores: Numbers, labels: NDArray[np.bool_], groups: Groups) -> Figure:
    """AUC of scores (N,); NaN among them are below all others. Groups are drawn as a whole."""
    if labels.all() or not labels.any():
        return Figure(np.nan)
    known = _known(scores)
    value, _ = auc_ap(known, labels)
    ends, _ = intervals(ranked(known), labels, groups, _weights(groups))
    return Figure(value, *(ends or (np.nan, np.nan)))


def paired(one: Numbers, other: Numbers, labels: NDArray[np.bool_], groups: Groups) -> Figure:
    """AUC of one score less that of another one, on the same draws of whole groups."""
    values, draws = [], []
    for scores in (_known(one), _known(other)):
        values.append(auc_ap(scores, labels)[0])
        draws.append(auc_ap_draws(ranked(scores), labels, groups, _weights(groups))[0])
    return Figure(values[0] - values[1], *np.nanquantile(draws[0] - draws[1], [TAIL, 1 - TAIL]))


def within(scores: Numbers, labels: NDArray[np.bool_], groups: Groups) -> Figure:
    """Share of the pairs of a held and a lost grasp of one group that are in the right order."""
    known, count = _known(scores), int(groups.max()) + 1
    right, pairs = np.zeros(count), np.zeros(count)
    for k in range(count):
        held, lost = (known[(groups == k) & (labels == kind)] for kind in (True, False))
        ahead = held[:, None] - lost
        right[k], pairs[k] = (ahead > 0).sum() + 0.5 * (ahead == 0).sum(), ahead.size
    if not pairs.sum():
        return Figure(np.nan)
    drawn = _weights(groups)
    with np.errstate(invalid="ignore"):
        shares = (drawn @ right) / (drawn @ pairs)
    return Figure(right.sum() / pairs.sum(), *np.nanquantile(shares, [TAIL, 1 - TAIL]))


def others_mean(labels: Numbers, planners: NDArray[np.str_]) -> Numbers:
    """Mean label of the other planners' grasps, for each grasp of an object: what is known without
    geometry. NaN if there are none."""
    means = np.full(len(labels), np.nan)
    for planner in np.unique(planners):
        own = planners == planner
        if not own.all():
            means[own] = labels[~own].mean()
    return means


def learned(features: Numbers, labels: NDArray[np.bool_], groups: Groups) -> Numbers:
    """Probabilities (N,) by a logistic regression on features (N, M), learned from the other
    groups; NaN are the mean of what is known."""
    from sklearn.linear_model import LogisticRegression
    from sklearn.preprocessing import StandardScaler

    filled = np.where(np.isnan(features), np.nanmean(features, axis=0), features)
    found = np.full(len(labels), np.nan)
    for k in np.unique(groups):
        others = groups != k
        if len(np.unique(labels[others])) < 2:
            continue
        scaler = StandardScaler().fit(filled[others])
        model = LogisticRegression().fit(scaler.transform(filled[others]), labels[others])
        found[~others] = model.predict_proba(scaler.transform(filled[~others]))[:, 1]
    return found


def scaled(probabilities: Numbers, labels: NDArray[np.bool_], groups: Groups) -> float:
    """Brier score of probabilities after a scaling learned from the other groups."""
    return brier(learned(probabilities[:, None], labels, groups), labels.astype(float))


def overall(labels: NDArray[np.bool_], groups: Groups) -> float:
    """Brier score of the share that holds of the other groups; NaN if there are none."""
    if len(np.unique(groups)) < 2:
        return np.nan
    shares = [labels[groups != k].mean() for k in groups]
    return brier(np.array(shares), labels.astype(float))


def kappa(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Cohen's; NaN if both are always the same."""
    chance = one.mean() * other.mean() + (1 - one.mean()) * (1 - other.mean())
    return float(((one == other).mean() - chance) / (1 - chance)) if chance < 1 else np.nan


def _known(scores: Numbers) -> Numbers:
    return np.where(np.isnan(scores), -np.inf, scores)


def _weights(groups: Groups) -> Groups:
    return bootstrap_weights(int(groups.max()) + 1, DRAWS, 0)
