"""Poses and velocities of bodies of a MuJoCo model, for many of its coordinates at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.aliases import Floats

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION.value

FREE, BALL, SLIDE = (
    int(getattr(mujoco.mjtJoint, kind)) for kind in ("mjJNT_FREE", "mjJNT_BALL", "mjJNT_SLIDE")
)


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


class Joint(NamedTuple):
    """What moves a body."""

    kind: int
    """mjtJoint."""
    axis: Floats
    """In the body's axes before it, shape (3, 1, 1)."""
    anchor: Floats
    """In the body's axes, shape (3,) [m]."""
    start: float
    """Its position where the model's tree is as written."""
    q: int
    """Column of physics of its first position."""
    v: int
    """And of its first velocity."""


class Link(NamedTuple):
    """A body in the tree."""

    parent: int
    place: Floats
    """In the parent's axes, shape (3,) [m]."""
    turn: Floats | None
    """Its quaternion there; None: none."""
    joints: tuple[Joint, ...]
    mocap: tuple[NDArray[np.intp], NDArray[np.intp]] | None
    """Columns of the position and the quaternion of a mocap body."""


def links_of(model: Any, columns: Columns) -> list[Link]:
    """All bodies of a model."""
    return [_link(model, columns, body) for body in range(model.nbody)]


def _link(model: Any, columns: Columns, body: int) -> Link:
    first, mocap = int(model.body_jntadr[body]), int(model.body_mocapid[body])
    joints = [
        Joint(
            int(model.jnt_type[j]),
            _column(model.jnt_axis[j]),
            model.jnt_pos[j].copy(),
            float(model.qpos0[model.jnt_qposadr[j]]),
            int(columns.qpos_of_physics[model.jnt_qposadr[j]]),
            int(columns.qvel_of_physics[model.jnt_dofadr[j]]),
        )
        for j in range(first, first + int(model.body_jntnum[body]))
    ]
    quaternion = model.body_quat[body]
    turn = _unit(_column(quaternion)) if quaternion[1:].any() else None
    own = None if mocap < 0 else (columns.mocap[0][mocap], columns.mocap[1][mocap])
    parent, place = int(model.body_parentid[body]), model.body_pos[body].copy()
    return Link(parent, place, turn, tuple(joints), own)


class Kinematics:
    """What mj_kinematics and mj_comVel find, over m paths of n instants each."""

    def __init__(
        self, links: Sequence[Link], columns: Columns, memory: Floats, physics: Floats
    ) -> None:
        """Paths begin with whole states, memory (m, h), and go on with physics (m, n - 1, p)."""
        self._links, self._columns = links, columns
        self._memory, self._physics = memory, physics
        self._found = {0: Moving(np.zeros((3, 1, 1)), None)}

    def moving(self, body: int) -> Moving:
        """The frame of a body."""
        if body not in self._found:
            self._found[body] = self._moving(self._links[body])
        return self._found[body]

    def _moving(self, link: Link) -> Moving:
        if link.mocap is not None:
            start = self._memory.T[..., None]
            return Moving(start[link.mocap[0]], _unit(start[link.mocap[1]]))
        if link.joints and link.joints[0].kind == FREE:
            return self._free(link.joints[0])
        now = self.moving(link.parent).at(link.place)
        if link.turn is not None:
            now = now._replace(turn=_product(now.turn, link.turn))
        for joint in link.joints:
            now = self._after(joint, now)
        return now

    def _free(self, joint: Joint) -> Moving:
        q, v = self._path(joint.q, 7), self._path(joint.v, 6)
        turn = _unit(q[3:])
        return Moving(q[:3], turn, v[:3], _turned(turn, v[3:]))

    def _after(self, joint: Joint, now: Moving) -> Moving:
        """A frame, once a slide, a hinge or a ball has moved it."""
        if joint.kind == BALL:
            turn = _product(now.turn, _unit(self._path(joint.q, 4)))
            spin = _turned(turn, self._path(joint.v, 3))
        else:
            moved, axis = self._path(joint.q, 1) - joint.start, _turned(now.turn, joint.axis)
            speed = axis * self._path(joint.v, 1)
            if joint.kind == SLIDE:
                now = now.shifted(axis * moved)
                return now._replace(velocity=_sum(now.velocity, speed))
            half, spin = moved / 2.0, speed
            turn = _product(now.turn, np.concatenate([joint.axis * np.sin(half), np.cos(half)]))
        now = now.at(joint.anchor)._replace(turn=turn, spin=_sum(now.spin, spin))
        return now.at(-joint.anchor)

    def _path(self, first: int, count: int) -> Floats:
        """Some columns of physics that follow each other, shape (count, m, n)."""
        some = slice(first, first + count)
        rows, steps, _ = self._physics.shape
        found = np.empty((count, rows, steps + 1))
        found[..., 0] = self._memory[:, self._columns.physics[some]].T
        found[..., 1:] = self._physics[:, :, some].transpose(2, 0, 1)
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
