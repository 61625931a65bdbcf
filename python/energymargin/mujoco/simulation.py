"""A simulation in MuJoCo in which the robot follows a plan and wrenches act on the objects."""

from __future__ import annotations

import math
from copy import copy
from typing import Any, NamedTuple

import mujoco
import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.mujoco.engine import Engine
from energymargin.mujoco.kinematics import INTEGRATION
from energymargin.mujoco.models import geoms_of
from energymargin.mujoco.states import States, servos


class Instant(NamedTuple):
    """An instant, and what had been done until then."""

    time: float
    """[s]."""
    effort: float
    """Integral of |f . v + tau . omega| dt [J]."""
    work: float
    """Integral of f . v + tau . omega [J]."""
    state: Floats
    """Shape (n,)."""


class Simulation:
    """A rollout of em.mujoco.Engine, and the work of the wrenches on the objects so far."""

    def __init__(self, scene: em.Scene, model: Any, data: Any, plan: em.Plan | None = None) -> None:
        """`plan` begins where the data are. Raises ValueError if the model lacks what it moves."""
        self.model, self.engine = model, Engine(model, data, scene=scene)
        self.states = States(scene, model)
        self.row = self.engine.home.copy()
        """MuJoCo's whole state now, mjSTATE_INTEGRATION."""
        self.steps = 0
        self.effort = 0.0
        """Integral of |f . v + tau . omega| dt [J]."""
        self.work = 0.0
        self.objects = self.engine.objects
        """Their numbers in the model."""
        self._data = mujoco.MjData(model)
        self._before = self.row[self.engine.columns.applied]
        self._robot = ModelRobot(plan, model, self.states) if plan else None
        self.push(np.zeros((len(self.objects), 6)))

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.steps * self.model.opt.timestep)

    @property
    def instant(self) -> Instant:
        """This one."""
        return Instant(self.time, self.effort, self.work, self.state())

    def push(self, wrenches: Floats) -> None:
        """From now on wrenches act on the k objects, shape (k, 6) [N, N m]."""
        self._wrenches = wrenches

    def advance(self, steps: int) -> None:
        """Some steps. Raises RuntimeError if MuJoCo diverges."""
        end = self.steps + steps
        while self.steps < end:
            some = end - self.steps
            self.row[self.engine.columns.applied] = self._before
            if self._robot:
                some = min(some, self._robot.held(self.steps))
                self._robot.act(self, self.steps)
            pushes = np.repeat(self._wrenches[None, None], some, axis=1)
            batch = em.engines.Batch(np.empty((1, 0)), self.row[None], pushes, {}, some, some)
            rows, _, work = self.engine.follow(batch)
            if not np.isfinite(rows).all():
                raise RuntimeError(f"MuJoCo diverged after {self.time:.3g} s")
            self.row, self.steps = rows[0], self.steps + some
            self.effort += float(np.abs(work).sum())
            self.work += float(work.sum())

    def state(self) -> Floats:
        """State of the scene, shape (n,)."""
        return self.states.read(self.data())

    def data(self) -> Any:
        """A `mujoco.MjData` there until the next call, also by a branch; its poses and velocities
        are refreshed."""
        mujoco.mj_setState(self.model, self._data, self.row, INTEGRATION)
        self.states.refresh(self._data)
        return self._data

    def put(self, state: Floats) -> None:
        """Goes on from another state, shape (n,)."""
        data = self.data()
        self.states.write(data, state)
        mujoco.mj_getState(self.model, data, self.row, INTEGRATION)

    def branch(self) -> Simulation:
        """A copy that goes on alone."""
        other = copy(self)
        other.row = self.row.copy()
        return other


STANDARD_GRAVITY = 9.81  # m/s^2, of the default limits of motors, as of a Plan
SHARE_OF_WEIGHT = 2.0  # that these hold


class ModelRobot:
    """What follows a plan.

    The controls of the joints' position actuators ask for the targets. A motor's wrench would bring
    its body to the wanted velocity in one step if nothing but gravity acted on it.
    """

    def __init__(self, plan: em.Plan, model: Any, states: States) -> None:
        """Raises ValueError on a body that the model lacks, a joint without such an actuator, and a
        plan that depends on the state."""
        if plan.feedback is not None:
            raise ValueError(f"plan is {plan!r}, expected one of rows alone: MuJoCo follows those")
        self._plan, self._model, self._states = plan, model, states
        self._wrenches = [(states.body_id(b), rows) for b, rows in plan.wrenches.items()]
        found = servos(states.names, model)
        lacking = [joint for joint in plan.targets if joint not in found]
        if lacking:
            raise ValueError(
                f"plan has targets of joint {lacking[0]!r}, expected joints that the model has and "
                f"that one position actuator drives: {', '.join(found) or 'it has none'}"
            )
        self._targets = [(found[joint], rows) for joint, rows in plan.targets.items()]
        self._rows = Ticks(plan.step, float(model.opt.timestep))
        moved = plan.velocities.items()
        self._motors = [(states.body_id(b), rows, self._limits(b)) for b, rows in moved]

    def held(self, step: int) -> int:
        """Steps from a step on for which all that `act` sets stays the same."""
        if self._motors and self._rows.last(step) < self._plan.rows:
            return 1
        return self._rows.next(step) - step

    def act(self, simulation: Simulation, step: int) -> None:
        """Sets the controls, and adds to the wrenches, for a step. A row begins at the step that is
        nearest to its time."""
        row, last = self._rows.last(step), self._plan.rows - 1
        columns = simulation.engine.columns
        for servo, targets in self._targets:
            wanted = servo.control(float(targets[min(row, last)]))
            simulation.row[columns.controls[servo.actuator.address]] = wanted
        if row > last:
            return
        for body, wrenches in self._wrenches:
            simulation.row[columns.applied[body]] += wrenches[row]
        data = simulation.data() if self._motors else None
        for body, velocities, limits in self._motors:
            wrench = self._motor(data, body, velocities[row])
            simulation.row[columns.applied[body]] += np.clip(wrench, -limits, limits)

    def _motor(self, data: Any, body: int, wanted: Floats) -> Floats:
        """The wrench of a motor without limits, shape (6,)."""
        model, step = self._model, self._model.opt.timestep
        twist = self._states.twist(data, body, mujoco.mjtObj.mjOBJ_BODY)
        axes = data.ximat[body].reshape(3, 3)
        inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
        speed = wanted[:3]
        if wanted[3:].any():  # a product takes as long as a step of MuJoCo
            speed = speed + np.cross(wanted[3:], data.xipos[body] - data.xpos[body])
        push = (speed - twist[3:]) / step - model.opt.gravity
        turn = inertia @ (wanted[3:] - twist[:3]) / step
        return np.concatenate([model.body_subtreemass[body] * push, turn])

    def _limits(self, name: str) -> Floats:
        """Limits of a motor's force and torque, shape (6,)."""
        model, body = self._model, self._states.body_id(name)
        force, torque = self._plan.limits.get(name, (None, None))
        if force is None:
            force = SHARE_OF_WEIGHT * model.body_subtreemass[body] * STANDARD_GRAVITY
        if torque is None:
            geoms = geoms_of(model, body)
            reaches = np.linalg.norm(model.geom_pos[geoms], axis=1) + model.geom_rbound[geoms]
            torque = force * reaches.max(initial=0.0)
        return np.repeat([force, torque], 3)


class Ticks:
    """The multiples of a period, each rounded to a step by itself.

    A period that is no whole number of steps so keeps its length in the mean.
    """

    def __init__(self, period: float, timestep: float) -> None:
        """Both in [s]."""
        self._steps = period / timestep

    def step(self, number: int) -> int:
        """The step of an instant."""
        return math.floor(number * self._steps + 0.5)

    def last(self, step: int) -> int:
        """The number of the last instant that is not after a step."""
        number = int(step / self._steps)
        while self.step(number + 1) <= step:
            number += 1
        return number

    def next(self, step: int) -> int:
        """The step of the first instant after a step."""
        return self.step(self.last(step) + 1)
