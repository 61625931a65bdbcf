"""`em.margin_profile`: the margin at each moment of a plan's nominal motion, and the weakest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Plan, Problem, World
from energymargin.act.draws import Disturbance, Draws, Question, Trial, Trials
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, function_or_none, whole_number, yes_or_no
from energymargin.base.limits import Limit
from energymargin.base.metrics import value_text, with_unit
from energymargin.base.summary import Summarized
from energymargin.base.table_text import csv_text
from energymargin.evaluate.executors.choice import Executor
from energymargin.model.plans import control_period, nearest_steps, whole_steps, with_plan

EFFORT = "effort"


class Moment(NamedTuple):
    """One moment of a nominal motion."""

    number: int
    """Number of the moment, from 0."""
    time: float
    """[s]."""
    probability: float
    low: float
    """Lower end of a 95 % interval of the probability."""
    high: float
    """Upper end of the interval."""
    effort: float
    """[J]; inf if no escape was found, NaN if it was not asked for."""


@dataclass(frozen=True, eq=False)
class MarginProfile(Summarized):
    """The margin along a plan: of K moments of the motion without a disturbance."""

    times: NDArray[np.float64]
    """Times of the moments [s], shape (K,)."""
    ahead: NDArray[np.float64]
    """How far each of them looks ahead [s], shape (K,)."""
    states: NDArray[np.float64]
    """Shape (K, n)."""
    captured: NDArray[np.bool_]
    """Whether the nominal motion itself is in the capture set, shape (K,)."""
    probabilities: NDArray[np.float64]
    """Probabilities of staying captured for so long, shape (K,); NaN if there was no time left."""
    low: NDArray[np.float64]
    """Lower ends of their 95 % intervals (Clopper and Pearson), shape (K,)."""
    high: NDArray[np.float64]
    """Upper ends, shape (K,)."""
    diverged: NDArray[np.int64]
    """Numbers of rollouts that diverged and do not count, shape (K,)."""
    efforts: NDArray[np.float64]
    """Least effort of escape in the same time that was found [J], shape (K,): inf if none was, NaN
    if it was not asked for, or the time was over before."""
    problems: tuple[Problem, ...]
    """What was asked at each moment."""
    rollouts: int
    nodes: int
    seed: int
    disturbance: Disturbance | None = None
    """None: Uniform()."""
    complete: bool = True
    """Whether every moment has its scores: False if the timeout or the cancel came first."""
    ended: str | None = None
    """Why there are no later moments, if the nominal motion has a state that makes no problem, such
    as one outside of the bounds `within`."""

    def __len__(self) -> int:
        """K."""
        return len(self.times)

    def __getitem__(self, number: int) -> Moment:
        """One moment, by its number from 0; IndexError if there is none."""
        number = range(len(self))[number]
        columns = (self.times, self.probabilities, self.low, self.high, self.efforts)
        return Moment(number, *(float(column[number]) for column in columns))

    @property
    def weakest(self) -> Moment:
        """Where the probability is lowest while the nominal motion is captured; of equal ones that
        with the least effort, then the first. If it never is captured, the first moment."""
        there = self.captured & ~np.isnan(self.probabilities)
        efforts = np.where(np.isnan(self.efforts), np.inf, self.efforts)
        order = np.lexsort((efforts, self.probabilities, ~there))
        return self[int(order[0]) if there.any() else 0]

    def __repr__(self) -> str:
        """Where it is weakest."""
        lost = int((~self.captured).sum())
        more = f", {lost} of them not captured" if lost else ""
        more += "" if self.complete else ", stopped early"
        more += "" if self.ended is None else f"; {self.ended}"
        return f"MarginProfile({len(self)} moments{more}; {self.summary})"

    @property
    def summary(self) -> str:
        """Where it is weakest, in words."""
        one, number = self.weakest, self.weakest.number
        figures = (one.probability, one.low, one.high)
        probability, low, high = (value_text("probability", value) for value in figures)
        effort = "" if np.isnan(one.effort) else f", effort {with_unit(EFFORT, one.effort)}"
        ahead = f"over the next {self.ahead[number]:.4g} s{effort}"
        return f"weakest at {one.time:.4g} s: probability {probability} ({low} to {high}) {ahead}"

    def to_csv(self) -> str:
        """A line for each moment, in full precision."""
        names = ("time", "ahead", "captured", "probability", "low", "high", "effort")
        scores = (self.probabilities, self.low, self.high, self.efforts)
        columns = (c.tolist() for c in (self.times, self.ahead, self.captured, *scores))
        return csv_text(names, zip(*columns, strict=True))


def margin_profile(
    problem: Problem,
    plan: Plan | None = None,
    *,
    every: float = 0.1,
    ahead: float | None = None,
    rollouts: int = 100,
    disturbance: Disturbance | None = None,
    effort: bool = True,
    nodes: int = 300,
    seed: int = 0,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> MarginProfile:
    """The margin at each moment of the motion that a plan makes if nothing disturbs it.

    At each moment: the probability of staying captured from there on, and the least effort of
    escape in the same time. All moments meet the same draws.

    Args:
        problem: with a horizon, which is the end. Without a plan its effector coasts.
        plan: in place of the problem's; its duration is the horizon. Rows that are not whole steps
            of the scene begin at the steps nearest to their times.
        every: time between two moments [s]. Each moment is at the step nearest to its time.
        ahead: how far each moment looks [s]. The last moment is then so long before the end: all
            of them ask about the same time, and can be compared. None: up to the end, so that
            later moments ask about less.
        rollouts: of each probability.
        disturbance: as of `em.capture_probability`, but Boltzmann; None: Uniform().
        effort: False leaves out the efforts.
        nodes: nodes of each search, as in `em.escape_effort`.
        seed: of all moments: their probabilities are those of `em.capture_probability` with this
            seed, their searches those of `em.escape_effort` with em.stream(seed, 0).
        threads: None takes all cores. The bits do not depend on them.
        executor: in place of threads, as of `em.score`.
        progress: progress(done, total) counts rollouts and searches.
        timeout: after so many seconds the scores count that are there; others are NaN.
        cancel: ends it as a timeout does, once it is set.

    Where a state of the nominal motion makes no problem, such as one outside of the bounds
    `within`, the moments end, and `ended` says why. Ctrl-C stops within 0.2 s. Raises ValueError on
    bad arguments and on a problem without a horizon, DivergedError if more than one rollout of a
    moment and more than 1 % of them diverge; TimeoutError or Cancelled if the limit comes before
    the first probability.
    """
    limit = Limit(timeout, cancel)
    check_type("problem", problem, Problem, "a Problem")
    asked = problem if plan is None else with_plan(problem, plan)
    if asked.horizon is None:
        way = "expected one: margin_profile(problem, plan)"
        raise ValueError(f"problem is without plan and horizon, {way}")
    step = asked.scene.step
    apart, end = control_period("every", every, step), round(asked.horizon / step)
    look = None if ahead is None else whole_steps("ahead", ahead, step)
    if look is not None and look > end:
        raise ValueError(f"ahead is {ahead!r} s, expected at most the {end * step:.4g} s there are")
    whole_number("rollouts", rollouts, 1)
    function_or_none("progress", progress, "done", "total")
    questions = [(Question("probability", disturbance, seed, nodes), rollouts)]
    if yes_or_no("effort", effort):
        questions.append((Question(EFFORT, None, seed, nodes), 1))
    last = end - 1 if look is None else end - look
    steps = nearest_steps(np.arange(last * step / apart + 1) * apart, step)
    numbers = [int(number) for number in steps if number <= last]
    lengths = [end - number if look is None else look for number in numbers]
    states, memory = _nominal(asked, numbers, limit)
    problems, ended = _moments(asked, states, memory, numbers, lengths)
    there = len(problems)
    numbers, lengths, states = numbers[:there], lengths[:there], states[:there]
    total, done = there * sum(draws for _, draws in questions), 0

    def count(draws: Draws) -> None:
        nonlocal done
        done += len(draws.values)
        if progress is not None:
            progress(done, total)

    with Trials(questions[0][0], executor=executor, threads=threads, on_draws=count) as trials:
        found = [
            trials.run(question, [Trial(k, range(n), one) for k, one in enumerate(problems)], limit)
            for question, n in questions
        ]
    complete = not any(None in one for one in found)
    found.append([None] * there)  # efforts that are not asked
    if not any(found[0]):
        limit.require("the first moment was scored")
    for one, number in zip(found[0], numbers, strict=True):
        if one is not None:
            one.require_few_diverged(f"the moment at {number * step:.4g} s")
    ends = [(np.nan, np.nan) if one is None else one.interval() for one in found[0]]
    low, high = np.array(ends).T
    captured = np.atleast_1d(asked.captured.contains(asked.scene, states))
    times, lasting = np.array(numbers) * step, np.array(lengths) * step
    moments = (times, lasting, states, captured, _means(found[0]))
    diverged = np.array([0 if one is None else one.diverged for one in found[0]])
    scores = (low, high, diverged, _means(found[1]))
    settings = (rollouts, nodes, seed, disturbance)
    return MarginProfile(*moments, *scores, tuple(problems), *settings, complete, ended)


def _nominal(problem: Problem, numbers: Sequence[int], limit: Limit) -> tuple[Floats, Floats]:
    """States after so many steps without a disturbance, (K, n), and what the robot remembers."""
    start = problem.edge_start(problem.state)
    if numbers[-1] == 0:
        return np.array([start]), np.zeros((1, 0))
    world = World(problem.scene, problem.plan)
    done = world.simulate(start, numbers[-1], record=list(numbers), **limit.rest())
    return done.states, done.memory


def _moments(
    problem: Problem, states: Floats, memory: Floats, numbers: Sequence[int], lengths: Sequence[int]
) -> tuple[list[Problem], str | None]:
    """The questions after so many steps about so many more, up to the first state that makes none,
    and why it does not; ValueError if that is the first."""
    problems: list[Problem] = []
    step, plan = problem.scene.step, problem.plan
    for state, remembered, number, length in zip(states, memory, numbers, lengths, strict=True):
        try:
            ahead = plan.rest(number, step, remembered) if plan and number else plan
            moment = problem.with_state(state)
            asked = moment.replace(horizon=length * step, plan=ahead, start_outside=True)
        except ValueError as error:
            ended = f"after {number * step:.4g} s of the nominal motion: {error}"
            if not problems:
                raise ValueError(ended) from error
            return problems, ended
        problems.append(asked)
    return problems, None


def _means(draws: Sequence[Draws | None]) -> NDArray[np.float64]:
    return np.array([np.nan if one is None else one.kept.mean() for one in draws])
