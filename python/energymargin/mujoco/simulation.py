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

DIVERGED = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")


class Simulation:
    """A copy of some data, step by step, and the work of the wrenches on the objects so far."""

    def __init__(self, scene: Scene, model: Any, data: Any, plan: Plan | None = None) -> None:
        """`plan` begins where the data are. Raises ValueError if the model lacks what it moves."""
        self._mujoco = needed()
        self.model, self.states = model, States(scene, model)
        self.data = copy(data)
        self.steps = 0
        self.effort = 0.0
        """Integral of |f . v + tau . omega| dt [J]."""
        self.work = 0.0
        self._applied = np.array(data.xfrc_applied)
        objects = [body.name for body in scene.bodies if body.role == "object"]
        self.objects = [self.states.body_id(name) for name in objects]
        """Their numbers in the model."""
        self._robot = Robot(plan, model, self.states) if plan else None
        self._warned = self._warnings()
        self.states.refresh(self.data)
        self._velocities = self._object_velocities()

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.steps * self.model.opt.timestep)

    def step(self, wrenches: Vector) -> None:
        """One step under wrenches on the k objects, shape (k, 6) [N, N m].

        Raises RuntimeError if MuJoCo diverges.
        """
        data, before = self.data, self._velocities
        data.xfrc_applied[:] = self._applied
        if self._robot:
            self._robot.act(data, self.time)
        data.xfrc_applied[self.objects] += wrenches
        self._mujoco.mj_step(self.model, data)
        if self._warnings() > self._warned:
            raise RuntimeError(f"MuJoCo diverged after {self.time:.3g} s")
        self.steps += 1
        self.states.refresh(data)
        self._velocities = self._object_velocities()
        mean = (before + self._velocities) / 2
        works = self.model.opt.timestep * np.einsum("ij,ij->i", wrenches, mean)
        self.effort += float(np.abs(works).sum())
        self.work += float(works.sum())

    def state(self) -> Vector:
        """Of the scene, shape (n,)."""
        return self.states.read(self.data)

    def put(self, state: Vector) -> None:
        """Goes on from another state, shape (n,)."""
        self.states.write(self.data, state)
        self._velocities = self._object_velocities()

    def branch(self) -> Simulation:
        """A copy that goes on alone."""
        other = object.__new__(Simulation)
        other.__dict__.update(self.__dict__)
        other.data = copy(self.data)
        return other

    def _object_velocities(self) -> Vector:
        """Of the centres of mass, along the world's axes, shape (k, 6)."""
        at_mass = self._mujoco.mjtObj.mjOBJ_BODY
        twists = [self.states.twist(self.data, body, at_mass).copy() for body in self.objects]
        return np.roll(np.reshape(twists, (-1, 6)), 3, axis=1)

    def _warnings(self) -> int:
        kinds = self._mujoco.mjtWarning
        return sum(self.data.warning[getattr(kinds, kind)].number for kind in DIVERGED)
