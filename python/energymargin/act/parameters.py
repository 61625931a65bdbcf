"""How a search varies plans: the parameters of a plan, the problems that they make, and CMA-ES.

Parameters are a box of numbers, varied in the unit cube, in which CMA-ES proposes points. Where
every plan holds for certain, no draw tells which holds best. The strongest disturbance that a plan
withstands does. So the disturbance grows while most candidates hold, and the search still has a
slope.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Problem
from energymargin.act.draws import Disturbance, Question
from energymargin.base.checks import check_type, function_of, numbers_of, require, shown
from energymargin.base.errors import needs_extra
from energymargin.disturbances import ActuationNoise, Gaussian, Uniform, of_plan
from energymargin.model.plans import in_steps

Make = Callable[[dict[str, float]], "Plan | Problem | None"]
Constraint = Callable[[dict[str, float]], float]
Point = NDArray[np.float64]

EXPECTED = "(low, high) or (low, start, high), rising"


class Parameters:
    """D numbers between bounds, each with the value that it starts from."""

    def __init__(self, given: Mapping[str, Sequence[float]]) -> None:
        """By name (low, high), which starts in the middle, or (low, start, high).

        Raises ValueError on others, and on none.
        """
        right = isinstance(given, Mapping) and given
        require(right, "parameters", given, "a dict: name -> (low, high)")
        bounds = {name: _bounds(name, value) for name, value in given.items()}
        self.ranges = {name: (low, high) for name, (low, _, high) in bounds.items()}
        """By name (low, high)."""
        self._low, self._start, self._high = np.array(list(bounds.values())).T

    def __len__(self) -> int:
        """D."""
        return len(self.ranges)

    @property
    def start(self) -> NDArray[np.float64]:
        """In the unit cube, shape (D,)."""
        return np.asarray((self._start - self._low) / (self._high - self._low))

    def values(self, point: NDArray[np.float64]) -> dict[str, float]:
        """By name, of a point in the unit cube, shape (D,). The start is met to the bit."""
        exact = np.array_equal(point, self.start)
        found = self._start if exact else self._low + point * (self._high - self._low)
        return dict(zip(self.ranges, found.tolist(), strict=True))


@dataclass(eq=False)
class Maker:
    """What points become: values, constraints and problems."""

    problem: Problem
    box: Parameters
    make_plan: Make
    constraints: Sequence[Constraint]
    question: Question
    start: Problem = field(init=False)
    """The problem of the start."""

    def __post_init__(self) -> None:
        """Raises ValueError on what is no problem and no function, and if the start cannot be."""
        listed = isinstance(self.constraints, Sequence) and not callable(self.constraints)
        require(listed, "constraints", self.constraints, "a list of functions")
        for number, one in enumerate(self.constraints):
            function_of(f"constraints[{number}]", one, "values")
        check_type("problem", self.problem, Problem, "a Problem")
        function_of("make_plan", self.make_plan, "values")
        values = self.box.values(self.box.start)
        for number, value in enumerate(self._constrained(values)):
            if value < 0:
                said = f"constraints[{number}] is {value:g} at the start {values}"
                raise ValueError(f"{said}, expected at least 0")
        made = self._made(values)
        if made is None:
            raise ValueError(f"make_plan returned None for the start {values}, expected a plan")
        self.question.check("problem", made)
        self.start = made

    def violation(self, point: Point) -> float:
        """By how much its values break the constraints; 0 if they do not."""
        found = self._constrained(self.box.values(point))
        return float(sum(max(0.0, -value) for value in found))

    def problems(self, points: Mapping[str, Point]) -> dict[str, Problem]:
        """The problems of points in the unit cube, by name, without those that cannot be, or break
        a constraint. Raises ValueError on one of another horizon than the start's, unless success
        is asked."""
        there: dict[str, Problem] = {}
        for name, point in points.items():
            values = self.box.values(point)
            made = None if self.violation(point) > 0 else self._made(values)
            if made is None:
                continue
            same = made.horizon == self.start.horizon
            if not same and self.question.metric != "probability/success":
                of = f"{made.horizon} s for {values}, of {self.start.horizon} s for the start"
                way = "expected the same: set the problem's horizon"
                raise ValueError(f"make_plan makes a horizon of {of}, {way}")
            there[name] = made
        return there

    def _made(self, values: dict[str, float]) -> Problem | None:
        made = self.make_plan(dict(values))
        if made is None or isinstance(made, Problem):
            return made
        if not isinstance(made, Plan):
            expected = "expected a Plan, a Problem or None"
            raise ValueError(f"make_plan returned {shown(made)} for {values}, {expected}")
        try:
            plan = in_steps(made, self.problem.scene.step)
            horizon = plan.duration if self.problem.horizon is None else self.problem.horizon
            changed: Problem = self.problem.replace(plan=plan, horizon=horizon, effector="coast")
        except ValueError as error:
            raise ValueError(f"make_plan, for {values}: {error}") from error
        return changed

    def _constrained(self, values: dict[str, float]) -> Iterator[float]:
        """Yields the values of the constraints; True is 0, and False -1."""
        for number, constraint in enumerate(self.constraints):
            value = constraint(dict(values))
            if isinstance(value, (bool, np.bool_)):
                value = float(value) - 1.0
            if not isinstance(value, (int, float, np.number)) or np.isnan(value):
                returned = f"constraints[{number}] returned {shown(value)}"
                raise ValueError(f"{returned} for {values}, expected a number")
            yield float(value)


def _bounds(name: Any, value: Any) -> tuple[float, float, float]:
    if not isinstance(name, str):
        raise ValueError(f"parameters has the name {shown(name)}, expected a str")
    what = f"parameters[{name!r}]"
    numbers = numbers_of(what, value, EXPECTED)
    if numbers.shape == (2,):
        numbers = np.insert(numbers, 1, numbers.sum() / 2)
    good = numbers.shape == (3,) and np.isfinite(numbers).all()
    rising = good and numbers[0] <= numbers[1] <= numbers[2] and numbers[0] < numbers[2]
    require(rising, what, value, EXPECTED)
    low, start, high = numbers.tolist()
    return low, start, high


LEAST_POPULATION = 12  # draws are random: more points average more of that out than CMA-ES's own
SIGMA = 0.2  # of the unit cube's edge, at the start

GROWTH = 1.25  # of the disturbance, from one generation to the next
HOLD = 0.9  # where half of the candidates hold so well, it grows
FAIL = 0.5  # where no candidate holds so well, it shrinks again
MOST = 20.0  # times the stated one

Array = NDArray[np.float64]


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

    def __init__(self, start: Array, seed: int) -> None:
        """`start`: shape (D,)."""
        # One parameter alone is varied with a second one that does nothing: cma asks for two.
        self._dimension = len(start)
        padded = np.append(start, 0.5) if len(start) == 1 else start
        random = np.random.default_rng(seed)
        options = {"bounds": [0.0, 1.0], "popsize": population_of(len(start)), "verbose": -9}
        options["randn"] = lambda *shape: random.standard_normal(shape)
        options["seed"] = math.nan  # numpy's global generator is not touched
        self._search = cma_package().CMAEvolutionStrategy(padded, SIGMA, options)
        self._asked: list[Array] = []

    def ask(self) -> Array:
        """The points of the next generation, shape (P, D)."""
        self._asked = self._search.ask()
        return np.array(self._asked)[:, : self._dimension]

    def tell(self, losses: Sequence[float]) -> None:
        """What the points that were asked last cost; less is better."""
        self._search.tell(self._asked, list(losses))

    @property
    def favourite(self) -> Array:
        """The mean of its distribution, shape (D,)."""
        return np.asarray(self._search.result.xfavorite)[: self._dimension]


def adapted(factor: float, scores: Array) -> float:
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


def _scaled_wrenches(function: Any, factor: float, random: Any, times: Any) -> Array:
    """Those of a user's function, so many times as strong."""
    return factor * np.asarray(function(random, times))
