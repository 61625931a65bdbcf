"""Velocities of bodies of a MuJoCo model, for many of its positions and velocities at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.aliases import Floats

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION.value

KINDS = mujoco.mjtJoint


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
        self.mocap = of("MOCAP_POS").reshape(-1, 3), of("MOCAP_QUAT").reshape(-1, 4)
        """Position and quaternion of each mocap body."""
        self.controls_of_user = np.searchsorted(self.user, self.controls)
        self.applied_of_user = np.searchsorted(self.user, self.applied)
        self.qpos, self.qvel = of("QPOS"), of("QVEL")
        self.qpos_of_physics = np.searchsorted(self.physics, self.qpos)
        self.qvel_of_physics = np.searchsorted(self.physics, self.qvel)


class Moving(NamedTuple):
    """Where a frame is and how it moves, over paths: shapes (3, m, n), or what broadcasts to it."""

    position: Floats
    """[m]."""
    turn: Floats | None
    """Unit quaternions x, y, z, w; None: none."""
    velocity: Floats | None = None
    """[m/s]; None: it is still."""
    spin: Floats | None = None
    """[rad/s]; None: it does not turn."""

    def shifted(self, way: Floats) -> Moving:
        """Of the same rigid body, at a place that is `way` from here."""
        moved = self._replace(position=self.position + way)
        if self.spin is None:
            return moved
        return moved._replace(velocity=_sum(self.velocity, _cross(self.spin, way)))

    def at(self, place: Floats) -> Moving:
        """At a place (3,) in its own axes."""
        return self.shifted(_turned(self.turn, _column(place))) if place.any() else self


class Kinematics:
    """What mj_kinematics and mj_comVel find, over m paths of n instants each."""

    def __init__(self, model: Any, columns: Columns, memory: Floats, physics: Floats) -> None:
        """Paths begin with whole states, memory (m, h), and go on with physics (m, n - 1, p)."""
        self._model, self._columns = model, columns
        self._memory, self._physics = memory, physics
        self._found = dict[int, Moving]()

    def moving(self, body: int) -> Moving:
        """The frame of a body."""
        if body not in self._found:
            self._found[body] = self._moving(body)
        return self._found[body]

    def center(self, body: int) -> Moving:
        """Its centre of mass."""
        return self.moving(body).at(self._model.body_ipos[body])

    def _moving(self, body: int) -> Moving:
        model = self._model
        if body == 0:
            return Moving(np.zeros((3, 1, 1)), None)
        mocap = int(model.body_mocapid[body])
        if mocap >= 0:
            position, turn = (part[mocap] for part in self._columns.mocap)
            start = self._memory.T[..., None]
            return Moving(start[position], _unit(start[turn]))
        first = int(model.body_jntadr[body])
        joints = range(first, first + int(model.body_jntnum[body]))
        if joints and model.jnt_type[first] == KINDS.mjJNT_FREE:
            return self._free(first)
        now = self.moving(int(model.body_parentid[body])).at(model.body_pos[body])
        if model.body_quat[body, 1:].any():
            own = _unit(_column(model.body_quat[body]))
            now = now._replace(turn=_product(now.turn, own))
        for joint in joints:
            now = self._after(joint, now)
        return now

    def _free(self, joint: int) -> Moving:
        at, of = self._places(joint)
        turn = _unit(self._path(at[3:7]))
        spin = _turned(turn, self._path(of[3:6]))
        return Moving(self._path(at[:3]), turn, self._path(of[:3]), spin)

    def _after(self, joint: int, now: Moving) -> Moving:
        """A frame, once a slide, a hinge or a ball has moved it."""
        model, (at, of) = self._model, self._places(joint)
        kind, local = model.jnt_type[joint], _column(model.jnt_axis[joint])
        if kind == KINDS.mjJNT_BALL:
            turn = _product(now.turn, _unit(self._path(at[:4])))
            spin = _turned(turn, self._path(of[:3]))
        else:
            moved = self._path(at[:1]) - model.qpos0[model.jnt_qposadr[joint]]
            axis = _turned(now.turn, local)
            speed = axis * self._path(of[:1])
            if kind == KINDS.mjJNT_SLIDE:
                now = now.shifted(axis * moved)
                return now._replace(velocity=_sum(now.velocity, speed))
            half = moved / 2.0
            turn = _product(now.turn, np.concatenate([local * np.sin(half), np.cos(half)]))
            spin = speed
        anchor = model.jnt_pos[joint]
        return now.at(anchor)._replace(turn=turn, spin=_sum(now.spin, spin)).at(-anchor)

    def _places(self, joint: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Columns of physics from its first position and velocity on."""
        columns, model = self._columns, self._model
        at = columns.qpos_of_physics[model.jnt_qposadr[joint] :]
        return at, columns.qvel_of_physics[model.jnt_dofadr[joint] :]

    def _path(self, places: NDArray[np.intp]) -> Floats:
        """Some numbers of physics, shape (k, m, n)."""
        count, steps = self._physics.shape[:2]
        found = np.empty((places.size, count, steps + 1))
        found[..., 0] = self._memory[:, self._columns.physics[places]].T
        for part, place in zip(found, places if steps else (), strict=False):
            part[:, 1:] = self._physics[:, :, place]
        return found


def _column(values: ArrayLike) -> Floats:
    return np.asarray(values, float)[:, None, None]


def _sum(one: Floats | None, other: Floats) -> Floats:
    return other if one is None else one + other


def _unit(quaternions: Floats) -> Floats:
    """Quaternions w, x, y, z, their parts along the first axis, as unit ones x, y, z, w."""
    w, x, y, z = quaternions
    unit: Floats = np.array([x, y, z, w]) / np.sqrt(w * w + x * x + y * y + z * z)
    return unit


def _cross(one: Floats, other: Floats) -> Floats:
    """Of vectors whose parts are along the first axis."""
    (a, b, c), (d, e, f) = one, other
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d])


def _turned(turns: Floats | None, vectors: Floats) -> Floats:
    """Each vector, turned by a quaternion x, y, z, w; their parts are along the first axis."""
    if turns is None:
        return vectors
    axis, cosine = turns[:3], turns[3]
    twice = 2.0 * _cross(axis, vectors)
    turned: Floats = vectors + cosine * twice + _cross(axis, twice)
    return turned


def _product(one: Floats | None, other: Floats) -> Floats:
    """Of quaternions x, y, z, w: the turn of the other, then that of the first."""
    if one is None:
        return other
    (x, y, z, w), rest = one, other[3]
    vector = w * other[:3] + rest * one[:3] + _cross(one[:3], other[:3])
    last = w * rest - x * other[0] - y * other[1] - z * other[2]
    return np.array([*vector, last])
