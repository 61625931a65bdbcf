"""Many states of MuJoCo at once as states of a scene, and the velocities of its objects."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

import energymargin as em
from energymargin.mujoco.states import States

Numbers = NDArray[np.float64]


class Columns:
    """Where the parts of MuJoCo's state are in a vector of mjSTATE_INTEGRATION, and in its part
    that the user sets (mjSTATE_USER)."""

    def __init__(self, model: Any) -> None:
        """Of a `mujoco.MjModel`."""
        kinds = mujoco.mjtState
        bits = range(int(kinds.mjNSTATE))
        sizes = {
            bit: mujoco.mj_stateSize(model, 1 << bit)
            for bit in bits
            if kinds.mjSTATE_INTEGRATION.value >> bit & 1
        }
        ends = dict(zip(sizes, np.cumsum(list(sizes.values())), strict=True))

        def of(kind: Any) -> NDArray[np.intp]:
            chosen = [
                np.arange(end - sizes[bit], end)
                for bit, end in ends.items()
                if kind.value >> bit & 1
            ]
            return np.concatenate(chosen).astype(np.intp)

        self.size = int(sum(sizes.values()))
        """Of the whole."""
        self.physics = of(kinds.mjSTATE_FULLPHYSICS)
        """What `mujoco.rollout` returns; the time is the first."""
        self.warmstart, self.user = of(kinds.mjSTATE_WARMSTART), of(kinds.mjSTATE_USER)
        self.controls = of(kinds.mjSTATE_CTRL)
        self.qpos, self.qvel = of(kinds.mjSTATE_QPOS), of(kinds.mjSTATE_QVEL)
        place = {int(column): at for at, column in enumerate(self.user)}
        applied = of(kinds.mjSTATE_XFRC_APPLIED)
        self.applied = place[int(applied[0])]
        """Of the first force, among those of the user."""
        self.control = place[int(self.controls[0])] if self.controls.size else 0
        """Of the first control, among those of the user."""
        whole = of(kinds.mjSTATE_XFRC_APPLIED)
        self.applied_of_whole = slice(int(whole[0]), int(whole[-1]) + 1)
        """Of all of these forces in the whole."""
        first = int(self.controls[0]) if self.controls.size else 0
        self.control_of_whole = slice(first, first + self.controls.size)
        place = {int(column): at for at, column in enumerate(self.physics)}
        self.qpos_of_physics = np.array([place[int(c)] for c in self.qpos], np.intp)
        self.qvel_of_physics = np.array([place[int(c)] for c in self.qvel], np.intp)


class Reader:
    """Reads a scene's numbers from MuJoCo's: of free joints, hinges and slides all at once."""

    def __init__(self, scene: em.Scene, model: Any, states: States, columns: Columns) -> None:
        """`states`: of the scene in the model. Raises ValueError on an object that it lacks."""
        self._scene, self._model, self._columns, self._states = scene, model, columns, states
        self.objects = [states.body_id(b.name) for b in scene.bodies if b.role == "object"]
        """Their numbers in the model."""
        self._free = {
            number: (int(model.jnt_qposadr[at]), int(model.jnt_dofadr[at]))
            for at, number in enumerate(model.jnt_bodyid)
            if model.jnt_type[at] == mujoco.mjtJoint.mjJNT_FREE
        }
        self._slides = _slides(model)
        names = states.names
        self._quick = all(number in self._free for _, number in names.free) and not (
            names.welds or names.missing or any(joint.held for joint, _ in names.moving)
        )

    def states(self, memory: Numbers) -> Numbers:
        """States of the scene, shape (m, n), of MuJoCo's whole states (m, h)."""
        qpos, qvel = memory[:, self._columns.qpos], memory[:, self._columns.qvel]
        if not self._quick:
            return self._slowly(memory)
        states = np.empty((len(memory), self._scene.dimension))
        for body, number in self._states.names.free:
            first, dof = self._free[number]
            row = states[:, self._scene.slice(body.name)]
            row[:, :3], row[:, 7:10] = qpos[:, first : first + 3], qvel[:, dof : dof + 3]
            row[:, 3:7] = np.roll(_unit(qpos[:, first + 3 : first + 7]), -1, axis=1)
            row[:, 10:] = _turned(row[:, 3:7], qvel[:, dof + 3 : dof + 6])
        for joint, number in self._states.names.moving:
            row = states[:, self._scene.joint_slice(joint.name)]
            row[:, 0] = qpos[:, self._model.jnt_qposadr[number]]
            row[:, 1] = qvel[:, self._model.jnt_dofadr[number]]
        return states

    def twists(self, physics: Numbers) -> Numbers:
        """Linear and angular velocity of each object at its centre of mass, along the world's axes,
        shape (m, steps, k, 6), of physics (m, steps, p)."""
        flat = physics.reshape(-1, physics.shape[-1])
        qpos, qvel = flat[:, self._columns.qpos_of_physics], flat[:, self._columns.qvel_of_physics]
        twists = np.empty((len(flat), len(self.objects), 6))
        known = self._free.keys() | self._slides.keys()
        slow = [k for k, number in enumerate(self.objects) if number not in known]
        for k, number in enumerate(self.objects):
            if number in self._slides:
                dof, axis = self._slides[number]
                twists[:, k, :3], twists[:, k, 3:] = qvel[:, [dof]] * axis, 0.0
            elif number in self._free:
                first, dof = self._free[number]
                turn = np.roll(_unit(qpos[:, first + 3 : first + 7]), -1, axis=1)
                spin = _turned(turn, qvel[:, dof + 3 : dof + 6])
                center = np.tile(self._model.body_ipos[number], (len(flat), 1))
                arm = _turned(turn, center)
                twists[:, k, :3] = qvel[:, dof : dof + 3] + np.cross(spin, arm)
                twists[:, k, 3:] = spin
        if slow:
            data = mujoco.MjData(self._model)
            for row in range(len(flat)):
                data.qpos[:], data.qvel[:] = qpos[row], qvel[row]
                self._states.refresh(data)
                for k in slow:
                    twist = np.empty(6)
                    body = mujoco.mjtObj.mjOBJ_BODY
                    mujoco.mj_objectVelocity(self._model, data, body, self.objects[k], twist, 0)
                    twists[row, k] = np.roll(twist, 3)
        return twists.reshape(*physics.shape[:2], len(self.objects), 6)

    def _slowly(self, memory: Numbers) -> Numbers:
        states = np.empty((len(memory), self._scene.dimension))
        data = mujoco.MjData(self._model)
        for row, numbers in zip(states, memory, strict=True):
            if np.isfinite(numbers).all():
                mujoco.mj_setState(
                    self._model, data, numbers, mujoco.mjtState.mjSTATE_INTEGRATION.value
                )
                row[:] = self._states.read(data)
            else:
                row[:] = np.nan
        return states


def _slides(model: Any) -> dict[int, tuple[int, Numbers]]:
    """Bodies that only slide along one line of the world: their degree of freedom, and its axis."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = {}
    for body in np.flatnonzero(model.body_jntnum == 1):
        joint = int(model.body_jntadr[body])
        still = model.body_weldid[model.body_parentid[body]] == 0
        if still and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
            found[int(body)] = int(model.jnt_dofadr[joint]), data.xaxis[joint].copy()
    return found


def _unit(quaternions: Numbers) -> Numbers:
    unit: Numbers = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    return unit


def _turned(turns: Numbers, vectors: Numbers) -> Numbers:
    """Each vector (m, 3), turned by a quaternion x, y, z, w."""
    axis, cosine = turns[:, :3], turns[:, 3:]
    twice = 2.0 * np.cross(axis, vectors)
    turned: Numbers = vectors + cosine * twice + np.cross(axis, twice)
    return turned
