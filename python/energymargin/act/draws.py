"""What is asked of each draw of a candidate, and what came of some.

Draw number j is the same for every candidate: the same disturbance, and with an uncertainty the
same particle (common random numbers). So candidates differ by what they do, not by their luck.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin import disturbances
from energymargin._core import Problem
from energymargin.base.checks import check_type, function_of, one_of, require
from energymargin.base.errors import DivergedError
from energymargin.base.metrics import KINDS
from energymargin.base.reprs import Record
from energymargin.evaluate.divergence import too_many_diverged
from energymargin.evaluate.searches import SearchSettings
from energymargin.model.beliefs.belief import CommonParticle
from energymargin.model.beliefs.uncertainty import Uncertainty

EFFORTS = KINDS["effort"].metrics
OBJECTIVES = ("probability", "probability/success", *EFFORTS)

OF_INTERVALS = 0.95
PIECE = 1000  # draws that are made at a time

Disturbance = disturbances.Disturbance | Callable[[Any, Any], Any]
"""As of `capture_probability`."""


@dataclass(frozen=True)
class Question:
    """What each draw is asked; raises ValueError on what cannot be."""

    metric: str = "probability"
    """One of OBJECTIVES."""
    disturbance: Disturbance | None = None
    """Disturbance of the probabilities, as in `capture_probability`; None: Uniform()."""
    seed: int = 0
    """Seed of the draws: draw j of a probability is rollout number j with it, of an effort the
    search with the seed stream(seed, j)."""
    nodes: int = 1000
    """Nodes of each search."""
    settings: SearchSettings = field(init=False, repr=False)
    """Those of each draw's search or rollouts."""

    def __post_init__(self) -> None:
        """Checks it."""
        one_of("metric", self.metric, OBJECTIVES)
        check_disturbance(self.disturbance)
        weighted = isinstance(self.disturbance, disturbances.Boltzmann)
        other = "another model, whose draws have no weights: draws are compared one by one"
        require(not weighted, "disturbance", self.disturbance, other)
        if self.is_effort:
            why = f"None with the metric {self.metric!r}: the least work within the bounds is asked"
            require(self.disturbance is None, "disturbance", self.disturbance, why)
        checked = SearchSettings(nodes=self.nodes, seed=self.seed)
        object.__setattr__(self, "settings", checked)

    @property
    def is_effort(self) -> bool:
        """Whether draws are searches, and values efforts [J]."""
        return self.metric in EFFORTS

    def score(self, draws: Draws) -> float:
        """Mean of the values of draws that count, or the median effort [J]."""
        if self.is_effort:  # a lower median: inf where most searches found no way out
            return float(np.quantile(draws.kept, 0.5, method="inverted_cdf"))
        return float(draws.kept.mean())

    def interval(self, draws: Draws) -> tuple[float, float]:
        """(low, high) of the score with 95 % confidence; of efforts two order statistics, if so
        many tell."""
        if not self.is_effort:
            return draws.interval()
        from scipy import stats

        count, ordered = len(draws.kept), np.sort(draws.kept).tolist()
        first = max(int(stats.binom.ppf((1.0 - OF_INTERVALS) / 2, count, 0.5)) - 1, 0)
        return ordered[first], ordered[count - 1 - first]

    def check(self, name: str, problem: Problem) -> None:
        """Raises ValueError if a problem lacks what the question is about."""
        check_type(name, problem, Problem, "a Problem")
        if not self.is_effort and problem.horizon is None:
            way = "expected one with: problem.replace(horizon=...)"
            raise ValueError(f"{name} is without a horizon, {way}")
        if self.metric == "probability/success" and problem.succeeded is None:
            raise ValueError(f"{name} is without a success set, expected one with: succeeded=...")


def check_disturbance(disturbance: Any) -> None:
    """Raises ValueError unless it is a model, a function (random, times), or None."""
    if disturbance is None or isinstance(disturbance, disturbances.Disturbance):
        return
    right = callable(disturbance) and not isinstance(disturbance, type)
    expected = "a model of em.disturbances, a function (random, times), or None"
    require(right, "disturbance", disturbance, expected)
    function_of("disturbance", disturbance, "random", "times")


def check_uncertainty(uncertainty: Uncertainty | None) -> None:
    """Raises ValueError on another thing."""
    check_type("uncertainty", uncertainty, Uncertainty | None, "an em.beliefs.Uncertainty or None")


class Draw(NamedTuple):
    """One draw of a candidate."""

    candidate: int
    number: int
    problem: Problem
    particle: int | None = None
    """With an uncertainty the number of its particle."""


@dataclass(frozen=True, eq=False)
class Trial:
    """Draws of one candidate in a row. There may be many, so they are made when asked for."""

    candidate: int
    numbers: range
    problem: Problem
    """Of every draw without an uncertainty."""
    particles: Sequence[CommonParticle] | None = None
    """With one, by the number of the draw."""

    def __len__(self) -> int:
        """How many."""
        return len(self.numbers)

    def draws(self) -> Iterator[list[Draw]]:
        """All of them, some at a time."""
        for k in range(0, len(self), PIECE):
            yield list(map(self.draw, self.numbers[k : k + PIECE]))

    def draw(self, number: int) -> Draw:
        """The draw of this number."""
        if self.particles is None:
            return Draw(self.candidate, number, self.problem)
        one = self.particles[number]
        return Draw(self.candidate, number, one.problems[self.candidate], one.number)


@dataclass(frozen=True, eq=False, repr=False)
class Draws(Record):
    """What came of N draws."""

    values: NDArray[np.float64]
    """Values of the draws, shape (N,): 1 or 0 of a probability, or efforts [J]; NaN of a rollout
    that diverged."""
    times: NDArray[np.float64]
    """For how long each stayed captured, as a share of its horizon, shape (N,); of an effort 1 if
    the search found no escape, else 0; NaN of a rollout that diverged."""
    steps: int
    """Simulation steps."""

    @property
    def diverged(self) -> int:
        """Rollouts that diverged, which do not count."""
        return int(np.isnan(self.values).sum())

    @property
    def kept(self) -> NDArray[np.float64]:
        """The values of those that did not diverge, shape (N - diverged,)."""
        return self.values[~np.isnan(self.values)]

    def require_few_diverged(self, subject: str, most: int | None = None) -> None:
        """Raises DivergedError if too many of them diverged, or of so many (`most`) that they may
        come to, or if no other is left."""
        count = len(self.values)
        if too_many_diverged(self.diverged, most or count) or self.diverged == count:
            raise DivergedError(subject, self.diverged, count)

    def interval(self, confidence: float = OF_INTERVALS) -> tuple[float, float]:
        """(low, high) of the probability whose draws they are (Clopper and Pearson)."""
        from scipy import stats

        test = stats.binomtest(round(float(self.kept.sum())), len(self.kept))
        found = test.proportion_ci(confidence)
        return float(found.low), float(found.high)

    @property
    def mean_survival(self) -> float:
        """Mean of the times."""
        return float(np.nanmean(self.times))

    @staticmethod
    def joined(parts: Sequence[Draws]) -> Draws:
        """All of them, in this order."""
        values = np.concatenate([np.zeros(0), *(part.values for part in parts)])
        times = np.concatenate([np.zeros(0), *(part.times for part in parts)])
        return Draws(values, times, sum(part.steps for part in parts))
