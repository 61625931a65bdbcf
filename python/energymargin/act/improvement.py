"""`em.improve`: the plan that holds best and still does the job.

1. Points of the box of parameters, and the start, are raced against each other: the best one is
   where the search begins.
2. An evolution strategy proposes plans, generation by generation. All plans of a generation meet
   the same draws, each generation has its own. While most plans hold, the disturbance grows.
3. The start, the strategy's favourite and the best of the last generations meet new draws under the
   stated disturbance: the best of them is the result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Cancelled, Plan, Problem, stream
from energymargin.act.candidates import Standing
from energymargin.act.draws import Disturbance, Draws, Question, Trials, check_uncertainty
from energymargin.act.evolution import Evolution, adapted, cma_package, population_of, scaled
from energymargin.act.parameters import Constraint, Make, Maker, Parameters
from energymargin.act.racing import Duel, duel
from energymargin.act.ranking import Race, Ranking
from energymargin.base.aliases import Floats
from energymargin.base.checks import function_or_none, one_of, seed_number, whole_number, yes_or_no
from energymargin.base.errors import DivergedError
from energymargin.base.limits import Limit
from energymargin.base.metrics import value_text
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.base.table_text import csv_text
from energymargin.evaluate.divergence import too_many_diverged
from energymargin.evaluate.executors.choice import Executor
from energymargin.model.beliefs.uncertainty import Uncertainty

SHARE_OF_SEARCH = 0.8  # of a timeout
FINAL_ROLLOUTS, FINAL_SEARCHES = 200, 16
METHODS = ("cma",)
MOST_EMPTY = 50  # generations in a row without a plan that can be
LAST = 2  # generations whose best are compared at the end

SCREEN, SEARCH, FINAL = 0, 1, 2  # streams of draws
START, FAVOURITE = "start", "favourite"


@dataclass(frozen=True, eq=False, repr=False)
class Generation(Record):
    """Plans that were compared on the same draws."""

    points: NDArray[np.float64]
    """Their parameters in the unit cube, shape (P, D)."""
    scores: NDArray[np.float64]
    """Probabilities, or median efforts [J], shape (P,); NaN of plans that cannot be."""
    best: int
    """Number of the best."""
    factor: float
    """How many times as strong as stated the disturbance was."""
    favourite: NDArray[np.float64]
    """What the strategy would bet on after it, shape (D,)."""


@dataclass(frozen=True, eq=False)
class Improvement(Summarized):
    """The best plan that was found."""

    values: dict[str, float]
    """Its parameters."""
    start: dict[str, float]
    """Those that it began with."""
    problem: Problem
    """The question with this plan."""
    ranking: Ranking
    """The last comparison, on new draws: the strategy's favourite, the best of the last
    generations, and the start. Its best is the result."""
    generations: tuple[Generation, ...]
    ranges: dict[str, tuple[float, float]]
    """Lowest and highest value of each parameter, in the order of the columns of their points."""
    steps: int
    """Simulation steps."""
    complete: bool
    """Whether the search came to its end: False if the timeout or the cancel came first."""

    def __repr__(self) -> str:
        """Scores before and after."""
        return f"Improvement({self.decision})"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the columns of the points."""
        return tuple(self.ranges)

    @property
    def plan(self) -> Plan | None:
        """The plan of the problem."""
        return self.problem.plan

    @property
    def before(self) -> Standing:
        """The start, in the last comparison."""
        return self.ranking[START]

    @property
    def after(self) -> Standing:
        """The result, in the last comparison."""
        return self.ranking.standings[0]

    @property
    def confidence(self) -> float:
        """Confidence that the result is better than the start."""
        return self._duel.better

    @property
    def decision(self) -> str:
        """One sentence for people."""
        metric = self.ranking.metric
        before, after = (value_text(metric, s.score) for s in (self.before, self.after))
        if self.ranking.best == START:
            return f"the start is the best that was found: {metric} {before}"
        one = self._duel
        gains = f"of {one.draws} draws it gains {one.wins} and loses {one.losses}"
        return f"{metric} {before} at the start, {after} with the plan that was found; {gains}"

    def to_csv(self) -> str:
        """A line for each plan that was tried, in full precision: generation, the factor of the
        disturbance, the score, the values of the parameters."""
        low, high = np.array(list(self.ranges.values())).T
        rows = []
        for number, one in enumerate(self.generations, 1):
            columns = np.column_stack([one.scores, low + one.points * (high - low)])
            rows += [(number, one.factor, *row) for row in columns.tolist()]
        return csv_text(("generation", "factor", "score", *self.parameters), rows)

    @cached_property
    def _duel(self) -> Duel:
        return duel(self.after.values, self.before.values)


def improve(
    problem: Problem,
    parameters: Mapping[str, Sequence[float]],
    make_plan: Make,
    *,
    metric: str = "probability",
    disturbance: Disturbance | None = None,
    uncertainty: Uncertainty | None = None,
    constraints: Sequence[Constraint] = (),
    budget: int = 5_000_000,
    rollouts: int = 32,
    method: str = "cma",
    harden: bool = True,
    seed: int = 0,
    nodes: int = 1000,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Improvement:
    """The plan with the best margin: its parameters are varied until it holds best.

    Args:
        problem: the question, with what all candidates share. Its own plan does not count.
        parameters: by name (low, start, high), or (low, high), which starts in the middle.
        make_plan: a function of the values by name, which returns a Plan; or a whole Problem, where
            the start or the scene depends on them too; or None for values that cannot be.
            All have the same step, objects, bounds and duration, and the same horizon unless
            success is asked: a shorter plan is no safer one. Rows of a Plan begin at the steps of
            the scene that are nearest to their times.
        metric: what is to be large: "probability" of staying captured, "probability/success", or
            an effort of escape: "effort", "effort/est" or "effort/rrt".
        disturbance: as of `em.capture_probability`, but Boltzmann; None: Uniform(). Not of efforts.
        uncertainty: how well friction, masses, poses and velocities are known.
        constraints: functions of the values by name, each to be at least 0. Values that break one
            are not simulated.
        budget: simulation steps, about, with those of the last comparison. The screening, one
            generation and the last comparison are made in any case. A step of our tasks takes 2 to
            50 µs of a core, so the default takes between 10 s and 4 minutes of one.
        rollouts: draws of each candidate of a generation; of an effort, searches.
        method: "cma", CMA-ES, which needs the extra [improve].
        harden: the disturbance grows while most candidates hold, so that the search goes on to the
            plan that withstands the most. The result is told under the stated disturbance.
        seed: the same seed gives the same result, on any number of threads and on any executor.
        nodes: nodes of each search, as in `em.escape_effort`.
        store: a file where draws are kept by what they ask: the same call goes on from there, after
            Ctrl-C, or with a larger budget. Another plan, constraint or seed asks anew. A file
            cannot tell two functions apart, so the disturbance is a model of em.disturbances, and
            no set is a Predicate.
        threads: None takes all cores.
        executor: in place of threads, as of `em.score`.
        progress: progress(done, total) counts simulation steps, of the budget.
        timeout: it ends after so many seconds. A fifth of them is for the last comparison, whose
            draws so far count.
        cancel: ends it with Cancelled once it is set. With a store the same call goes on.

    Plans of which more than one rollout and more than 1 % diverge count as plans that cannot be.

    Ctrl-C stops within 0.2 s. Raises ValueError on bad arguments, a start that breaks a constraint
    and a file of something else; DivergedError where the rollouts of the start diverge;
    TimeoutError or Cancelled if the limit comes before the first generation is finished.
    """
    limit = Limit(timeout, cancel)
    of_search = Limit(None if timeout is None else SHARE_OF_SEARCH * timeout, cancel)
    box = Parameters(parameters)
    seed, nodes = seed_number(seed), whole_number("nodes", nodes, 1)
    question = Question(metric, disturbance, seed, nodes)
    one_of("method", method, METHODS)
    budget, rollouts = whole_number("budget", budget, 1), whole_number("rollouts", rollouts, 1)
    harden = yes_or_no("harden", harden)
    function_or_none("progress", progress, "done", "total")
    check_uncertainty(uncertainty)
    maker = Maker(problem, box, make_plan, constraints, question)
    cma_package()
    run = _Run(maker, uncertainty, rollouts, budget, progress, of_search, limit)
    where: Any = {"store": store, "executor": executor, "threads": threads}
    with Trials(question, uncertainty, **where, on_draws=run.count) as trials:
        return run.improved(trials, harden=harden)


@dataclass(eq=False)
class _Run:
    """One search, and what of its budget is spent."""

    maker: Maker
    uncertainty: Uncertainty | None
    rollouts: int
    budget: int
    progress: Callable[[int, int], None] | None
    of_search: Limit
    limit: Limit
    steps: int = 0
    draws: int = 0
    trials: Trials = field(init=False)

    def count(self, draws: Draws) -> None:
        """Counts draws, and tells the progress."""
        self.steps += draws.steps
        self.draws += len(draws.values)
        if self.progress is not None:
            self.progress(min(self.steps, self.budget), self.budget)

    def improved(self, trials: Trials, *, harden: bool) -> Improvement:
        """Screens, searches, compares."""
        self.trials, box = trials, self.maker.box
        evolution = Evolution(self._screened(), self._seed(SEARCH))
        generations, whole = self._searched(evolution, harden=harden)
        finalists = {FAVOURITE: generations[-1].favourite}
        for number, one in list(enumerate(generations, 1))[-LAST:]:
            finalists[f"generation {number}"] = one.points[one.best]
        first = {START: box.start}
        hardened = generations[-1].factor > 1.0  # a draw is theirs, who withstand more than stated
        finalists = finalists | first if hardened else first | finalists
        seed, draws = self._seed(FINAL), self._last_draws
        ranking = self._raced(finalists, seed, draws, self.limit, race=False)
        if self.limit.cancelled:
            raise Cancelled("cancelled before the last comparison was finished")
        if ranking.complete and whole and self.progress is not None:
            self.progress(self.budget, self.budget)  # it may end before
        chosen = finalists[ranking.best]
        problem = self.maker.problems({START: chosen})[START]
        found = (box.values(chosen), box.values(box.start), problem, ranking)
        search = (tuple(generations), box.ranges, self.steps)
        return Improvement(*found, *search, ranking.complete and whole)

    def _screened(self) -> Floats:
        """The best of the start and of points spread over the box."""
        from scipy.stats import qmc

        box, seed = self.maker.box, self._seed(SCREEN)
        spread = 2 ** int(np.ceil(np.log2(2 * population_of(len(box)))))
        sobol = qmc.Sobol(len(box), seed=np.random.default_rng(seed))
        points = np.array([box.start, *sobol.random(spread)])
        ranking = self._raced(_numbered(points), seed, self.rollouts, self.of_search)
        return np.asarray(points[int(ranking.best)])

    def _searched(self, search: Evolution, *, harden: bool) -> tuple[list[Generation], bool]:
        """The generations until the budget leaves but the last comparison, or the limit is reached,
        and whether it was not.

        There is one at least. It also ends where many generations cost nothing: no plan of them can
        be, or all are out of the capture set at once.
        """
        generations: list[Generation] = []
        score = self.maker.question.score
        factor, last, empty, whole = 1.0, 0, 0, True
        draws_at_end, ending = (LAST + 2) * self._last_draws, 0.0  # about the steps of that
        while not generations or self.steps + last + ending <= self.budget:
            before = self.steps
            points = search.ask()
            draws = self._drawn(points, stream(self._seed(SEARCH), len(generations)), factor)
            if draws is None:
                whole = False
                break
            scores = np.array([np.nan if d is None else score(d) for d in draws])
            losses = _losses(scores, draws, [self.maker.violation(point) for point in points])
            search.tell(losses)
            favourite, last = search.favourite, self.steps - before
            ending = draws_at_end * self.steps / max(self.draws, 1)
            best = int(np.argmin(losses))
            generations.append(Generation(points, scores, best, factor, favourite))
            if harden and not self.maker.question.is_effort:
                factor = adapted(factor, scores[np.isfinite(scores)])
            empty = 0 if self.steps > before else empty + 1
            if empty == MOST_EMPTY:
                break
        if not generations:
            self.of_search.require("the first generation was finished")
        return generations, whole

    @property
    def _last_draws(self) -> int:
        return FINAL_SEARCHES if self.maker.question.is_effort else FINAL_ROLLOUTS

    def _raced(
        self, points: dict[str, Floats], seed: int, draws: int, limit: Limit, *, race: bool = True
    ) -> Ranking:
        """Ranking of the points that make a plan. A plan whose rollouts diverge leaves; the start
        has to stay."""
        problems = self.maker.problems(points)
        if not problems:
            raise ValueError("make_plan returned None for values that it made a plan of before")
        question = replace(self.maker.question, seed=seed)
        try:
            asked = Race(problems, self.uncertainty, question)
            return asked.run(self.trials, limit, draws, race=race)
        except DivergedError as error:
            if np.array_equal(points[error.subject], self.maker.box.start):
                raise DivergedError("the start", error.diverged, error.rollouts) from error
            others = {name: point for name, point in points.items() if name != error.subject}
            return self._raced(others, seed, draws, limit, race=race)

    def _drawn(self, points: Floats, seed: int, factor: float) -> list[Draws | None] | None:
        """The draws of each point; None of those that cannot be, or whose rollouts diverge, or if
        the limit came first."""
        problems = self.maker.problems(_numbered(points))
        harder = scaled(self.maker.question.disturbance, factor)
        question = replace(self.maker.question, seed=seed, disturbance=harder)
        race = Race(problems, self.uncertainty, question)
        if not race.draw(self.rollouts, self.trials, self.of_search):
            return None
        draws: list[Draws | None] = [None] * len(points)
        for number, found in zip(problems, race.draws, strict=True):
            if not too_many_diverged(found.diverged, self.rollouts):
                draws[int(number)] = found
        return draws

    def _seed(self, number: int) -> int:
        return stream(self.maker.question.seed, number)


def _numbered(points: Floats) -> dict[str, Floats]:
    """Points by their numbers."""
    return {str(number): point for number, point in enumerate(points)}


def _losses(scores: Floats, draws: Sequence[Draws | None], broken: Sequence[float]) -> list[float]:
    """The order of the points as numbers, equal ones the same: those that can be by their scores
    and by how long they hold, then the others by how far they break the constraints."""
    rows = zip(scores.tolist(), draws, broken, strict=True)
    keys = [(1.0, b, 0.0) if d is None else (0.0, -s, -d.mean_survival) for s, d, b in rows]
    ordered = sorted(set(keys))
    return [float(ordered.index(key)) for key in keys]
