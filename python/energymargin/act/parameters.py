"""The parameters of a plan: a box of numbers, the unit cube in which they are varied, and the
problems that they make."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Problem
from energymargin.act.candidates import check_alike
from energymargin.act.draws import Question
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, function_of, numbers_of, require, shown
from energymargin.model.plans import in_steps

Make = Callable[[dict[str, float]], "Plan | Problem | None"]
Constraint = Callable[[dict[str, float]], float]

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

    def violation(self, point: Floats) -> float:
        """By how much its values break the constraints; 0 if they do not."""
        return float(sum(max(0.0, -value) for value in self._constrained(self.box.values(point))))

    def problems(self, points: Mapping[str, Floats]) -> dict[str, Problem]:
        """The problems of points in the unit cube, by name, without those that cannot be, or break
        a constraint. Raises ValueError on one that would not meet the start's disturbances."""
        there: dict[str, Problem] = {}
        for name, point in points.items():
            values = self.box.values(point)
            made = None if self.violation(point) > 0 else self._made(values)
            if made is None:
                continue
            field = {"the start": self.start, f"what make_plan makes of {values}": made}
            check_alike(self.question.metric, field)
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
