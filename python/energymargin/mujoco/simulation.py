"""A simulation in MuJoCo in which the robot follows a plan and wrenches act on the objects."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plan, Scene
from energymargin.mujoco.needed import needed
from energymargin.mujoco.robot import Robot
from energymargin.mujoco.states import States

__all__ = ["Simulation"]

Vector = NDArray[np.float64]


class Simulation:
    """A copy of some data, step by step, and the work of the wrenches on the objects so far."""

    def __init__(self, scene: Scene, model: Any, data: Any, plan: Plan | None = None) -> None:
        """`plan` begins where the data are. Raises ValueError if the model lacks what it moves."""
        self._mujoco = needed()
        self.model, self.states, self.data = model, States(scene, model), copy(data)
        self.steps = 0
        self.effort = 0.0
        """Integral of |f . v + tau . omega| dt [J]."""
        self.work = 0.0
        names = [body.name for body in scene.bodies if body.role == "object"]
        self.objects = [self.states.body_id(name) for name in names]
        """Their numbers in the model."""
        self._applied = np.array(data.xfrc_applied)
        self._robot = Robot(plan, model, self.states) if plan else None
        self.push(np.zeros((len(names), 6)))

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.steps * self.model.opt.timestep)

    def push(self, wrenches: Vector) -> None:
        """From now on wrenches act on the k objects, shape (k, 6) [N, N m]."""
        self._wrenches = wrenches
        self._pushes = bool(np.any(wrenches))
        self._turned = np.roll(wrenches, 3, axis=1)  # torque first, as MuJoCo has it

    def advance(self, steps: int) -> None:
        """Some steps. Raises RuntimeError if MuJoCo diverges."""
        left = steps
        while left > 0:
            some = min(left, self._robot.held(self.steps)) if self._robot else left
            self._load()
            self._step(some)
            left -= some

    def state(self) -> Vector:
        """Of the scene, shape (n,)."""
        return self.states.read(self.data)

    def put(self, state: Vector) -> None:
        """Goes on from another state, shape (n,)."""
        self.states.write(self.data, state)

    def branch(self) -> Simulation:
        """A copy that goes on alone."""
        other = copy(self)
        other.data = copy(self.data)
        return other

    def _load(self) -> None:
        """Sets what acts in the next steps."""
        self.data.xfrc_applied[:] = self._applied
        if self._robot:
            self._robot.act(self.data, self.steps)
        self.data.xfrc_applied[self.objects] += self._wrenches

    def _step(self, steps: int) -> None:
        before = self.data.time
        if self._pushes:
            self._step_working(steps)
        else:
            self._mujoco.mj_step(self.model, self.data, steps)
        if not self.data.time > before:  # then it has begun anew
            raise RuntimeError(f"MuJoCo diverged after {self.time:.3g} s")
        self.steps += steps

    def _step_working(self, steps: int) -> None:
        """An impulse works along the mean of the velocities before and after the step."""
        half = self.model.opt.timestep / 2
        before = self._powers()
        for _ in range(steps):
            self._mujoco.mj_step(self.model, self.data)
            after = self._powers()
            for one, other in zip(before, after, strict=True):
                work = half * (one + other)
                self.effort += abs(work)
                self.work += work
            before = after

    def _powers(self) -> list[float]:
        """Of the wrench on each object, at its centre of mass [W]."""
        self.states.refresh(self.data)
        at_mass = self._mujoco.mjtObj.mjOBJ_BODY
        twists = (self.states.twist(self.data, body, at_mass) for body in self.objects)
        return [float(w @ twist) for w, twist in zip(self._turned, twists, strict=True)]
