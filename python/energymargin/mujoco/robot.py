"""A plan's wrenches, targets and motors in MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan
from energymargin.mujoco.needed import needed
from energymargin.mujoco.servos import Servo, servos
from energymargin.mujoco.states import States
from energymargin.mujoco.ticks import Ticks

__all__ = ["Robot"]

Vector = NDArray[np.float64]

STANDARD_GRAVITY = 9.81  # m/s^2, of the default limits of motors, as of a Plan
SHARE_OF_WEIGHT = 2.0  # that these hold


class Robot:
    """What follows a plan.

    The controls of the joints' position actuators ask for the targets. A motor's wrench would bring
    its body to the wanted velocity in one step if nothing but gravity acted on it.
    """

    def __init__(self, plan: Plan, model: Any, states: States) -> None:
        """Raises ValueError on a body that the model lacks, or a joint without such an actuator."""
        self._mujoco, self._plan, self._model, self._states = needed(), plan, model, states
        self._wrenches = [(states.body_id(b), rows) for b, rows in plan.wrenches.items()]
        found = servos(states.names, model)
        self._targets = [(_servo(found, joint), rows) for joint, rows in plan.targets.items()]
        self._rows = Ticks(plan.step, float(model.opt.timestep))
        self._motors = [
            (states.body_id(b), rows, self._limits(b)) for b, rows in plan.velocities.items()
        ]

    def held(self, step: int) -> int:
        """Steps from a step on for which all that `act` sets stays the same."""
        if self._motors and self._rows.last(step) < self._plan.rows:
            return 1
        return self._rows.next(step) - step

    def act(self, data: Any, step: int) -> None:
        """Sets the controls, and adds to the wrenches, for a step. A row begins at the step that is
        nearest to its time."""
        row, last = self._rows.last(step), self._plan.rows - 1
        for servo, targets in self._targets:
            data.ctrl[servo.address] = servo.control(float(targets[min(row, last)]))
        if row > last:
            return
        for body, wrenches in self._wrenches:
            data.xfrc_applied[body] += wrenches[row]
        for body, velocities, limits in self._motors:
            wrench = self._motor(data, body, velocities[row])
            data.xfrc_applied[body] += np.clip(wrench, -limits, limits)

    def _motor(self, data: Any, body: int, wanted: Vector) -> Vector:
        """The wrench of a motor without limits, shape (6,)."""
        model, step = self._model, self._model.opt.timestep
        twist = self._states.twist(data, body, self._mujoco.mjtObj.mjOBJ_BODY)
        axes = data.ximat[body].reshape(3, 3)
        inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
        speed = wanted[:3] + np.cross(wanted[3:], data.xipos[body] - data.xpos[body])
        push = (speed - twist[3:]) / step - model.opt.gravity
        turn = inertia @ (wanted[3:] - twist[:3]) / step
        return np.concatenate([model.body_subtreemass[body] * push, turn])

    def _limits(self, name: str) -> Vector:
        """Of a motor, shape (6,)."""
        model, body = self._model, self._states.body_id(name)
        force, torque = self._plan.limits.get(name, (None, None))
        if force is None:
            force = SHARE_OF_WEIGHT * model.body_subtreemass[body] * STANDARD_GRAVITY
        if torque is None:
            first = model.body_geomadr[body]
            geoms = slice(first, first + model.body_geomnum[body])
            reaches = np.linalg.norm(model.geom_pos[geoms], axis=1) + model.geom_rbound[geoms]
            torque = force * reaches.max(initial=0.0)
        return np.repeat([force, torque], 3)


def _servo(found: dict[str, Servo], joint: str) -> Servo:
    if joint not in found:
        raise ValueError(
            f"plan has targets of joint {joint!r}, expected joints that the model has and that one "
            f"position actuator drives: {', '.join(found) or 'it has none'}"
        )
    return found[joint]
