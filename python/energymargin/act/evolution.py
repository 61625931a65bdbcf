"""How a search varies plans: CMA-ES proposes points in the unit cube, the disturbance grows.

Where every plan holds for certain, no draw tells which holds best. The strongest disturbance that a
plan withstands does. So the disturbance grows while most candidates hold, and the search still has
a slope.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from energymargin.act.draws import Disturbance
from energymargin.base.aliases import Floats
from energymargin.base.errors import needs_extra
from energymargin.disturbances import ActuationNoise, Gaussian, Uniform, of_plan

LEAST_POPULATION = 12  # draws are random: more points average more of that out than CMA-ES's own
SIGMA = 0.2  # of the unit cube's edge, at the start

GROWTH = 1.25  # of the disturbance, from one generation to the next
HOLD = 0.9  # where half of the candidates hold so well, it grows
FAIL = 0.5  # where no candidate holds so well, it shrinks again
MOST = 20.0  # times the stated one


def population_of(dimension: int) -> int:
    """Points of a generation."""
    return max(LEAST_POPULATION, 4 + int(3 * math.log(dimension)))


def cma_package() -> Any:
    """The package cma; ImportError with the extra that brings it."""
    with needs_extra("em.improve", "improve"):
        import cma
    return cma


class Evolution:
    """CMA-ES (Hansen 2016), of the package cma: it knows losses by their order alone."""

    def __init__(self, start: Floats, seed: int) -> None:
        """`start`: shape (D,)."""
        # One parameter alone is varied with a second one that does nothing: cma asks for two.
        self._dimension = len(start)
        padded = np.append(start, 0.5) if len(start) == 1 else start
        random = np.random.default_rng(seed)
        options = {"bounds": [0.0, 1.0], "popsize": population_of(len(start)), "verbose": -9}
        options["randn"] = lambda *shape: random.standard_normal(shape)
        options["seed"] = math.nan  # numpy's global generator is not touched
        self._search = cma_package().CMAEvolutionStrategy(padded, SIGMA, options)
        self._asked: list[Floats] = []

    def ask(self) -> Floats:
        """The points of the next generation, shape (P, D)."""
        self._asked = self._search.ask()
        return np.array(self._asked)[:, : self._dimension]

    def tell(self, losses: Sequence[float]) -> None:
        """What the points that were asked last cost; less is better."""
        self._search.tell(self._asked, list(losses))

    @property
    def favourite(self) -> Floats:
        """The mean of its distribution, shape (D,)."""
        return np.asarray(self._search.result.xfavorite)[: self._dimension]


def adapted(factor: float, scores: Floats) -> float:
    """The factor of the next generation, after the scores of one, shape (P,)."""
    if len(scores) == 0:
        return factor
    if float(np.median(scores)) > HOLD:
        return min(factor * GROWTH, MOST)
    return max(factor / GROWTH, 1.0) if max(scores) < FAIL else factor


def scaled(disturbance: Disturbance | None, factor: float) -> Disturbance | None:
    """So many times as strong."""
    if factor == 1.0:
        return disturbance
    stated = Uniform() if disturbance is None else disturbance
    if isinstance(stated, Uniform):
        return Uniform(factor * stated.strength, stated.objects, stated.hold)
    if isinstance(stated, Gaussian):
        return Gaussian(factor * stated.force, factor * stated.torque, stated.correlation_time)
    if isinstance(stated, ActuationNoise):
        force, torque = factor * stated.force, factor * stated.torque
        return of_plan(force, torque, factor * stated.targets, stated.hold)
    return partial(_scaled_wrenches, stated, factor) if callable(stated) else stated


def _scaled_wrenches(function: Any, factor: float, random: Any, times: Any) -> Floats:
    """Those of a user's function, so many times as strong."""
    return factor * np.asarray(function(random, times))
