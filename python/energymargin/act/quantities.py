"""Quantities of a problem that can be varied, by name, and their ranges."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Feedback, Plan, Problem
from energymargin.base.checks import numbers_of, one_of, positive_number, require
from energymargin.model.engines import Engine, varied_by, with_varied
from energymargin.model.plans import in_steps

DECADE = 10.0  # a range of a larger ratio is searched by ratios


@dataclass(frozen=True)
class Scale:
    """Values of a range as numbers from 0 to 1."""

    ends: tuple[float, float]

    @classmethod
    def of(cls, given: tuple[float, float]) -> Scale:
        """Raises ValueError unless it is two finite numbers that rise."""
        expected = "(low, high), which rise"
        low, high = numbers_of("range", given, expected, (2,)).tolist()
        require(low < high, "range", given, expected)
        return cls((low, high))

    def apart(self, u: float, other: float) -> float:
        """How far two values are apart, as a share of the larger one; infinite beyond the range."""
        if not np.isfinite([u, other]).all():
            return np.inf
        a, b = self.value(u), self.value(other)
        least = 0.0 if self.by_ratio else (self.ends[1] - self.ends[0]) / 50.0
        return abs(a - b) / max(abs(a), abs(b), least)

    def value(self, u: float) -> float:
        """The value at a number from 0 to 1."""
        low, high = self.ends
        value = low ** (1.0 - u) * high**u if self.by_ratio else (1.0 - u) * low + u * high
        return min(max(value, low), high)

    @property
    def by_ratio(self) -> bool:
        """Whether values are searched by ratios."""
        return self.ends[0] > 0.0 and self.ends[1] / DECADE > self.ends[0]


@dataclass(frozen=True)
class Quantity:
    """One of a problem that can be varied."""

    name: str
    unit: str
    nominal: float
    """What the problem has."""
    problem: Callable[[float], Problem]
    """The problem with another value."""


def quantity_of(problem: Problem, name: str) -> Quantity:
    """A quantity by its name.

    "push" is the largest force of a disturbance [N], of which its forces and torques are scaled;
    "horizon" [s], in whole steps; "speed" of a plan, 1 as it is; "delay" of a feedback or a policy
    [s], in whole control periods; "gain" of a feedback, 1 as it is; "friction.BODY",
    "friction.BODY,BODY" of a pair; "mass.BODY" [kg]; "force.JOINT", the largest of its drive [N] or
    [N m]; "x.BODY", "y.BODY", "z.BODY" and "rx.BODY", "ry.BODY", "rz.BODY" move a free body along
    an axis of the world [m] or turn it about one [rad]. An em.engines.Engine has those that it
    `varies`. Raises ValueError on another name, and on what has no such quantity.
    """
    engine, (kind, _, of) = problem.scene.engine, name.partition(".")
    if isinstance(engine, Engine) and (name in engine.varies or kind in OF_SCENE):
        unit, nominal = "kg" if kind == "mass" else "", varied_by(engine, name)
        return Quantity(name, unit, nominal, lambda value: with_varied(problem, {name: value}))
    part = "JOINT" if kind == "force" else "BODY"
    known = one_of("vary", f"{kind}.{part}" if of else kind, tuple(QUANTITIES))
    return QUANTITIES[known](problem, name, of)


def _need(there: object, name: str, why: str) -> None:
    """Raises ValueError if a problem lacks what a quantity is of."""
    if not there:
        raise ValueError(f"vary is {name!r}, {why}")


def _horizon(problem: Problem, name: str, _: str) -> Quantity:
    _need(problem.horizon, name, "and the problem has none: replace(horizon=1.0)")
    step = problem.scene.step

    def over(value: float) -> Problem:
        return problem.replace(horizon=max(1, round(positive_number(name, value) / step)) * step)

    return Quantity(name, "s", problem.horizon or 0.0, over)


def _push(problem: Problem, name: str, _: str) -> Quantity:
    force, torque = np.array(problem.force), np.array(problem.torque)
    most = float(force.max())
    _need(most, name, "and the problem has no force")

    def pushed(value: float) -> Problem:
        return problem.replace(force=force * (value / most), torque=torque * (value / most))

    return Quantity(name, "N", most, pushed)


def _plan_of(problem: Problem, name: str) -> Plan:
    if problem.plan is None:
        raise ValueError(f"vary is {name!r}, and the problem has no plan")
    return problem.plan


def _speed(problem: Problem, name: str, _: str) -> Quantity:
    """Rows last shorter, and motors are asked for more; the horizon is shorter likewise, and the
    state stays as it is."""
    plan, horizon = _plan_of(problem, name), problem.horizon or 0.0
    _need(horizon, name, "and the problem has no horizon: replace(horizon=1.0)")
    _need(plan.feedback is None, name, f"and the plan is {plan!r}, expected one of rows alone")

    def faster(value: float) -> Problem:
        step = problem.scene.step
        longer = max(step * positive_number(name, value) / plan.step, 1.0)  # in rows, as of now
        moves = {b: value * _means(rows, longer) for b, rows in plan.velocities.items()}
        pushes = {b: _means(rows, longer) for b, rows in plan.wrenches.items()}
        targets = {j: _lasts(rows, longer) for j, rows in plan.targets.items()}
        given: dict[str, Any] = {"wrenches": pushes, "targets": targets, "velocities": moves}
        quick = in_steps(Plan(longer * plan.step / value, limits=plan.limits, **given), step)
        # A horizon is whole steps, and no longer than the plan.
        end = min(round(horizon / value / step), int(quick.duration / step + ALMOST))
        return problem.replace(plan=quick, horizon=max(1, end) * step)

    return Quantity(name, "", 1.0, faster)


def _means(rows: NDArray[np.float64], longer: float) -> NDArray[np.float64]:
    """Means of rows (K, 6) over rows that are so many times longer."""
    if longer == 1.0:
        return rows
    whole = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    ends = _ends(len(rows), longer)
    sums = [np.interp(ends, np.arange(len(rows) + 1), column) for column in whole.T]
    return np.asarray(np.diff(np.stack(sums, axis=1), axis=0) / longer)


def _lasts(rows: NDArray[np.float64], longer: float) -> NDArray[np.float64]:
    """The last of the rows (K,) in each that is so many times longer."""
    places = np.ceil(_ends(len(rows), longer)[1:] - ALMOST).astype(int) - 1
    return np.asarray(rows[places])


def _ends(count: int, longer: float) -> NDArray[np.float64]:
    ends = longer * np.arange(int(np.ceil(count / longer - ALMOST)) + 1)
    return np.asarray(np.minimum(ends, count))


def _delay(problem: Problem, name: str, _: str) -> Quantity:
    plan = _plan_of(problem, name)
    policy, law = plan.policy, plan.feedback
    _need(law is not None, name, "and the plan observes nothing")

    def late(value: float) -> Problem:
        delay = round(value / law["period"])
        slow = policy.delayed(delay) if policy is not None else _with_law(plan, delay=delay)
        return problem.replace(plan=slow)

    return Quantity(name, "s", law["delay"] * law["period"], late)


def _gain(problem: Problem, name: str, _: str) -> Quantity:
    plan = _plan_of(problem, name)
    there = plan.feedback is not None and plan.policy is None
    _need(there, name, "and the plan has no feedback")

    def stronger(value: float) -> Problem:
        return problem.replace(plan=_with_law(plan, gains=value * plan.feedback["gains"]))

    return Quantity(name, "", 1.0, stronger)


def _with_law(plan: Plan, **changes: Any) -> Feedback:
    rows = {"wrenches": plan.wrenches, "targets": plan.targets, "velocities": plan.velocities}
    return Feedback(**{**plan.feedback, **rows, **changes}, motors=plan.limits, step=plan.step)


def _force(problem: Problem, name: str, joint: str) -> Quantity:
    joints = {one.name: one for one in problem.scene.joints}
    one = joints[one_of("vary", joint, tuple(joints))]
    _need(np.isfinite(one.torque_limit), name, "whose drive has no largest force")
    policy = None if problem.plan is None else problem.plan.policy

    def driven(value: float) -> Problem:
        whole = json.loads(problem.to_json())
        next(part for part in whole["scene"]["joints"] if part["name"] == joint)[LIMIT] = value
        policies = {} if policy is None else {policy.name: policy}
        return Problem.from_json(json.dumps(whole), policies=policies)

    unit = "N" if one.type == "prismatic" else "N m"
    return Quantity(name, unit, float(one.torque_limit), driven)


def _of_body(problem: Problem, name: str, body: str) -> Quantity:
    """Its mass or its friction, or the friction of two."""
    kind, scene = name.partition(".")[0], problem.scene
    bodies = {one.name: one for one in scene.bodies}
    pair = body.split(",", 1) if kind == "friction" and body not in bodies else [body]
    for each in pair:
        one_of("vary", each, tuple(bodies))
    two = len(pair) == 2
    of_pairs = [a if b == body else b for a, b in scene.pair_frictions if body in (a, b)]
    if kind == "friction" and of_pairs:
        own = f"whose coefficient with {of_pairs[0]!r} was set for the pair and does not follow it"
        raise ValueError(f"vary is {name!r}, {own}, expected 'friction.{body},{of_pairs[0]}'")

    def changed(value: float) -> Problem:
        other = scene.with_body(pair[0], **({} if two else {kind: value}))  # a copy
        if two:
            other.set_friction(pair[0], pair[1], value)
        return problem.replace(scene=other)

    nominal = scene.contact_friction(*pair) if two else getattr(bodies[body], kind)
    return Quantity(name, "kg" if kind == "mass" else "", float(nominal), changed)


def _pose(problem: Problem, name: str, body: str) -> Quantity:
    kind, scene = name.partition(".")[0], problem.scene
    axis, turns = AXES.index(kind[-1]), kind[0] == "r"
    one_of("vary", body, tuple(one.name for one in scene.bodies))
    links = {joint.child for joint in scene.joints}
    there = scene.unpack(problem.state).get(body, {})
    free = body not in links and len(there.get("position", ())) == 3
    _need(free, name, "along which that body does not move freely")

    def moved(value: float) -> Problem:
        state, own = np.array(problem.state), scene.slice(body)
        if turns:
            turn = Rotation.from_rotvec(value * np.eye(3)[axis])
            state[own][3:7] = (turn * Rotation.from_quat(there["orientation"])).as_quat()
        else:
            state[own][axis] += value
        return problem.with_state(state)

    return Quantity(name, "rad" if turns else "m", 0.0, moved)


AXES, LIMIT = "xyz", "torque_limit"
ALMOST = 1e-6  # of a step
QUANTITIES: dict[str, Callable[[Problem, str, str], Quantity]] = {
    **{"push": _push, "horizon": _horizon, "speed": _speed, "delay": _delay, "gain": _gain},
    **{"friction.BODY": _of_body, "mass.BODY": _of_body, "force.JOINT": _force},
    **{f"{turn}{axis}.BODY": _pose for turn in ("", "r") for axis in AXES},
}
OF_SCENE = ("friction", "mass", "force")  # which an engine of its own does not look at
