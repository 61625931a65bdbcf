"""How a surrogate learns: some trajectories grow the trees, and others say how wrong these are.

Interval: split conformal prediction for data in groups (Lee, Barber and Willett, 2023). Each
trajectory counts the same, however many states it has, and one more has an infinite error. So a
random state of a new trajectory that is drawn like them is within the interval with at least the
stated probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from energymargin.act.surrogates.model import FINEST, Model, unmirrored
from energymargin.act.surrogates.trees import LEAVES, Trees, compiled

Vector = NDArray[np.float64]

PARTS = (0.5, 0.1, 0.2, 0.2)  # of the trajectories: for trees, calibration, intervals, and the test
LEAST = 50  # trajectories; with fewer there are no intervals of 90 %
TREES, RATE = 100, 0.1
NEIGHBOURS = 512  # states of the training to which a new one is compared
LIKE = 0.95  # share of the states of other trajectories that count as like the training's


def fitted(
    features: Vector,
    scores: Vector,
    trajectory: NDArray[np.int64],
    *,
    bounded: bool,
    monotone: Sequence[int],
    mirrored: Sequence[int],
    coverage: float,
    seed: int,
) -> tuple[Model, NDArray[np.bool_]]:
    """A model of N states' features, shape (N, F), with finite scores and trajectories, shape (N,);
    and which states are of the test.

    Other arguments and errors as of `Surrogate.learn`.
    """
    flipped = np.array(mirrored, dtype=np.int64)
    table = unmirrored(features, flipped)
    train, tune, widen, test = parts_of(trajectory, seed)
    trees = grown(table[train], scores[train], list(monotone), seed, bounded=bounded)
    chosen = np.random.default_rng(seed).permutation(np.flatnonzero(train))[:NEIGHBOURS]
    scale = np.maximum(table[train].std(axis=0), FINEST)
    model = Model(
        bounded=np.array(bounded),
        splits=trees.splits,
        thresholds=trees.thresholds,
        values=trees.values,
        constant=np.array(trees.constant),
        linear=np.array(platt(trees(table[tune]), scores[tune]) if bounded else (1.0, 0.0)),
        widths=np.zeros(2),
        scale=scale,
        neighbours=(table[chosen] / scale).astype(np.float32),
        reach=np.array(np.inf),
        mirrored=flipped,
    )
    value = model.value(table[widen])
    errors = np.abs(value - scores[widen]) / model.spread(value)
    unsure = model.is_unsure(value)
    groups = [(errors[which], trajectory[widen][which]) for which in (~unsure, unsure)]
    widths = [conformal(*group, coverage) for group in groups]
    reach = np.quantile(model.distances(table[tune | widen]), LIKE)
    return replace(model, widths=np.array(widths), reach=np.array(reach)), test


def parts_of(trajectory: NDArray[np.int64], seed: int) -> list[NDArray[np.bool_]]:
    """Which of N states are in each of the PARTS; a trajectory is in one of them.

    Raises ValueError on fewer than 50 trajectories.
    """
    numbers = np.random.default_rng(seed).permutation(np.unique(trajectory))
    if len(numbers) < LEAST:
        raise ValueError(
            f"run has scores of {len(numbers)} trajectories, expected at least {LEAST}: generate "
            "and score more"
        )
    ends = np.round(np.cumsum(PARTS[:-1]) * len(numbers)).astype(int)
    return [np.isin(trajectory, own) for own in np.split(numbers, ends)]


def grown(
    features: Vector, scores: Vector, monotone: list[int], seed: int, *, bounded: bool
) -> Trees:
    """Trees of features, shape (N, F), and scores, shape (N,); `bounded`: they are probabilities,
    and the trees' sums are logits. Raises ValueError on scores that are all 0, or all 1."""
    from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
    from threadpoolctl import threadpool_limits  # of scikit-learn

    model = (HistGradientBoostingClassifier if bounded else HistGradientBoostingRegressor)(
        max_iter=TREES,
        learning_rate=RATE,
        max_leaf_nodes=LEAVES,
        l2_regularization=1.0,
        monotonic_cst=monotone,
        early_stopping=False,
        random_state=seed % 2**32,  # all that scikit-learn takes
    )
    with threadpool_limits(1):  # the same bits on any machine, and faster with so few states
        if bounded:
            labels, weights = _as_labels(scores)
            there = weights > 0
            if len(np.unique(labels[there])) < 2:
                raise ValueError(f"scores are all {scores[0]:g}, expected some of others to learn")
            model.fit(np.concatenate([features, features])[there], labels[there], weights[there])
        else:
            model.fit(features, scores)
        return compiled(model, features)


def platt(logits: Vector, scores: Vector) -> tuple[float, float]:
    """Slope, which is not negative, and offset with which logits say the probabilities `scores`
    (Platt, 1999)."""
    from sklearn.linear_model import LogisticRegression

    labels, weights = _as_labels(scores)
    if len(np.unique(labels[weights > 0])) < 2:
        return 1.0, 0.0
    model = LogisticRegression(C=100.0).fit(np.tile(logits, 2)[:, None], labels, weights)
    return max(float(model.coef_[0, 0]), 0.0), float(model.intercept_[0])


def _as_labels(scores: Vector) -> tuple[NDArray[np.int64], Vector]:
    """Labels and weights, shape (2 N,): a state with a probability of .3 is captured by .3, and
    lost by .7."""
    return np.repeat([1, 0], len(scores)), np.concatenate([scores, 1 - scores])


def conformal(errors: Vector, trajectory: NDArray[np.int64], coverage: float) -> float:
    """The error that a state of a new trajectory does not exceed with this probability; inf if
    there are too few trajectories to say so."""
    _, own, counts = np.unique(trajectory, return_inverse=True, return_counts=True)
    order = np.argsort(errors)
    level = np.cumsum(1 / counts[own][order]) / (len(counts) + 1)
    reached = np.flatnonzero(level >= coverage - 1e-12)
    return float(errors[order][reached[0]]) if len(reached) else np.inf
