"""What a surrogate says of features: a value, an interval, and whether it knows such states."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.act.surrogates.trees import Trees
from energymargin.base.reprs import Record

Vector = NDArray[np.float64]

FINEST = 1e-3  # m, rad, m/s or rad/s: the least scale of a feature
NARROWEST = 0.05  # of a probability's spread
SURE = 0.05  # of 0 or of 1: so near is a probability that is sure


@dataclass(frozen=True, eq=False, repr=False)
class Estimates(Record):
    """What a surrogate says of N states; of one state, each is a number."""

    value: Vector
    """The score that rollouts or a search would find, shape (N,); NaN where it is refused."""
    low: Vector
    """Lower end of the interval, shape (N,); NaN where it is refused."""
    high: Vector
    """Upper end of the interval, shape (N,); NaN where it is refused."""
    refused: NDArray[np.bool_]
    """Whether the state is unlike those of the training, shape (N,)."""


@dataclass(frozen=True, eq=False, repr=False)
class Model(Record):
    """Trees of F features with all that makes an Estimates of their sum."""

    bounded: NDArray[np.bool_]
    """Whether the score is a probability, and the trees' sum a logit; shape ()."""
    splits: NDArray[np.int64]
    """Of the Trees, as `thresholds`, `values` and `constant`."""
    thresholds: Vector
    values: Vector
    constant: Vector
    linear: Vector
    """Slope and offset of the sum, by which it is calibrated, shape (2,)."""
    widths: Vector
    """Half the interval, as a multiple of the spread: of values that are sure, and of others; shape
    (2,)."""
    scale: Vector
    """Spread of each feature among the training's states, shape (F,)."""
    neighbours: NDArray[np.float32]
    """Some of those states, each feature by its scale, shape (A, F)."""
    reach: Vector
    """Distance to the nearest of them from which on a state is refused; shape ()."""
    mirrored: NDArray[np.int64]
    """Features that change their signs together without a change of the score."""

    @cached_property
    def trees(self) -> Trees:
        """The trees."""
        return Trees(self.splits, self.thresholds, self.values, float(self.constant))

    @cached_property
    def _squares(self) -> NDArray[np.float32]:
        return np.asarray((self.neighbours**2).sum(axis=1))

    def __call__(self, features: Vector) -> Estimates:
        """Of N states' features, shape (N, F)."""
        table = unmirrored(features, self.mirrored)
        refused = ~(self.distances(table) <= self.reach)  # and where that is not a number
        value = np.where(refused, np.nan, self.value(table))
        return Estimates(value, *self.interval(value), refused)

    def interval(self, value: Vector) -> tuple[Vector, Vector]:
        """Lower and upper ends for values, shape (N,) each."""
        half = self.widths[self.is_unsure(value).astype(int)] * self.spread(value)
        low, high = value - half, value + half
        return (low.clip(0, 1), high.clip(0, 1)) if self.bounded else (low, high)

    def is_unsure(self, value: Vector) -> NDArray[np.bool_]:
        """Whether values are probabilities that are not near 0 or 1, shape (N,)."""
        if not self.bounded:
            return np.zeros(len(value), dtype=bool)
        return np.asarray((value > SURE) & (value < 1 - SURE))

    def value(self, table: Vector) -> Vector:
        """Calibrated values of features that are `unmirrored`, shape (N,)."""
        found: Vector = self.linear[0] * self.trees(table) + self.linear[1]
        return 1 / (1 + np.exp(-found)) if self.bounded else found

    def spread(self, value: Vector) -> Vector:
        """By how much scores differ from such values, but for a factor, shape (N,)."""
        if not self.bounded:
            return np.ones_like(value)
        return np.asarray(np.sqrt(value * (1 - value)) + NARROWEST)

    def distances(self, table: Vector) -> Vector:
        """To the nearest of the neighbours, shape (N,)."""
        own = (table / self.scale).astype(np.float32)
        nearest = (self._squares - 2 * own @ self.neighbours.T).min(axis=1)
        nearest += (own * own).sum(axis=1)
        return np.asarray(np.sqrt(np.maximum(nearest, 0)))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Its fields by name: Model(**arrays) makes it again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def unmirrored(features: Vector, mirrored: NDArray[np.int64]) -> Vector:
    """Features, shape (N, F), of the states themselves, or of their mirror images: of both the one
    whose first mirrored feature is positive."""
    if not len(mirrored):
        return features
    table = features.copy()
    table[:, mirrored] *= np.where(table[:, mirrored[:1]] < 0, -1, 1)
    return table
