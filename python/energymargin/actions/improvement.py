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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Cancelled, Plan, Problem, stream
from energymargin.actions.candidates import Candidates, check_uncertainty
from energymargin.actions.hardening import adapted, scaled
from energymargin.actions.improved import Generation, Improvement
from energymargin.actions.journal import Journal, digest_of, text_of
from energymargin.actions.parameters import Parameters
from energymargin.actions.ranking import Race, Ranking, Terms, score_of
from energymargin.actions.strategies import METHODS, Strategy, population_of, strategy
from energymargin.actions.trials import Disturbance, Draws, Question, Runner, Trials
from energymargin.arguments import shown
from energymargin.beliefs import Uncertainty
from energymargin.checks import function_or_none, one_of, whole_number, yes_or_no
from energymargin.divergence import too_many_diverged
from energymargin.errors import DivergedError
from energymargin.executors import Executor
from energymargin.limits import Limit
from energymargin.plans import in_steps
from energymargin.searches import ALGORITHM, ALGORITHM_IMPROVED, Search

__all__ = ["improve"]

SHARE_OF_SEARCH = 0.8  # of a timeout
FINAL_ROLLOUTS, FINAL_SEARCHES = 200, 16
MOST_EMPTY = 50  # generations in a row without a plan that can be
LAST = 2  # generations whose best are compared at the end

SCREEN, SEARCH, FINAL = 0, 1, 2  # streams of draws
START, FAVOURITE = "start", "favourite"

Make = Callable[[dict[str, float]], "Plan | Problem | None"]
Constraint = Callable[[dict[str, float]], float]
Point = NDArray[np.float64]
Key = TypeVar("Key")


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
    search: Search | None = None,
    file: str | Path | None = None,
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
            All have the same horizon, unless success is asked: a shorter plan is no safer one. Rows
            of a Plan begin at the steps of the scene that are nearest to their times.
        metric: what is to be large: "probability" of staying captured, "probability/success", or
            an effort of escape, "effort/est" or "effort/rrt".
        disturbance: as of `em.capture_probability`, but Boltzmann; None: Uniform(). Not of efforts.
        uncertainty: how well friction, masses, poses and velocities are known.
        constraints: functions of the values by name, each to be at least 0. Values that break one
            are not simulated.
        budget: simulation steps, about, with those of the last comparison. The screening, one
            generation and the last comparison are made in any case.
        rollouts: draws of each candidate of a generation; of an effort, searches.
        method: "cma", CMA-ES, which needs the extra [improve]; or "cem", the cross-entropy method.
        harden: the disturbance grows while most candidates hold, so that the search goes on to the
            plan that withstands the most. The result is told under the stated disturbance.
        seed: the same seed gives the same result, on any number of threads and on any executor.
        nodes: of the searches, as of `em.escape_effort`.
        search: the same.
        file: where finished batches are kept: the same call goes on from there, after Ctrl-C, or
            with a larger budget. What a changed plan or constraint asks is simulated anew. A file
            cannot tell two functions apart, so the disturbance is a model of em.disturbances, and
            no set is a Predicate.
        threads: None takes all cores.
        executor: in place of threads, as of `em.score`.
        progress: progress(steps, budget).
        timeout: it ends after so many seconds. A fifth of them is for the last comparison, whose
            draws so far count.
        cancel: ends it with Cancelled once it is set. With a file the same call goes on.

    Plans of which more than one rollout and more than 1 % diverge count as plans that cannot be.

    Ctrl-C stops within 0.2 s. Raises ValueError on bad arguments, a start that breaks a constraint
    and a file of another search; DivergedError where the rollouts of the start diverge;
    TimeoutError or Cancelled if the limit comes before the first generation is finished.
    """
    limit = Limit(timeout, cancel)
    of_search = Limit(None if timeout is None else SHARE_OF_SEARCH * timeout, cancel)
    box = Parameters(parameters)
    seed, nodes = whole_number("seed", seed, 0, 2**64 - 1), whole_number("nodes", nodes, 1)
    question = Question(metric, disturbance, seed, nodes, search)
    one_of("method", method, METHODS)
    budget = whole_number("budget", budget, 1)
    rollouts = whole_number("rollouts", rollouts, 1)
    harden = yes_or_no("harden", harden)
    function_or_none("progress", progress, "of (steps, budget)")
    check_uncertainty(uncertainty)
    maker = _Maker(problem, box, make_plan, _functions(constraints), question)
    start = maker.start()
    path = _path(file)
    what: dict[str, Any] = {}
    if path is not None:
        what = {
            **{"algorithm": [ALGORITHM, ALGORITHM_IMPROVED], "parameters": box.to_plain()},
            **{"start": digest_of(start), "metric": metric, "disturbance": text_of(disturbance)},
            **{"uncertainty": uncertainty.to_json() if uncertainty else None, "seed": seed},
            **{"rollouts": rollouts, "method": method, "harden": harden},
            **{"nodes": nodes, "search": search},
        }
    spent = _Spent(budget, progress)
    with Trials(executor, threads, spent.add) as trials:
        journal = Journal(trials, path, what, spent.add)
        run = _Run(
            *(maker, question, uncertainty, rollouts, start.horizon),
            *(journal, spent, of_search, limit),
        )
        return run.improved(method, harden=harden)


@dataclass(frozen=True)
class _Maker:
    """What values become."""

    problem: Problem
    box: Parameters
    make_plan: Make
    constraints: tuple[Constraint, ...]
    question: Question

    def __post_init__(self) -> None:
        """Raises ValueError on what is no problem and no function."""
        if not isinstance(self.problem, Problem):
            raise ValueError(f"problem is {shown(self.problem)}, expected a Problem")
        if not callable(self.make_plan):
            raise ValueError(
                f"make_plan is {shown(self.make_plan)}, expected a function of the values by name"
            )

    def start(self) -> Problem:
        """The problem of the start; ValueError if there is none."""
        values = self.box.values(self.box.start)
        for number, constraint in enumerate(self.constraints):
            value = _constrained(constraint, number, values)
            if value < 0:
                raise ValueError(
                    f"constraints[{number}] is {value:g} at the start {values}, expected at least 0"
                )
        made = self.make(self.box.start)
        if made is None:
            raise ValueError(f"make_plan returned None for the start {values}, expected a plan")
        self.question.check("problem", made)
        return made

    def violation(self, point: Point) -> float:
        """By how much its values break the constraints; 0 if they do not."""
        values = self.box.values(point)
        found = [_constrained(one, k, values) for k, one in enumerate(self.constraints)]
        return float(sum(max(0.0, -value) for value in found))

    def required(self, point: Point) -> Problem:
        """The problem of a point that was made before; ValueError if it cannot be any more."""
        made = self.make(point)
        if made is None:
            raise ValueError("make_plan returned None for values that it made a plan of before")
        return made

    def make(self, point: Point) -> Problem | None:
        """The problem of a point in the unit cube; None if it cannot be."""
        values = self.box.values(point)
        made = self.make_plan(dict(values))
        if made is None or isinstance(made, Problem):
            return made
        if not isinstance(made, Plan):
            raise ValueError(
                f"make_plan returned {shown(made)} for {values}, expected a Plan, a Problem or None"
            )
        try:
            plan = in_steps(made, self.problem.scene.step)
            horizon = plan.duration if self.problem.horizon is None else self.problem.horizon
            changed: Problem = self.problem.replace(plan=plan, horizon=horizon, effector="coast")
        except ValueError as error:
            raise ValueError(f"make_plan, for {values}: {error}") from error
        return changed

    def check_horizon(self, point: Point, made: Problem, expected: float | None) -> None:
        """Raises ValueError on one of another horizon, unless success is asked."""
        if made.horizon != expected and self.question.metric != "probability/success":
            raise ValueError(
                f"make_plan makes a horizon of {made.horizon} s for {self.box.values(point)}, of "
                f"{expected} s for the start, expected the same: set the problem's horizon"
            )


@dataclass(eq=False)
class _Spent:
    """What of the budget is spent."""

    budget: int
    progress: Callable[[int, int], None] | None
    steps: int = 0
    draws: int = 0

    def add(self, draws: Draws) -> None:
        """Counts draws, and tells the progress."""
        self.steps += draws.steps
        self.draws += len(draws.values)
        if self.progress is not None:
            self.progress(min(self.steps, self.budget), self.budget)

    def end(self) -> None:
        """Tells the progress that it is all, where a search ends before."""
        if self.progress is not None:
            self.progress(self.budget, self.budget)


@dataclass(frozen=True)
class _Run:
    """One search."""

    maker: _Maker
    question: Question
    uncertainty: Uncertainty | None
    rollouts: int
    horizon: float | None
    trials: Runner
    spent: _Spent
    of_search: Limit
    limit: Limit

    def improved(self, method: str, *, harden: bool) -> Improvement:
        """Screens, searches, compares."""
        box = self.maker.box
        search = strategy(method, self._screened(), self._seed(SEARCH))
        generations, whole = self._searched(search, harden=harden)
        finalists = {FAVOURITE: generations[-1].favourite}
        for number, one in list(enumerate(generations, 1))[-LAST:]:
            finalists[f"generation {number}"] = one.points[one.best]
        if generations[-1].factor > 1.0:  # a draw is theirs, who withstand more than is stated
            finalists[START] = box.start
        else:
            finalists = {START: box.start, **finalists}
        ranking = self._compared(finalists)
        if ranking.complete and whole:
            self.spent.end()
        chosen = finalists[ranking.best]
        return Improvement(
            values=box.values(chosen),
            start=box.values(box.start),
            problem=self.maker.required(chosen),
            ranking=ranking,
            generations=tuple(generations),
            ranges=box.ranges,
            steps=self.spent.steps,
            complete=ranking.complete and whole,
        )

    def _screened(self) -> Point:
        """The best of the start and of points spread over the box."""
        from scipy.stats import qmc

        box, seed = self.maker.box, self._seed(SCREEN)
        spread = 2 ** int(np.ceil(np.log2(2 * population_of(len(box)))))
        sobol = qmc.Sobol(len(box), seed=np.random.default_rng(seed))
        points = np.array([box.start, *sobol.random(spread)])
        named = {str(number): point for number, point in enumerate(points)}
        ranking = self._raced(named, seed, Terms(self.rollouts), self.of_search)
        chosen: Point = points[int(ranking.best)]
        return chosen

    def _searched(self, search: Strategy, *, harden: bool) -> tuple[list[Generation], bool]:
        """The generations until the budget leaves but the last comparison, or the limit is reached,
        and whether it was not.

        There is one at least. It also ends where many generations cost nothing: no plan of them can
        be, or all are out of the capture set at once.
        """
        generations: list[Generation] = []
        factor, last, empty, whole = 1.0, 0, 0, True
        while not generations or self.spent.steps + last + self._last_steps <= self.spent.budget:
            before = self.spent.steps
            points = search.ask()
            seed = stream(self._seed(SEARCH), len(generations))
            draws = self._drawn(points, seed, factor)
            if draws is None:
                whole = False
                break
            scores = _scores(self.question, len(points), draws)
            losses = _losses(scores, draws, [self.maker.violation(point) for point in points])
            search.tell(points, losses)
            favourite, last = search.favourite, self.spent.steps - before
            best = int(np.argmin(losses))
            generations.append(Generation(points, scores, best, factor, favourite))
            if harden and not self.question.is_effort:
                factor = adapted(factor, scores[np.isfinite(scores)])
            empty = 0 if self.spent.steps > before else empty + 1
            if empty == MOST_EMPTY:
                break
        if not generations:
            self.of_search.require("the first generation was finished")
        return generations, whole

    @property
    def _last_steps(self) -> float:
        """About the simulation steps of the last comparison."""
        return (LAST + 2) * self._last_draws * self.spent.steps / max(self.spent.draws, 1)

    @property
    def _last_draws(self) -> int:
        return FINAL_SEARCHES if self.question.is_effort else FINAL_ROLLOUTS

    def _compared(self, finalists: dict[str, Point]) -> Ranking:
        """Those that can be, on new draws; the favourite first."""
        terms = Terms(self._last_draws, race=False)
        ranking = self._raced(finalists, self._seed(FINAL), terms, self.limit)
        if self.limit.cancelled:
            raise Cancelled("cancelled before the last comparison was finished")
        return ranking

    def _raced(self, points: dict[str, Point], seed: int, terms: Terms, limit: Limit) -> Ranking:
        """Of those that can be. Whose rollouts diverge cannot, but the start has to."""
        problems = self._there(points)
        if not problems:
            raise ValueError("make_plan returned None for values that it made a plan of before")
        candidates = Candidates(list(problems.values()), self.uncertainty, seed)
        race = Race(candidates, replace(self.question, seed=seed), terms)
        try:
            return race.run(list(problems), self.trials, limit)
        except DivergedError as error:
            if np.array_equal(points[error.subject], self.maker.box.start):
                raise DivergedError("the start", error.diverged, error.rollouts) from error
            others = {name: point for name, point in points.items() if name != error.subject}
            return self._raced(others, seed, terms, limit)

    def _drawn(self, points: Point, seed: int, factor: float) -> dict[int, Draws] | None:
        """The draws of those points that can be, without those whose rollouts diverge; None if the
        limit came first."""
        there = self._there(dict(enumerate(points)))
        candidates = Candidates(list(there.values()), self.uncertainty, seed)
        harder = scaled(self.question.disturbance, factor)
        question = replace(self.question, seed=seed, disturbance=harder)
        asked = [candidates.trial(k, 0, self.rollouts) for k in range(len(candidates))]
        found = self.trials.run(question, asked, self.of_search)
        draws = {number: one for number, one in zip(there, found, strict=True) if one is not None}
        if len(draws) < len(there):
            return None
        return {n: d for n, d in draws.items() if not too_many_diverged(d.diverged, self.rollouts)}

    def _there(self, points: dict[Key, Point]) -> dict[Key, Problem]:
        """The problems of points, without those that cannot be, or break a constraint."""
        there: dict[Key, Problem] = {}
        for key, point in points.items():
            made = None if self.maker.violation(point) > 0 else self.maker.make(point)
            if made is not None:
                self.maker.check_horizon(point, made, self.horizon)
                there[key] = made
        return there

    def _seed(self, number: int) -> int:
        return stream(self.question.seed, number)


def _scores(question: Question, count: int, draws: dict[int, Draws]) -> Point:
    """Of each point, shape (count,); NaN of those that were not simulated."""
    scores = np.full(count, np.nan)
    for number, one in draws.items():
        scores[number] = score_of(question, one.kept)
    return scores


def _losses(scores: Point, draws: dict[int, Draws], violations: Sequence[float]) -> list[float]:
    """The order of the points as numbers, equal ones the same: those that can be by their scores
    and by how long they hold, then the others by how far they break the constraints."""
    keys = [
        (0.0, -scores[k], -draws[k].held) if k in draws else (1.0, violation, 0.0)
        for k, violation in enumerate(violations)
    ]
    ordered = sorted(set(keys))
    return [float(ordered.index(key)) for key in keys]


def _constrained(constraint: Constraint, number: int, values: dict[str, float]) -> float:
    value = constraint(dict(values))
    if isinstance(value, (bool, np.bool_)):
        return 0.0 if value else -1.0
    if not isinstance(value, (int, float, np.number)) or np.isnan(value):
        raise ValueError(
            f"constraints[{number}] returned {shown(value)} for {values}, expected a number"
        )
    return float(value)


def _functions(constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
    if callable(constraints) or not isinstance(constraints, Sequence):
        raise ValueError(f"constraints is {shown(constraints)}, expected a list of functions")
    for number, one in enumerate(constraints):
        if not callable(one):
            raise ValueError(f"constraints[{number}] is {shown(one)}, expected a function")
    return tuple(constraints)


def _path(file: str | Path | None) -> Path | None:
    if not (file is None or isinstance(file, (str, Path))):
        raise ValueError(f"file is {file!r}, expected the name of a file, or None")
    return None if file is None else Path(file)
