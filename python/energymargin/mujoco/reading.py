"""Many states of MuJoCo at once as states of a scene, and the velocities of its objects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.mujoco.states import States

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION.value
BODY = mujoco.mjtObj.mjOBJ_BODY


class Columns:
    """Where the parts of MuJoCo's state are in a vector of mjSTATE_INTEGRATION, and in its part
    that the user sets (mjSTATE_USER)."""

    def __init__(self, model: Any) -> None:
        """Of a `mujoco.MjModel`."""
        bits = [bit for bit in range(int(mujoco.mjtState.mjNSTATE)) if INTEGRATION >> bit & 1]
        sizes = [mujoco.mj_stateSize(model, 1 << bit) for bit in bits]
        kinds = np.repeat([1 << bit for bit in bits], sizes)  # of each number of the whole

        def of(kind: str) -> NDArray[np.intp]:
            return np.flatnonzero(kinds & getattr(mujoco.mjtState, f"mjSTATE_{kind}").value)

        self.size = len(kinds)
        """Of the whole."""
        self.physics = of("FULLPHYSICS")
        """What `mujoco.rollout` returns; the time is the first."""
        self.warmstart, self.user = of("WARMSTART"), of("USER")
        self.controls, self.applied = of("CTRL"), of("XFRC_APPLIED").reshape(-1, 6)
        """Of each control, and of the wrench on each body, shape (b, 6)."""
        self.controls_of_user = np.searchsorted(self.user, self.controls)
        self.applied_of_user = np.searchsorted(self.user, self.applied)
        self.qpos, self.qvel = of("QPOS"), of("QVEL")
        self.qpos_of_physics = np.searchsorted(self.physics, self.qpos)
        self.qvel_of_physics = np.searchsorted(self.physics, self.qvel)


class Reader:
    """Reads a scene's numbers from MuJoCo's: of free joints, hinges and slides all at once."""

    def __init__(self, scene: em.Scene, model: Any, states: States, columns: Columns) -> None:
        """`states`: of the scene in the model. Raises ValueError on an object that it lacks."""
        self._scene, self._model, self._columns, self._states = scene, model, columns, states
        self.objects = [states.body_id(b.name) for b in scene.bodies if b.role == "object"]
        """Their numbers in the model."""
        free = model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
        addresses = np.stack([model.jnt_qposadr, model.jnt_dofadr], axis=1)[free].tolist()
        self._free = dict(zip(model.jnt_bodyid[free].tolist(), addresses, strict=True))
        self._slides = _slides(model)
        names = states.names
        held = any(joint.held for joint, _ in names.moving)
        free = all(number in self._free for _, number in names.free)
        self._by_joints = free and not (names.missing or held)

    def states(self, memory: Floats) -> Floats:
        """States of the scene, shape (m, n), of MuJoCo's whole states (m, h)."""
        names, columns = self._states.names, self._columns
        if names.welds:
            return self._slowly(memory)
        states = np.tile(self._states.rest, (len(memory), 1))
        bodies = self._free_joints(memory) if self._by_joints else self._kinematics(memory)
        for (body, _), rows in zip(names.free, bodies, strict=True):
            states[:, self._scene.slice(body.name)] = rows
        for joint, number in names.moving:
            position, dof = self._model.jnt_qposadr[number], self._model.jnt_dofadr[number]
            rows = states[:, self._scene.joint_slice(joint.name)]
            rows[:, 0] = memory[:, columns.qpos[position]]
            rows[:, 1] = 0.0 if joint.held else memory[:, columns.qvel[dof]]
        return states

    def _free_joints(self, memory: Floats) -> Iterator[Floats]:
        """Of each free body its rows, shape (m, 13)."""
        for _, number in self._states.names.free:
            first, dof = self._free[number]
            pose = memory[:, self._columns.qpos[first : first + 7]].T
            twist = memory[:, self._columns.qvel[dof : dof + 6]].T
            turn = _unit(pose[3:])
            yield np.concatenate([pose[:3], turn, twist[:3], _turned(turn, twist[3:])]).T

    def _kinematics(self, memory: Floats) -> Floats:
        """The same of bodies that anything moves in the model, shape (b, m, 13)."""
        model, data = self._model, mujoco.MjData(self._model)
        bodies = np.array([number for _, number in self._states.names.free], int)
        parts = data.xpos, data.xquat, data.cvel, data.subtree_com
        places = bodies, bodies, bodies, model.body_rootid[bodies]
        found = [np.empty((len(memory), *part[bodies].shape)) for part in parts]
        for number, row in enumerate(memory if bodies.size else ()):
            mujoco.mj_setState(model, data, row, INTEGRATION)
            self._states.refresh(data)
            for rows, part, at in zip(found, parts, places, strict=True):
                rows[number] = part[at]
        position, turn, twist, center = (rows.T for rows in found)
        speed = twist[3:] - _cross(position - center, twist[:3])  # as mj_objectVelocity
        rows = np.concatenate([position, turn[1:], turn[:1], speed, twist[:3]])
        return np.moveaxis(rows, 0, -1)

    def twists(self, memory: Floats, physics: Floats) -> Floats:
        """Linear and angular velocity of each object at its centre of mass, along the world's axes,
        shape (k, 6, m, steps + 1), where rollouts begin, with memory (m, h), and of their physics
        after each step, (m, steps, p)."""
        twists = np.zeros((len(self.objects), 6, len(memory), physics.shape[1] + 1))
        at, of = self._columns.qpos_of_physics, self._columns.qvel_of_physics

        def path(columns: NDArray[np.intp]) -> Floats:
            found = np.empty((columns.size, *twists.shape[2:]))
            for part, column in zip(found, columns, strict=True):
                part[:, 0] = memory[:, self._columns.physics[column]]
                part[:, 1:] = physics[:, :, column]
            return found

        for number, twist in zip(self.objects, twists, strict=True):
            if number in self._slides:
                dof, axis = self._slides[number]
                twist[:3] = path(of[[dof]]) * axis[:, None, None]
            elif number in self._free:
                first, dof = self._free[number]
                turn = _unit(path(at[first + 3 : first + 7]))
                twist[:3] = path(of[dof : dof + 3])
                twist[3:] = _turned(turn, path(of[dof + 3 : dof + 6]))
                center = self._model.body_ipos[number][:, None, None]
                if center.any():
                    twist[:3] += _cross(twist[3:], _turned(turn, center))
            else:
                self._twist_slowly(number, memory, physics, twist)
        return twists

    def _twist_slowly(self, number: int, memory: Floats, physics: Floats, twist: Floats) -> None:
        model, data, found = self._model, mujoco.MjData(self._model), np.empty(6)
        qpos, qvel = self._columns.qpos_of_physics, self._columns.qvel_of_physics
        for row, start in enumerate(memory):
            mujoco.mj_setState(model, data, start, INTEGRATION)
            positions, speeds = physics[row][:, qpos], physics[row][:, qvel]
            for step in range(twist.shape[2]):
                if step:
                    data.qpos[:], data.qvel[:] = positions[step - 1], speeds[step - 1]
                self._states.refresh(data)
                mujoco.mj_objectVelocity(model, data, BODY, number, found, 0)
                twist[:3, row, step], twist[3:, row, step] = found[3:], found[:3]

    def _slowly(self, memory: Floats) -> Floats:
        states = np.full((len(memory), self._scene.dimension), np.nan)
        data = mujoco.MjData(self._model)
        for at in np.flatnonzero(np.isfinite(memory).all(axis=1)):
            mujoco.mj_setState(self._model, data, memory[at], INTEGRATION)
            states[at] = self._states.read(data)
        return states


def _slides(model: Any) -> dict[int, tuple[int, Floats]]:
    """Bodies that only slide along one line of the world: their degree of freedom, and its axis."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = {}
    for body in np.flatnonzero(model.body_jntnum == 1):
        joint = int(model.body_jntadr[body])
        still = model.body_weldid[model.body_parentid[body]] == 0
        still &= model.body_mocapid[model.body_rootid[body]] < 0
        if still and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
            found[int(body)] = int(model.jnt_dofadr[joint]), data.xaxis[joint].copy()
    return found


def _unit(quaternions: Floats) -> Floats:
    """Quaternions w, x, y, z, their parts along the first axis, as unit ones x, y, z, w."""
    w, x, y, z = quaternions
    unit: Floats = np.stack([x, y, z, w]) / np.sqrt(w * w + x * x + y * y + z * z)
    return unit


def _cross(one: Floats, other: Floats) -> Floats:
    """Of vectors whose parts are along the first axis."""
    (a, b, c), (d, e, f) = one, other
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d])


def _turned(turns: Floats, vectors: Floats) -> Floats:
    """Each vector, turned by a quaternion x, y, z, w; their parts are along the first axis."""
    axis, cosine = turns[:3], turns[3]
    twice = 2.0 * _cross(axis, vectors)
    turned: Floats = vectors + cosine * twice + _cross(axis, twice)
    return turned
