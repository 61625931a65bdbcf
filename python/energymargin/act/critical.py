"""How much can it take? Where a probability falls below what is asked, as a quantity varies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Cancelled, Problem
from energymargin.act.critical_search import Search
from energymargin.act.draws import Disturbance, Draws, Question, Trial, Trials, check_uncertainty
from energymargin.base.checks import function_of
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.base.summary import Summarized
from energymargin.evaluate.executors.choice import Executor
from energymargin.model.beliefs.belief import Belief, numbered_particle
from energymargin.model.beliefs.uncertainty import Uncertainty

MORE = (
    "what is lost at a value holds at a harder one. All crossings that were found are in "
    "`crossings`, and there may be more between them. A shorter range has closer values"
)

ProblemOf = Callable[[float], Problem]
Progress = Callable[[int, int], None]
Asked = tuple[ProblemOf, str, tuple[float, float], str]
"""A critical value that is searched: of which problems, its name, range and unit."""
OutcomesOf = Callable[[float, Sequence[int]], Any]


@dataclass(frozen=True, eq=False, repr=False)
class CriticalValue(Summarized):
    """Where a probability crosses the one that is asked for."""

    quantity: str
    """What was varied."""
    unit: str
    range: tuple[float, float]
    """Its values, from and to."""
    probability: float
    """What is asked of the capture probability."""
    value: float
    """Where it crosses that one; NaN where no crossing was found."""
    low: float
    """The interval's lower end; the end of the range where it may lie beyond, and NaN if it holds
    everywhere or nowhere."""
    high: float
    """Likewise the upper end."""
    confidence: float
    """Of the interval, and of `side`."""
    side: str
    """Where it holds: "below", "above", "everywhere", "nowhere", or "unknown"."""
    monotone: bool | None
    """False if a draw was lost at a value, and at a harder one not, or there are more crossings;
    None if that was not tried, as the search was stopped."""
    crossings: tuple[tuple[float, float, float, str], ...]
    """All that were found: value, low, high, side."""
    outcomes: NDArray[np.float64]
    """Rows of the values that were tried, rising: value, and the least and the largest share of the
    draws that can hold there, by what is known; shape (M, 3)."""
    rollouts: int
    """How many it took."""
    steps: int
    """Simulation steps."""
    diverged: int
    """Draws that diverged at some value, and do not count."""
    complete: bool
    """Whether it came to its end; the interval is wider if not."""

    def interval(self) -> tuple[float, float]:
        """(low, high) of the critical value, with the confidence that was asked for."""
        return self.low, self.high


def critical_value(
    problem_of: ProblemOf,
    quantity: str,
    range: tuple[float, float],
    *,
    unit: str = "",
    probability: float = 0.95,
    confidence: float = 0.95,
    metric: str = "probability",
    disturbance: Disturbance | None = None,
    uncertainty: Uncertainty | None = None,
    draws: int | None = None,
    tolerance: float = 0.01,
    seed: int = 0,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> CriticalValue:
    """How hard, fast, wrong or slippery may it be until it fails?

    Args:
        problem_of: problem_of(value) makes the Problem of a value, with a horizon.
        quantity: its name, for what is printed.
        range: lowest and highest value. Where both are above 0 and their ratio is above 10, values
            are searched by ratios.
        unit: of the values, for what is printed.
        probability: what is asked of the capture probability, in 0..1.
        confidence: with which the interval covers the critical value, and `side` is true.
        metric: "probability", or "probability/success".
        disturbance: as of `capture_probability`; None is Uniform().
        uncertainty: what is not known of each problem: draw j has particle j.
        draws: how many rollouts of each value there may be. More make the interval narrower. None:
            120, and for a probability near 0 or 1 as many as both ends of the interval need.
        tolerance: to which share of itself the critical value, and each end of the interval, is
            searched; where it is near 0, of a fiftieth of the range.
        seed: of the draws: draw j is the same at each value.
        store: a file of answers; what it has is not run again.
        threads: None takes all cores that this process may use. Nothing depends on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts rollouts; it may need fewer than the total, or more.
        timeout: after so many seconds the interval is what is known by then.
        cancel: the same once it is set.

    Where a harder value makes a loss certain, and an easier one makes it impossible, the interval
    is exact: the number of draws that are lost at the critical value is binomial. That is tried on
    a part of the draws. Where it is not so, new draws test both ends, and `monotone` is False. More
    than one change from held to lost in the first five values gives several `crossings`.

    Raises ValueError on bad arguments, or a problem without a horizon; DivergedError if more than
    one draw, and more than 1 % of them, diverge; TimeoutError or Cancelled if not even the first
    values were tried.
    """
    function_of("problem_of", problem_of, "value")
    check_uncertainty(uncertainty)
    limit, question = Limit(timeout, cancel), Question(metric, disturbance, seed)
    if question.is_effort:
        raise ValueError(f"metric is {metric!r}, expected 'probability' or 'probability/success'")

    def run(value: float, draws: Sequence[int]) -> tuple[NDArray[np.float64], int] | None:
        of = f"{quantity} {value:g}"
        try:
            problem = problem_of(value)
        except ValueError as error:
            raise ValueError(f"no problem has {of}: {error}; change the range") from error
        question.check(f"the problem of {of}", problem)
        parts = _trials(problem, uncertainty, seed, draws)
        found = [one for one in trials.run(question, parts, limit) if one is not None]
        joined = Draws.joined(found)
        return (joined.values, joined.steps) if len(found) == len(parts) else None

    asked = (range, probability, confidence, draws, tolerance, progress, limit)
    search = Search(quantity, run, *asked)
    with Trials(question, store=store, executor=executor, threads=threads) as trials:
        return _found(search, unit)


def _trials(
    problem: Problem, uncertainty: Uncertainty | None, seed: int, draws: Sequence[int]
) -> list[Trial]:
    """Draws that follow each other are one trial, unless each has a problem of its own."""
    if uncertainty is not None:
        belief = Belief(problem, uncertainty=uncertainty)
        asked = ((range(j, j + 1), numbered_particle(belief, seed, j)) for j in draws)
    else:
        spans = np.split(draws, np.flatnonzero(np.diff(draws) != 1) + 1)
        asked = ((range(one[0], one[-1] + 1), problem) for one in spans)
    return [Trial(k, *one) for k, one in enumerate(asked)]


def critical_value_of(
    outcomes_of: OutcomesOf,
    quantity: str,
    range: tuple[float, float],
    *,
    unit: str = "",
    probability: float = 0.95,
    confidence: float = 0.95,
    draws: int | None = None,
    tolerance: float = 0.01,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> CriticalValue:
    """The same of any trial: a simulator of yours, a grasp, a robot.

    `outcomes_of`: outcomes_of(value, numbers) is 1 for each draw that holds at a value, 0 if it is
    lost, NaN if it does not count; draw number j meets the same luck at every value. All else, and
    errors: as `critical_value`. Raises ValueError on another number of outcomes, or other ones.
    """
    function_of("outcomes_of", outcomes_of, "value", "numbers")

    def run(value: float, numbers: Sequence[int]) -> tuple[NDArray[np.float64], int]:
        found = np.asarray(outcomes_of(value, numbers), dtype=float)
        if found.shape != (len(numbers),) or not np.isin(found[~np.isnan(found)], (0, 1)).all():
            asked = f"for {len(numbers)} draws, expected as many of 0, 1 or NaN"
            raise ValueError(f"outcomes_of returned {found!r} {asked}")
        return found, 0

    asked = (range, probability, confidence, draws, tolerance, progress, Limit(timeout, cancel))
    return _found(Search(quantity, run, *asked), unit)


def one_after_the_other(
    searches: Iterable[Asked], progress: Progress | None, limit: Limit, asked: Mapping[str, Any]
) -> tuple[CriticalValue, ...]:
    """Critical values of problems by name, range and unit; those that a limit left out are unknown.

    Raises TimeoutError or Cancelled if that is the first.
    """
    found: list[CriticalValue] = []
    tell = (lambda done, total: None) if progress is None else progress
    for problem_of, name, ends, unit in searches:
        n = sum(one.rollouts for one in found)
        given: dict[str, Any] = {**asked, **limit.rest(), "unit": unit}
        given["progress"] = lambda done, total, n=n: tell(n + done, n + total)
        try:
            found.append(critical_value(problem_of, name, ends, **given))
        except (Cancelled, TimeoutError):
            if not found:
                raise
            found.append(_unknown(name, unit, ends, found[0]))
    return tuple(found)


def _unknown(name: str, unit: str, ends: tuple[float, float], like: CriticalValue) -> CriticalValue:
    """Of a search that did not begin, asked as another one."""
    low, high = map(float, ends)
    none = ((), np.zeros((0, 3)), 0, 0, 0, False)  # crossings, and what follows them
    found = (nan, low, high, like.confidence, "unknown", None)
    return CriticalValue(name, unit, (low, high), like.probability, *found, *none)


def _found(search: Search, unit: str) -> CriticalValue:
    """What a search finds."""
    parts = search.parts()
    told = [part.monotone for part in parts]
    monotone = False if search.turns() else None if None in told else False not in told
    if monotone is False:
        warn([(search.quantity, f"{search.quantity} is not monotone: {MORE}")], None)
    value, low, high, side = parts[0].crossing
    asked = (search.quantity, unit, search.scale.ends, search.probability)
    crossing = (value, low, high, search.confidence)
    crossings = tuple(part.crossing for part in parts if not isnan(part.crossing[0]))
    outcomes = np.array(sorted(row for part in parts for row in part.table()))
    found = (side, monotone, crossings, outcomes)
    counts = (search.rollouts, search.steps, int(search.diverged.sum()))
    return CriticalValue(*asked, *crossing, *found, *counts, not search.stopped)
