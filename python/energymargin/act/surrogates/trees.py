"""Boosted trees as arrays, for fast answers: QuickScorer (Lucchese et al., SIGIR 2015).

The leaves of a tree are the bits of a word, from the left. A split that sends a state to the right
rules out the leaves on its left. What all splits of one feature rule out depends on between which
two of its thresholds the state lies, so it is one row of a table. The lowest bit that all features
leave is the state's leaf.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

LEAVES = 16  # of a tree at most, as a word has so many bits
EVERY = np.uint16(0xFFFF)
PLACE = np.zeros(1 << LEAVES, dtype=np.uint8)
"""The place of the only bit of a word."""
PLACE[1 << np.arange(LEAVES)] = np.arange(LEAVES)


class Trees:
    """The sum of T trees and a constant."""

    def __init__(
        self, splits: NDArray[np.int64], thresholds: Vector, values: Vector, constant: float
    ) -> None:
        """`splits`: tree, feature, and the leaves that remain on its right (a word), shape (S, 3);
        `thresholds` of the S splits, shape (S,); `values` of the leaves, shape (T, 16)."""
        self.splits, self.thresholds = splits, thresholds
        self.values, self.constant = values, float(constant)
        self._first = np.arange(len(values), dtype=np.int32) * LEAVES
        self._flat = np.ascontiguousarray(values).ravel()
        self._tables = [
            (int(feature), *_table(splits[own], thresholds[own], len(values)))
            for feature in np.unique(splits[:, 1])
            for own in [splits[:, 1] == feature]
        ]

    def __call__(self, features: Vector) -> Vector:
        """Of the features of N states, shape (N, F): the sums, shape (N,)."""
        left = np.full((len(features), len(self.values)), EVERY)
        for feature, thresholds, rows in self._tables:
            left &= rows.take(np.searchsorted(thresholds, features[:, feature]), axis=0)
        leaves = PLACE.take(left & (~left + np.uint16(1))) + self._first
        sums: Vector = self._flat.take(leaves).sum(axis=1)
        return sums + self.constant


def _table(
    splits: NDArray[np.int64], thresholds: Vector, trees: int
) -> tuple[Vector, NDArray[np.uint16]]:
    """The thresholds of one feature, rising, and the words of all trees between them."""
    order = np.argsort(thresholds)
    rows = np.full((len(order) + 1, trees), EVERY)
    for row, split in enumerate(order, start=1):
        tree, _, remaining = splits[split]
        rows[row] = rows[row - 1]
        rows[row, tree] &= np.uint16(remaining)
    return thresholds[order], rows


def compiled(model: Any, features: Vector) -> Trees:
    """The trees of a fitted model of scikit-learn's HistGradientBoosting, whose leaves are at most
    16.

    `features`, shape (N, F), are some that both are asked about: RuntimeError if they differ, as
    the nodes are no public part of scikit-learn.
    """
    ensemble = [trees[0].nodes for trees in model._predictors]
    values = np.zeros((len(ensemble), LEAVES))
    splits = [row for k, nodes in enumerate(ensemble) for row in _splits(k, nodes, values[k])]
    places = np.array([row[:3] for row in splits], dtype=np.int64).reshape(-1, 3)
    thresholds = np.array([row[3] for row in splits], dtype=float)
    own = getattr(model, "decision_function", model.predict)(features)
    sums = Trees(places, thresholds, values, 0.0)(features)
    trees = Trees(places, thresholds, values, float(np.mean(own - sums)))
    if not np.allclose(own, trees(features), atol=1e-9):
        from sklearn import __version__

        raise RuntimeError(
            f"trees of scikit-learn {__version__} are read wrongly: install one from 1.3 to 1.9"
        )
    return trees


def _splits(number: int, nodes: Any, values: Vector) -> list[tuple[int, int, int, float]]:
    """Of the nodes of a tree, by its splits: its number, feature, word of the leaves that remain on
    the right, and threshold. Sets the `values` of its leaves, shape (16,)."""
    splits = []

    def walk(node: Any, first: int) -> int:
        """The number after the last leaf below a node, whose leaves count from `first`."""
        if node["is_leaf"]:
            values[first] = node["value"]
            return first + 1
        middle = walk(nodes[node["left"]], first)
        remaining = int(EVERY) & ~((1 << middle) - (1 << first))
        splits.append((number, int(node["feature_idx"]), remaining, float(node["num_threshold"])))
        return walk(nodes[node["right"]], middle)

    walk(nodes[0], 0)
    return splits
