"""Evolution strategies in the unit cube: they propose points, and learn how these rank.

Both know losses by their order alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import one_of

__all__ = ["METHODS", "Strategy", "population_of", "strategy"]

METHODS = ("cma", "cem")
LEAST_POPULATION = 12  # draws are random: more points average more of that out than CMA-ES's own
SIGMA = 0.2  # of the unit cube's edge, at the start

# The cross-entropy method.
ELITES = 0.25  # share of the points
SMOOTHING = 0.7  # weight of the newest elites
LEAST_SIGMA = 0.01

Points = NDArray[np.float64]


class Strategy(Protocol):
    """Proposes points, and learns from their losses."""

    def ask(self) -> Points:
        """The points of the next generation, shape (P, D)."""
        ...

    def tell(self, points: Points, losses: Sequence[float]) -> None:
        """What they cost; less is better."""
        ...

    @property
    def favourite(self) -> NDArray[np.float64]:
        """The point that it would bet on, shape (D,)."""
        ...


def population_of(dimension: int) -> int:
    """Points of a generation."""
    return max(LEAST_POPULATION, 4 + int(3 * math.log(dimension)))


def strategy(method: str, start: NDArray[np.float64], seed: int) -> Strategy:
    """CMA-ES ("cma", which needs the extra [improve]) or the cross-entropy method ("cem")."""
    one_of("method", method, METHODS)
    random = np.random.default_rng(seed)
    return _Cma(start, random) if method == "cma" else _CrossEntropy(start, random)


class _Cma:
    """CMA-ES (Hansen 2016), of the package cma."""

    def __init__(self, start: NDArray[np.float64], random: np.random.Generator) -> None:
        try:
            import cma
        except ImportError as error:
            raise ImportError(
                "method 'cma' needs the package cma: pip install 'energymargin[improve]', or take "
                "method='cem'"
            ) from error
        # One parameter alone is varied with a second one that does nothing: cma asks for two.
        self._dimension = len(start)
        padded = np.append(start, 0.5) if len(start) == 1 else start
        options = {
            "bounds": [0.0, 1.0],
            "popsize": population_of(len(start)),
            "randn": lambda *shape: random.standard_normal(shape),
            "seed": math.nan,  # numpy's global generator is not touched
            "verbose": -9,
        }
        self._search: Any = cma.CMAEvolutionStrategy(padded, SIGMA, options)
        self._asked: list[NDArray[np.float64]] = []

    def ask(self) -> Points:
        """As Strategy.ask."""
        self._asked = self._search.ask()
        return np.array(self._asked)[:, : self._dimension]

    def tell(self, points: Points, losses: Sequence[float]) -> None:
        """As Strategy.tell; of the points that were asked last."""
        self._search.tell(self._asked, list(losses))

    @property
    def favourite(self) -> NDArray[np.float64]:
        """The mean of its distribution."""
        return np.asarray(self._search.result.xfavorite)[: self._dimension]


class _CrossEntropy:
    """The cross-entropy method with a normal distribution of independent numbers."""

    def __init__(self, start: NDArray[np.float64], random: np.random.Generator) -> None:
        self._mean, self._sigma = np.array(start), np.full(len(start), SIGMA)
        self._random = random

    def ask(self) -> Points:
        """As Strategy.ask."""
        shape = (population_of(len(self._mean)), len(self._mean))
        points = self._mean + self._sigma * self._random.standard_normal(shape)
        return np.asarray(np.clip(points, 0.0, 1.0))

    def tell(self, points: Points, losses: Sequence[float]) -> None:
        """As Strategy.tell."""
        count = max(2, round(ELITES * len(points)))
        elites = points[np.argsort(losses, kind="stable")[:count]]
        self._mean += SMOOTHING * (elites.mean(axis=0) - self._mean)
        self._sigma += SMOOTHING * (elites.std(axis=0) - self._sigma)
        self._sigma = np.maximum(self._sigma, LEAST_SIGMA)

    @property
    def favourite(self) -> NDArray[np.float64]:
        """The mean of its distribution."""
        return np.array(self._mean)
