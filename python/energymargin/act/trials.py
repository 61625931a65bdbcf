"""Trials of candidates as one batch: on threads, in processes, or on a cluster.

Draw number j is the same for every candidate: the same disturbance, and with an uncertainty the
same particle (common random numbers). So candidates differ by what they do, not by their luck.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from energymargin import disturbances
from energymargin._core import Cancel, Cancelled, Problem
from energymargin.base.checks import check_type, function_of, one_of, shown
from energymargin.base.closing import Closing
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.metrics import KINDS
from energymargin.base.reprs import Record
from energymargin.evaluate.divergence import ANY, too_many_diverged
from energymargin.evaluate.executors import Executor
from energymargin.evaluate.executors.choice import chosen_executor
from energymargin.evaluate.parallel import run
from energymargin.evaluate.searches import SearchSettings, metric_search
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
        if isinstance(self.disturbance, disturbances.Boltzmann):
            raise ValueError(
                f"disturbance is {self.disturbance!r}, whose draws have weights, expected another "
                "model: draws are compared one by one"
            )
        if self.is_effort and self.disturbance is not None:
            raise ValueError(
                f"disturbance is {shown(self.disturbance)} with the metric {self.metric!r}, "
                "expected None: an effort is the least work within the problem's bounds"
            )
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

    def check(self, name: str, problem: Problem) -> None:
        """Raises ValueError if a problem lacks what the question is about."""
        check_type(name, problem, Problem, "a Problem")
        if not self.is_effort and problem.horizon is None:
            raise ValueError(
                f"{name} is without a horizon, expected one with: problem.replace(horizon=...)"
            )
        if self.metric == "probability/success" and problem.succeeded is None:
            raise ValueError(f"{name} is without a success set, expected one with: succeeded=...")


def check_disturbance(disturbance: Any) -> None:
    """Raises ValueError unless it is a model, a function (random, times), or None."""
    if disturbance is None or isinstance(disturbance, disturbances.Disturbance):
        return
    if not callable(disturbance) or isinstance(disturbance, type):
        raise ValueError(
            f"disturbance is {shown(disturbance)}, expected a model of em.disturbances, a function "
            "(random, times), or None"
        )
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
class Trial(Sequence[Draw]):
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

    @overload
    def __getitem__(self, place: int) -> Draw: ...
    @overload
    def __getitem__(self, place: slice) -> list[Draw]: ...
    def __getitem__(self, place: int | slice) -> Draw | list[Draw]:
        """One, or some."""
        if isinstance(place, slice):
            return list(map(self._draw, self.numbers[place]))
        return self._draw(self.numbers[place])

    def _draw(self, number: int) -> Draw:
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

    def interval(self) -> tuple[float, float]:
        """95 % interval of the probability whose draws they are (Clopper and Pearson)."""
        from scipy import stats

        test = stats.binomtest(round(float(self.kept.sum())), len(self.kept))
        found = test.proportion_ci(OF_INTERVALS)
        return float(found.low), float(found.high)

    @property
    def mean_survival(self) -> float:
        """Mean of the times."""
        return float(np.nanmean(self.times))

    @staticmethod
    def joined(parts: Sequence[Draws]) -> Draws:
        """All of them, in this order."""
        return Draws(
            np.concatenate([np.zeros(0), *(part.values for part in parts)]),
            np.concatenate([np.zeros(0), *(part.times for part in parts)]),
            sum(part.steps for part in parts),
        )


class Trials(Closing):
    """The workers of an executor, for one batch of trials after the other."""

    def __init__(
        self,
        executor: Executor | None = None,
        threads: int | None = None,
        on_draws: Callable[[Draws], None] = lambda _: None,
    ) -> None:
        """Starts them.

        `threads`: in place of an executor; None takes all cores. `on_draws`: called with draws as
        they come in. Raises ValueError if executor and threads are given.
        """
        self._workers = chosen_executor(executor, threads).workers()
        self._on_draws = on_draws

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """What came of each; None of those that the limit left unfinished.

        Raises KeyboardInterrupt after Ctrl-C, within 0.2 s, and what a trial raised.
        """
        gathered = {trial.candidate: Gathered(trial) for trial in trials}
        pieces = (trial[k : k + PIECE] for trial in trials for k in range(0, len(trial), PIECE))

        def deliver(results: Sequence[tuple[Draw, Draws]]) -> None:
            for first, draws in results:
                self._on_draws(draws)
                if gathered[first.candidate].add(first.number, draws):
                    self._keep(gathered[first.candidate])

        run(self._workers, partial(draw_chunk, question), pieces, deliver, limit)
        return [one.whole for one in gathered.values()]

    def _keep(self, done: Gathered) -> None:
        """Called with each trial that is whole."""

    def close(self) -> None:
        """Ends the workers."""
        self._workers.close()


@dataclass(eq=False)
class Gathered:
    """What came of a trial so far."""

    trial: Trial
    parts: dict[int, Draws] = field(default_factory=dict)
    """By the number of their first draw."""
    count: int = 0
    whole: Draws | None = None

    def add(self, first: int, draws: Draws) -> bool:
        """Whether it is whole now."""
        self.parts[first] = draws
        self.count += len(draws.values)
        if self.count == len(self.trial):
            self.whole = Draws.joined([self.parts[number] for number in sorted(self.parts)])
        return self.whole is not None


def draw_chunk(
    question: Question, draws: Sequence[Draw], cancel: Cancel
) -> list[tuple[Draw, Draws]]:
    """On a worker: what came of draws, those of one problem together, and the first of them."""

    def together(draw: Draw) -> tuple[int, int]:
        return draw.candidate, draw.number if question.is_effort else id(draw.problem)

    groups = [list(group) for _, group in groupby(draws, together)]
    return [(group[0], _draws_of(question, group[0], len(group), cancel)) for group in groups]


def _draws_of(question: Question, first: Draw, count: int, cancel: Cancel) -> Draws:
    """So many rollouts of a problem, or one search; raises Cancelled if they are not finished."""
    effort = question.is_effort
    of_rollouts: dict[str, Any] = {"first": first.number, "undisturbed": False}
    of_rollouts["most_diverged"] = ANY  # they are counted where draws are gathered
    found = metric_search(
        first.problem,
        question.metric,
        replace(question.settings, rollouts=count),
        first.number if effort else None,
        disturbance=question.disturbance,
        cancel=cancel,
        **({} if effort else of_rollouts),
    )
    if not found.complete:
        raise Cancelled("cancelled within a trial")
    if effort:
        steps = round(float(np.sum(found.tree.durations)) / first.problem.scene.step)
        return Draws(np.array([found.effort]), np.array([float(np.isinf(found.effort))]), steps)
    shares = np.minimum(found.exit_times, found.times[-1]) / found.times[-1]
    success = question.metric == "probability/success"
    values = found.successes if success else np.isinf(found.exit_times)
    return Draws(np.where(np.isnan(shares), np.nan, values.astype(float)), shares, found.steps)
