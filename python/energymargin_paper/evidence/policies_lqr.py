"""An LQR along a plan: a linear model of each control period by differences of rollouts, and its
gains by the recursion of Riccati, from the end backwards.

Contacts come and go, so the model is rough: differences are wide, and gains are as weak as the
weights of the commands say.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import Feedback, Plan, Problem, Scene, World
from energymargin.base.aliases import Floats
from energymargin.model.plans import nearest_steps

__all__ = ["Law", "followed", "tracking", "values_of"]

AXES = "xyz"
WIDTHS = {"": 1e-3, "r": 5e-3, "v": 1e-2, "w": 5e-2}  # of a difference [m, rad, m/s, rad/s]
GROUPS = {
    "f": ("wrenches", 0),
    "t": ("wrenches", 3),
    "v": ("velocities", 0),
    "w": ("velocities", 3),
}


@dataclass(frozen=True, eq=False)
class Law:
    """What a controller sees of a task, and what it commands."""

    observed: tuple[str, ...]
    commands: dict[str, float]
    """By name, how large a correction counts as one, and how much of it is allowed."""
    period: float
    """Between two control times [s]."""
    errors: dict[str, float] = field(default_factory=dict)
    """What an LQR minimizes: how far off counts as one, by an observed "a" or by two, "a - b"."""

    def weights(self) -> Floats:
        """Of the observed, shape (n, n)."""
        rows = np.zeros((len(self.errors), len(self.observed)))
        for row, (name, size) in zip(rows, self.errors.items(), strict=True):
            for part, sign in zip(name.split(" - "), (1.0, -1.0), strict=False):
                row[self.observed.index(part)] = sign / size
        return np.asarray(rows.T @ rows)


def followed(problem: Problem, law: Law, gains: Floats) -> Feedback:
    """The problem's plan with gains along its undisturbed motion; (R, m, n), or (m, n) for all."""
    plan: Any = problem.plan
    states = _nominal(problem, law)
    reference = np.array([values_of(problem.scene, z, law.observed) for z in states])
    low, high = _limits(plan, law)
    return Feedback(
        gains,
        observed=list(law.observed),
        corrected=list(law.commands),
        states=reference,
        wrenches=plan.wrenches,
        targets=plan.targets,
        velocities=plan.velocities,
        motors=plan.limits,
        period=law.period,
        limits=(low, high),
        step=plan.step,
    )


def _limits(plan: Any, law: Law) -> tuple[Floats, Floats]:
    """As far as corrections are allowed beyond what the plan does at all."""
    rows = [_row(plan, name) for name in law.commands]
    spare = np.array(list(law.commands.values()))
    return np.array([r.min() for r in rows]) - spare, np.array([r.max() for r in rows]) + spare


def _row(plan: Any, name: str) -> Floats:
    """What a plan commands of a name, in each of its rows."""
    if "." not in name:
        return np.asarray(plan.targets[name])
    body, axis = name.rsplit(".", 1)
    group, first = GROUPS[axis[0]]
    return np.asarray(getattr(plan, group)[body][:, first + AXES.index(axis[1])])


def tracking(problem: Problem, law: Law) -> Floats:
    """The gains of an LQR along the plan, shape (R, m, n)."""
    states, step = _nominal(problem, law), problem.scene.step
    ends = nearest_steps(law.period * np.arange(len(states) + 1), step)
    weights = law.weights()
    effort = np.diag([1 / size**2 for size in law.commands.values()])
    cost, gains = weights, list[Any]()
    for k in reversed(range(len(states))):
        begin, count = int(ends[k]), int(ends[k + 1] - ends[k])
        a, b = _model(problem, states[k], begin, count, law)
        gain = np.linalg.solve(effort + b.T @ cost @ b, b.T @ cost @ a)
        cost = weights + a.T @ cost @ (a - b @ gain)
        cost = (cost + cost.T) / 2
        gains.append(gain)
    return np.array(gains[::-1])


def _nominal(problem: Problem, law: Law) -> list[Floats]:
    """The undisturbed states at the control times within the horizon."""
    assert problem.horizon is not None
    step, plan = problem.scene.step, problem.plan
    count = int(np.ceil(problem.horizon / law.period - 1e-6))
    ends = nearest_steps(law.period * np.arange(count), step)
    steps = round(problem.horizon / step)
    simulated = World(problem.scene, plan).simulate(problem.state, steps, record=ends.tolist())
    return list(np.asarray(simulated.states))


def _model(
    problem: Problem, state: Floats, begin: int, count: int, law: Law
) -> tuple[Floats, Floats]:
    """How the observed at the end of a control period follow from those at its begin, (n, n), and
    from a command that is held, (n, m): central differences."""
    whole: Any = problem.plan
    scene, plan = problem.scene, whole.rest(begin, problem.scene.step)
    world = World(scene, plan)

    def end(of: World, start: Floats) -> Floats:
        moved = of.simulate(start, count, record=[count]).states
        return values_of(scene, np.asarray(moved)[0], law.observed)

    columns = [
        (
            end(world, moved(scene, state, name, width))
            - end(world, moved(scene, state, name, -width))
        )
        / (2 * width)
        for name in law.observed
        for width in [WIDTHS[_kind(name)]]
    ]
    commanded = []
    for name, size in law.commands.items():
        width = 0.1 * size
        more, less = (World(scene, _added(plan, name, sign * width)) for sign in (1, -1))
        commanded.append((end(more, state) - end(less, state)) / (2 * width))
    return np.array(columns).T, np.array(commanded).T


def _added(plan: Any, name: str, value: float) -> Plan:
    """A plan with a number added to what it commands of a name."""
    parts = {
        group: {key: np.array(rows) for key, rows in getattr(plan, group).items()}
        for group in ("wrenches", "targets", "velocities")
    }
    if "." not in name:
        parts["targets"][name] += value
    else:
        body, axis = name.rsplit(".", 1)
        group, first = GROUPS[axis[0]]
        parts[group][body][:, first + AXES.index(axis[1])] += value
    return Plan(plan.step, **parts, limits=plan.limits)


def _kind(name: str) -> str:
    """ "" of a place, "r" of a rotation, "v" and "w" of velocities."""
    last = name.rsplit(".", 1)[-1]
    return "v" if last == "velocity" else last[0] if re.fullmatch("[rvw][xyz]", last) else ""


def values_of(scene: Scene, state: Floats, names: Sequence[str]) -> Floats:
    """The observed of a state, shape (n,), as em.Feedback names them."""
    return np.array([_value(scene, state, name) for name in names])


def _value(scene: Scene, state: Floats, name: str) -> float:
    place, kind = _place(scene, name), _kind(name)
    if kind == "r":
        quaternion = state[place : place + 4]
        return float(Rotation.from_quat(quaternion).as_rotvec()[AXES.index(name[-1])])
    return float(state[place])


def moved(scene: Scene, state: Floats, name: str, by: float) -> Floats:
    """A state with an observed changed."""
    changed, place = np.array(state), _place(scene, name)
    if _kind(name) == "r":
        turn = np.zeros(3)
        turn[AXES.index(name[-1])] = by
        old = Rotation.from_quat(changed[place : place + 4])
        changed[place : place + 4] = (Rotation.from_rotvec(turn) * old).as_quat()
    else:
        changed[place] += by
    return changed


def _place(scene: Scene, name: str) -> int:
    """Where a state has it; of a rotation the begin of the quaternion."""
    if name in (joints := {joint.name for joint in scene.joints}):
        return int(scene.joint_slice(name).start)
    body, last = name.rsplit(".", 1)
    if body in joints:
        return int(scene.joint_slice(body).start) + 1
    first = {"": 0, "r": 3, "v": 7, "w": 10}[_kind(name)]
    within = 0 if _kind(name) == "r" else AXES.index(last[-1])
    return int(scene.slice(body).start) + first + within
