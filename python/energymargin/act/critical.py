"""How much can it take? Where a probability falls below what is asked, as a quantity varies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, Problem
from energymargin.act.crossing import PILOT, Asking, Outcomes, Rule, Run, crossings
from energymargin.act.draws import Disturbance, Question, Trial, check_uncertainty
from energymargin.act.scale import Scale
from energymargin.act.trials import Trials
from energymargin.base.checks import function_of, function_or_none, share, whole_number
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.evaluate.executors.choice import Executor
from energymargin.model.beliefs.belief import Belief, numbered_particle
from energymargin.model.beliefs.uncertainty import Uncertainty

MORE = (
    "what is lost at a value holds at a harder one. All crossings that were found are in "
    "`crossings`, and there may be more between them. A shorter range has closer values"
)

ProblemOf = Callable[[float], Problem]
OutcomesOf = Callable[[float, Sequence[int]], Any]


@dataclass(frozen=True, eq=False, repr=False)
class CriticalValue(Record, Summarized):
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

    @staticmethod
    def unknown(
        quantity: str, unit: str, range: tuple[float, float], *, like: CriticalValue
    ) -> CriticalValue:
        """Of a search that did not begin, asked as another one."""
        ends = (float(range[0]), float(range[1]))
        asked: dict[str, Any] = {
            "quantity": quantity,
            "unit": unit,
            "range": ends,
            "side": "unknown",
        }
        known: dict[str, Any] = {
            "value": nan,
            "low": ends[0],
            "high": ends[1],
            "monotone": None,
            "crossings": (),
        }
        counts: dict[str, Any] = {
            "rollouts": 0,
            "steps": 0,
            "diverged": 0,
            "outcomes": np.zeros((0, 3)),
        }
        return replace(like, **asked, **known, **counts, complete=False)


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
    limit = Limit(timeout, cancel)
    function_of("problem_of", problem_of, "value")
    check_uncertainty(uncertainty)
    asked = (quantity, range, unit, probability, confidence, draws, tolerance, progress, limit)
    search, question = _Search(*asked), Question(metric, disturbance, seed)
    if question.is_effort:
        raise ValueError(f"metric is {metric!r}, expected 'probability' or 'probability/success'")
    with Trials(question, store=store, executor=executor, threads=threads) as trials:
        return search.found(_Rollouts(problem_of, quantity, question, uncertainty, trials, limit))


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
    limit = Limit(timeout, cancel)

    def run(value: float, numbers: Sequence[int]) -> Iterator[Outcomes | None]:
        if limit.reached:
            yield None
            return
        found = np.asarray(outcomes_of(value, numbers), dtype=float)
        if found.shape != (len(numbers),) or not np.isin(found[~np.isnan(found)], (0, 1)).all():
            raise ValueError(
                f"outcomes_of returned {found!r} for {len(numbers)} draws, expected as many of 0, "
                "1 or NaN"
            )
        yield Outcomes(numbers, found, 0)

    asked = (quantity, range, unit, probability, confidence, draws, tolerance, progress, limit)
    return _Search(*asked).found(run)


Progress = Callable[[int, int], None]


def going_on(progress: Progress | None, found: Sequence[CriticalValue]) -> Progress | None:
    """Progress of one more search."""
    if progress is None:
        return None
    before = sum(one.rollouts for one in found)
    return lambda done, total: progress(before + done, before + total)


@dataclass(frozen=True)
class _Search:
    """What a search is asked; raises ValueError on what cannot be."""

    quantity: str
    ends: tuple[float, float]
    unit: str
    probability: float
    confidence: float
    draws: int | None
    tolerance: float
    progress: Callable[[int, int], None] | None
    limit: Limit

    def __post_init__(self) -> None:
        """Checks it."""
        function_or_none("progress", self.progress, "done", "total")
        Scale.of(self.ends)
        for name in ("probability", "confidence"):
            if share(name, of := getattr(self, name)) == 0.0:
                raise ValueError(f"{name} is {of:g}, expected a number between 0 and 1")
        if not 0.0 < share("tolerance", self.tolerance) < 0.5:
            raise ValueError(
                f"tolerance is {self.tolerance:g}, expected a share of the range, such as 0.01"
            )
        if self.draws is not None:
            whole_number("draws", self.draws, PILOT)

    def found(self, run: Run) -> CriticalValue:
        """What it finds."""
        rule, scale = Rule.of(self.probability, self.confidence, self.draws), Scale.of(self.ends)
        asking = Asking(self.quantity, run, scale, rule, self.progress)
        parts = crossings(asking, self.tolerance, self.limit)
        found = [part.crossing for part in parts]
        first, told = found[0], [one.monotone for one in found]
        monotone = False if asking.turns() else None if None in told else False not in told
        if monotone is False:
            warn([(self.quantity, f"{self.quantity} is not monotone: {MORE}")], None)
        return CriticalValue(
            self.quantity,
            self.unit,
            scale.ends,
            self.probability,
            first.value,
            *(first.low, first.high, self.confidence, first.side),
            monotone=monotone,
            crossings=tuple((c.value, c.low, c.high, c.side) for c in found if not isnan(c.value)),
            outcomes=np.array(sorted(row for part in parts for row in part.table())),
            rollouts=asking.rollouts,
            steps=asking.steps,
            diverged=int(asking.diverged.sum()),
            complete=not asking.stopped,
        )


@dataclass(frozen=True)
class _Rollouts:
    """Outcomes of rollouts of problems."""

    problem_of: ProblemOf
    quantity: str
    question: Question
    uncertainty: Uncertainty | None
    trials: Trials
    limit: Limit

    def __call__(self, value: float, draws: Sequence[int]) -> Iterator[Outcomes | None]:
        """As Run."""
        spans, problems = self._problems(value, draws)
        asked = [Trial(k, *one) for k, one in enumerate(zip(spans, problems, strict=True))]
        found = self.trials.run(self.question, asked, self.limit)
        for span, one in zip(spans, found, strict=True):
            yield None if one is None else Outcomes(span, one.values, one.steps)

    def _problems(self, value: float, draws: Sequence[int]) -> tuple[list[range], list[Problem]]:
        """Draws that have one problem together, and that of each."""
        try:
            problem = self.problem_of(value)
        except ValueError as error:
            said = f"no problem has {self.quantity} {value:g}: {error}; change the range"
            raise ValueError(said) from error
        self.question.check(f"the problem of {self.quantity} {value:g}", problem)
        if self.uncertainty is not None:
            belief, seed = Belief(problem, uncertainty=self.uncertainty), self.question.seed
            problems = [numbered_particle(belief, seed, j) for j in draws]
            return [range(j, j + 1) for j in draws], problems
        cuts = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(draws)) if b != a + 1), len(draws)]
        spans = [range(draws[a], draws[b - 1] + 1) for a, b in pairwise(cuts)]
        return spans, [problem] * len(spans)
