"""How good a surrogate is on trajectories that it did not learn from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from energymargin.records.evaluation import LabelledScores
from energymargin.records.evaluation.bootstrap import auc_ap
from energymargin.records.evaluation.labelled import compared_states

Vector = NDArray[np.float64]

BINS = 10  # of the calibration error


@dataclass(frozen=True)
class Quality:
    """What a surrogate is worth on its test trajectories."""

    trajectories: int
    """Number of test trajectories."""
    states: int
    """Number of their states that have a score."""
    auc: float
    """AUC of the surrogate against the label "captured over the horizon" of the recording, among
    states that are captured now; NaN if all labels are alike."""
    auc_of_scores: float
    """AUC of the scores that it learned from, on the same states."""
    calibration_error: float
    """Mean difference between its values and the scores in ten bins with equal counts."""
    coverage: float
    """Share of the scores within their intervals; each trajectory counts the same."""
    refused: float
    """Share of the states that are unlike the training."""


def quality_of(
    labelled: LabelledScores,
    metric: str,
    *,
    values: Vector,
    inside: NDArray[np.bool_],
    refused: NDArray[np.bool_],
    frames: int,
) -> Quality:
    """That of `values`, which are NaN but for the test's states; all shapes (N,).

    `inside`: whether the score is within its interval. `frames` of the labels' horizon.
    """
    test = ~np.isnan(values)
    scores = labelled.scores[metric]
    _, own, counts = np.unique(labelled.trajectory[test], return_inverse=True, return_counts=True)
    errors = (values - scores)[test][np.argsort(values[test], kind="stable")]
    parts = np.array_split(errors, BINS)
    aucs = []
    for each in (values, np.where(test, scores, np.nan)):
        shown = replace(labelled, scores={metric: each})
        compared = compared_states(shown, metric, frames, among="captured")
        known = compared.of_both_kinds
        aucs.append(auc_ap(compared.scores, compared.labels)[0] if known else float("nan"))
    return Quality(
        trajectories=len(counts),
        states=len(errors),
        auc=aucs[0],
        auc_of_scores=aucs[1],
        calibration_error=float(sum(abs(b.sum()) for b in parts) / len(errors)),
        coverage=float((inside[test] / counts[own]).sum() / len(counts)),
        refused=float(refused[test].mean()),
    )
