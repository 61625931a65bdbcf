"""Plans and control times in steps of a scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Plan, Problem
from energymargin.base.checks import check_type, positive_number

ROUNDING = 1e-6  # of a step


def whole_steps(name: str, time: float, step: float) -> int:
    """How many steps [s] a time [s] is; ValueError with `name` unless it is one or more whole
    ones."""
    count = positive_number(name, time) / step
    if round(count) < 1 or abs(count - round(count)) > ROUNDING * max(count, 1.0):
        near = max(round(count), 1) * step
        expected = f"expected whole steps of {step:.6g} s, such as {near:.6g}"
        raise ValueError(f"{name} is {time!r} s, {expected}")
    return round(count)


def control_period(name: str, time: float, step: float) -> float:
    """A time [s] between two controls; ValueError with `name` unless it is a step [s] or more."""
    if positive_number(name, time) < (1 - ROUNDING) * step:
        raise ValueError(f"{name} is {time!r} s, expected at least a step of {step:.6g} s")
    return float(time)


def nearest_steps(times: ArrayLike, step: float) -> NDArray[np.int64]:
    """The step [s] that is nearest to each time [s], of two the later one.

    Each is rounded by itself. So control times of a rate that is not one of whole steps keep that
    rate in the mean: at 240 steps a second, those of 50 Hz are steps 0, 5, 10, 14, 19, 24, ...
    """
    return np.floor(np.asarray(times, float) / step + 0.5 + ROUNDING).astype(np.int64)


def in_steps(plan: Plan, step: float) -> Plan:
    """The plan for a scene of this step [s], which a problem and a world take.

    Each row begins at the step that is nearest to its time, by `nearest_steps`: rows of 50 Hz last
    5 or 4 steps at 240 steps a second, and 50 of them a second. A plan whose rows are whole steps
    is itself. Raises ValueError on rows shorter than a step.
    """
    count = control_period("step of the plan", plan.step, step) / step
    if abs(count - round(count)) <= ROUNDING * count:
        return plan
    return plan.fine_rows(step)


def with_plan(problem: Problem, plan: Plan) -> Problem:
    """The problem with a plan in place of its own, whose duration is the horizon; that of the
    problem stays where the plan reacts, and may go on with its last row."""
    check_type("plan", plan, Plan, "a Plan")
    fitting = in_steps(plan, problem.scene.step)
    ends = fitting.feedback is None or problem.horizon is None
    horizon = fitting.duration if ends else problem.horizon
    return problem.replace(plan=fitting, horizon=horizon, effector="coast", start_outside=True)
