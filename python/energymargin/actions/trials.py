"""Trials of candidates as one batch: on threads, in processes, or on a cluster.

Draw number j is the same for every candidate: the same disturbance, and with an uncertainty the
same particle (common random numbers). So candidates differ by what they do, not by their luck.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from energymargin import disturbances
from energymargin._core import Cancel, Cancelled, CaptureProbability, EscapeEffort, Problem
from energymargin.beliefs import Belief, Uncertainty
from energymargin.beliefs.belief import CommonParticle, common_particles
from energymargin.checks import function_of, one_of, shown, whole_number
from energymargin.closing import Closing
from energymargin.divergence import ANY
from energymargin.executors import Executor
from energymargin.executors.choice import chosen_executor
from energymargin.limits import Limit
from energymargin.parallel import run
from energymargin.reprs import short_repr
from energymargin.searches import SEARCHES, Search, SearchSettings, metric_search

OBJECTIVES = ("probability", "probability/success", "effort/est", "effort/rrt")
EFFORT = "effort/"

OF_INTERVALS = 0.95
JOBS_A_WORKER = 4  # of a batch, so that none is idle at its end
MOST_DRAWS = 64  # of a job

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
    search: Search | None = None
    """Search of the efforts, as in `escape_effort`."""

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
        whole_number("seed", self.seed, 0, 2**64 - 1)
        whole_number("nodes", self.nodes, 1)
        if self.search is not None:
            one_of("search", self.search, SEARCHES)

    @property
    def settings(self) -> SearchSettings:
        """Those of each draw's search or rollouts."""
        return SearchSettings(nodes=self.nodes, seed=self.seed, search=self.search)

    @property
    def is_effort(self) -> bool:
        """Whether draws are searches, and values efforts [J]."""
        return self.metric.startswith(EFFORT)

    def check(self, name: str, problem: Problem) -> None:
        """Raises ValueError if a problem lacks what the question is about."""
        if not isinstance(problem, Problem):
            raise ValueError(f"{name} is {shown(problem)}, expected a Problem")
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
    if not (uncertainty is None or isinstance(uncertainty, Uncertainty)):
        raise ValueError(
            f"uncertainty is {uncertainty!r}, expected an em.beliefs.Uncertainty or None"
        )


@dataclass(frozen=True)
class Trial:
    """Draws of one candidate."""

    candidate: int
    problems: tuple[Problem, ...]
    """One for all of them, or one for each."""
    first: int
    """Number of the first."""
    count: int
    particles: tuple[int, ...] = ()
    """With an uncertainty the numbers of its draws, one for each problem."""

    def parts(self, size: int) -> Iterator[Trial]:
        """Yields this trial in parts of so many draws, at most."""
        for start in range(0, self.count, size):
            count = min(size, self.count - start)
            alone = len(self.problems) == 1
            own = slice(0, 1) if alone else slice(start, start + count)
            problems, particles = self.problems[own], self.particles[own]
            yield Trial(self.candidate, problems, self.first + start, count, particles)


class Candidates:
    """Problems that are compared; with an uncertainty draw j of each has particle j of it."""

    def __init__(
        self, problems: Sequence[Problem], uncertainty: Uncertainty | None, seed: int
    ) -> None:
        """`seed`: of the particles. Raises ValueError on an uncertainty that names what a problem
        does not have, or that is of other bodies in each."""
        check_uncertainty(uncertainty)
        self._problems = list(problems)
        self._particles: list[CommonParticle] = []
        self._more: Iterator[CommonParticle] | None = None
        if uncertainty is not None and problems:
            beliefs = [Belief(problem, uncertainty=uncertainty) for problem in problems]
            self._more = common_particles(beliefs, seed)

    def __len__(self) -> int:
        """How many."""
        return len(self._problems)

    def __iter__(self) -> Iterator[Problem]:
        """The problems."""
        return iter(self._problems)

    def trial(self, candidate: int, first: int, count: int) -> Trial:
        """So many draws of a candidate from number `first` on."""
        if self._more is None:
            return Trial(candidate, (self._problems[candidate],), first, count)
        self._particles += islice(self._more, max(first + count - len(self._particles), 0))
        own = self._particles[first : first + count]
        problems = tuple(particle.problems[candidate] for particle in own)
        particles = tuple(particle.number for particle in own)
        return Trial(candidate, problems, first, count, particles)


@dataclass(frozen=True, eq=False)
class Draws:
    """What came of a trial."""

    __repr__ = short_repr

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

    def __add__(self, later: Draws) -> Draws:
        """These, and later ones."""
        return Draws(
            np.concatenate([self.values, later.values]),
            np.concatenate([self.times, later.times]),
            self.steps + later.steps,
        )

    @staticmethod
    def none() -> Draws:
        """No draws."""
        return Draws(np.zeros(0), np.zeros(0), 0)


class Runner(Protocol):
    """What runs trials."""

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """What came of each; None of those that the limit left unfinished.

        Raises KeyboardInterrupt after Ctrl-C, within 0.2 s, and what a trial raised.
        """
        ...


class Trials(Closing):
    """The workers of an executor, for one batch of trials after the other."""

    def __init__(
        self,
        executor: Executor | None = None,
        threads: int | None = None,
        on_draws: Callable[[Draws], None] | None = None,
    ) -> None:
        """Starts them.

        `threads`: in place of an executor; None takes all cores. `on_draws`: called with draws as
        they come in. Raises ValueError if executor and threads are given.
        """
        self._workers = chosen_executor(executor, threads).workers()
        self._on_draws = on_draws

    def run(self, question: Question, trials: Sequence[Trial], limit: Limit) -> list[Draws | None]:
        """As Runner.run."""
        size = self._size(trials)
        parts = [(number, p) for number, trial in enumerate(trials) for p in trial.parts(size)]
        found: dict[int, Draws] = {}

        def deliver(results: Sequence[tuple[int, Draws]]) -> None:
            found.update(results)
            if self._on_draws is not None:
                for _, draws in results:
                    self._on_draws(draws)

        items = [(place, trial) for place, (_, trial) in enumerate(parts)]
        work = partial(_drawn, question)
        run(self._workers, work, [items], deliver, limit, give_up=_given_up, most=1)
        return _joined(len(trials), [number for number, _ in parts], found)

    def close(self) -> None:
        """Ends the workers."""
        self._workers.close()

    def _size(self, trials: Sequence[Trial]) -> int:
        """Draws of a job."""
        draws = sum(trial.count for trial in trials)
        jobs = JOBS_A_WORKER * max(1, self._workers.slots)
        return max(1, min(MOST_DRAWS, math.ceil(draws / jobs)))


def _given_up(part: tuple[int, Trial], why: str) -> NoReturn:
    _, trial = part
    raise RuntimeError(f"candidate {trial.candidate}: {why}")


def _drawn(
    question: Question, parts: Sequence[tuple[int, Trial]], cancel: Cancel
) -> list[tuple[int, Draws]]:
    """On a worker: the draws of parts of trials, by their places. Raises Cancelled within one."""
    return [(place, _draws(question, trial, cancel)) for place, trial in parts]


def _draws(question: Question, trial: Trial, cancel: Cancel) -> Draws:
    if len(trial.problems) == 1 and not question.is_effort:
        return _rollouts(question, trial.problems[0], trial.first, trial.count, cancel)
    found = Draws.none()
    for number in range(trial.count):
        problem = trial.problems[number if len(trial.problems) > 1 else 0]
        draw = trial.first + number
        if question.is_effort:
            found += _search(question, problem, draw, cancel)
        else:
            found += _rollouts(question, problem, draw, 1, cancel)
    return found


def _rollouts(
    question: Question, problem: Problem, first: int, count: int, cancel: Cancel
) -> Draws:
    success = question.metric == "probability/success"
    p: CaptureProbability = metric_search(
        problem,
        question.metric,
        replace(question.settings, rollouts=count),
        disturbance=question.disturbance,
        first=first,
        undisturbed=False,
        most_diverged=ANY,  # of a few draws; all of them are counted where they are gathered
        cancel=cancel,
    )
    if not p.complete:
        raise Cancelled("cancelled within a trial")
    inside = np.isinf(p.exit_times)
    values = p.successes if success else inside
    assert values is not None
    shares = np.minimum(p.exit_times, p.times[-1]) / p.times[-1]
    return Draws(np.where(np.isnan(shares), np.nan, values.astype(float)), shares, p.steps)


def _search(question: Question, problem: Problem, number: int, cancel: Cancel) -> Draws:
    escape: EscapeEffort = metric_search(
        problem, question.metric, question.settings, number, cancel=cancel
    )
    steps = round(float(np.sum(escape.tree.durations)) / problem.scene.step)
    return Draws(np.array([escape.effort]), np.array([float(np.isinf(escape.effort))]), steps)


def _joined(count: int, numbers: Sequence[int], found: dict[int, Draws]) -> list[Draws | None]:
    """The parts of each trial together."""
    joined: list[Draws | None] = [Draws.none()] * count
    for part, number in enumerate(numbers):
        so_far = joined[number]
        more = found.get(part)
        joined[number] = None if so_far is None or more is None else so_far + more
    return joined
