"""Many states of MuJoCo at once as states of a scene, and the velocities of its objects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.mujoco.kinematics import INTEGRATION, Columns, Kinematics, links_of
from energymargin.mujoco.states import States

PARTS = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
"""Columns of the position, orientation, velocity and spin of a body."""
REST = np.array([0, 0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 0, 0])[:, None]
"""A body that is still at the origin."""


class Reader:
    """Reads a scene's numbers from MuJoCo's, of all states at once."""

    def __init__(self, scene: em.Scene, model: Any, states: States, columns: Columns) -> None:
        """`states`: of the scene in the model. Raises ValueError on an object that it lacks."""
        self._scene, self._model, self._columns, self._states = scene, model, columns, states
        self.objects = [states.body_id(b.name) for b in scene.bodies if b.role == "object"]
        """Their numbers in the model."""
        self._links = links_of(model, columns)
        self._centers = [model.body_ipos[body].copy() for body in self.objects]

    def states(self, memory: Floats) -> Floats:
        """States of the scene, shape (m, n), of MuJoCo's whole states (m, h)."""
        names, columns = self._states.names, self._columns
        if self._states.bends:
            return self._slowly(memory)
        states = np.tile(self._states.rest, (len(memory), 1))
        none = np.empty((len(memory), 0, columns.physics.size))
        paths = Kinematics(self._links, columns, memory, none)
        for body, number in names.free:
            rows = states[:, self._scene.slice(body.name)].T
            for at, part in zip(PARTS, paths.moving(number), strict=True):
                rows[at] = REST[at] if part is None else part[..., 0]
        for joint, number in names.moving:
            position, dof = self._model.jnt_qposadr[number], self._model.jnt_dofadr[number]
            rows = states[:, self._scene.joint_slice(joint.name)]
            rows[:, 0] = memory[:, columns.qpos[position]]
            rows[:, 1] = 0.0 if joint.held else memory[:, columns.qvel[dof]]
        return states

    def twists(self, memory: Floats, physics: Floats) -> Iterator[Floats]:
        """Linear and angular velocity of each object at its centre of mass, along the world's axes,
        shape (6, m, steps + 1), where rollouts begin, with memory (m, h), and of their physics
        after each step, (m, steps, p)."""
        paths = Kinematics(self._links, self._columns, memory, physics)
        for body, center in zip(self.objects, self._centers, strict=True):
            twist = np.zeros((6, len(memory), physics.shape[1] + 1))
            _, _, velocity, spin = paths.moving(body).at(center)
            twist[:3], twist[3:] = (
                0.0 if velocity is None else velocity,
                0.0 if spin is None else spin,
            )
            yield twist

    def _slowly(self, memory: Floats) -> Floats:
        """One state after the other, of a scene with joints that are soft welds there."""
        states = np.full((len(memory), self._scene.dimension), np.nan)
        data = mujoco.MjData(self._model)
        for at in np.flatnonzero(np.isfinite(memory).all(axis=1)):
            mujoco.mj_setState(self._model, data, memory[at], INTEGRATION)
            states[at] = self._states.read(data)
        return states
