"""Figures of probabilities beside labels that `em.grasps.compare` does not have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import Floats
from energymargin_paper.evidence.calibration import brier

__all__ = ["kappa", "others_mean", "scaled_brier", "share_brier"]

Labels = NDArray[np.bool_]
Groups = NDArray[np.int64]


def others_mean(labels: Floats, planners: NDArray[np.str_]) -> Floats:
    """Mean label of the other planners' grasps, for each grasp of an object: what is known without
    geometry. NaN if there are none."""
    means = np.full(len(labels), np.nan)
    for planner in np.unique(planners):
        own = planners == planner
        if not own.all():
            means[own] = labels[~own].mean()
    return means


def scaled_brier(probabilities: Floats, labels: Labels, groups: Groups) -> float:
    """Brier score of probabilities (N,) after a scaling, by logistic regression, that is learned
    from the other groups; NaN where they do not have both labels."""
    from sklearn.linear_model import LogisticRegression

    known = np.nan_to_num(probabilities)[:, None]
    found = np.full(len(labels), np.nan)
    for k in np.unique(groups):
        others = groups != k
        if labels[others].any() and not labels[others].all():
            model = LogisticRegression().fit(known[others], labels[others])
            found[~others] = model.predict_proba(known[~others])[:, 1]
    return brier(found, labels.astype(float))


def share_brier(labels: Labels, groups: Groups) -> float:
    """Brier score of the share that holds of the other groups; NaN if there are none."""
    if len(np.unique(groups)) < 2:
        return np.nan
    shares = [labels[groups != k].mean() for k in groups]
    return brier(np.array(shares), labels.astype(float))


def kappa(one: Labels, other: Labels) -> float:
    """Cohen's; NaN if both are always the same."""
    chance = one.mean() * other.mean() + (1 - one.mean()) * (1 - other.mean())
    return float(((one == other).mean() - chance) / (1 - chance)) if chance < 1 else np.nan
