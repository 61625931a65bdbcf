"""States of a scene in MuJoCo's data, and back. Bodies and joints are those of the same names."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Body, Joint, Scene
from energymargin.mujoco.mjcf_bodies import inertia_of, motion_of
from energymargin.mujoco.needed import needed

__all__ = ["States"]

Vector = NDArray[np.float64]

PLACED = 1e-6  # [m], [rad]: what is further off was not placed


class States:
    """The states of a scene in the data of one model.

    Raises ValueError on a scene with a body that the model does not have.
    """

    def __init__(self, scene: Scene, model: Any) -> None:
        """`model`: a `mujoco.MjModel` with the scene's bodies, and its joints that are not held."""
        self._mujoco, self._scene, self._model = needed(), scene, model
        self._usual = np.array(scene.pack())
        links = {joint.child for joint in scene.joints}
        self._free = [
            (body, self.body_id(body.name), scene.slice(body.name))
            for body in scene.bodies
            if not body.fixed and body.name not in links
        ]
        self._joints = [joint for joint in scene.joints if joint.type != "fixed"]
        self._own = [joint for joint in self._joints if joint.mimic is None]
        self._twist = np.zeros(6)

    def read(self, data: Any) -> Vector:
        """The state in a `mujoco.MjData`, shape (n,), whose poses and velocities follow `qpos`."""
        self.refresh(data)
        state = self._usual.copy()
        for _, body, at in self._free:
            row, twist = state[at], self.twist(data, body, self._mujoco.mjtObj.mjOBJ_XBODY)
            row[:3], row[3:7] = data.xpos[body], np.roll(data.xquat[body], -1)
            row[7:10], row[10:] = twist[3:], twist[:3]
        for joint in self._own:
            state[self._scene.joint_slice(joint.name)] = self._motion(data, joint)
        return state

    def write(self, data: Any, state: ArrayLike) -> None:
        """Puts a state, shape (n,), into a `mujoco.MjData`.

        Raises ValueError on a pose that the model's joints do not reach, as of a held joint.
        """
        now = self._scene.unpack(state)
        for body, number, _ in self._free:
            self._write_body(data, body, number, now[body.name])
        for joint in self._joints:
            if self._has(joint):
                of = self._model.joint(joint.name)
                position, velocity = motion_of(joint, now["joints"])
                data.qpos[of.qposadr[0]], data.qvel[of.dofadr[0]] = position, velocity
        self.refresh(data)
        for name, wanted in now.items():
            if name != "joints":
                self._check(data, name, wanted)

    def refresh(self, data: Any) -> None:
        """Poses and velocities from `qpos` and `qvel`."""
        self._mujoco.mj_kinematics(self._model, data)
        self._mujoco.mj_comPos(self._model, data)
        self._mujoco.mj_comVel(self._model, data)

    def twist(self, data: Any, body: int, point: Any) -> Vector:
        """Angular and linear velocity along the world's axes, shape (6,): of a body's frame
        (mjOBJ_XBODY) or centre of mass (mjOBJ_BODY)."""
        self._mujoco.mj_objectVelocity(self._model, data, point, body, self._twist, 0)
        return self._twist

    def body_id(self, name: str) -> int:
        """The number of a body in the model; ValueError if there is none."""
        number = self._mujoco.mj_name2id(self._model, self._mujoco.mjtObj.mjOBJ_BODY, name)
        if number < 0:
            raise ValueError(f"model has no body '{name}', expected all that move in the scene")
        return int(number)

    def _has(self, joint: Joint) -> bool:
        of_joints = self._mujoco.mjtObj.mjOBJ_JOINT
        return bool(self._mujoco.mj_name2id(self._model, of_joints, joint.name) >= 0)

    def _motion(self, data: Any, joint: Joint) -> tuple[float, float]:
        """Position and velocity; of a joint that the model welds, where it is."""
        if self._has(joint):
            of = self._model.joint(joint.name)
            return data.qpos[of.qposadr[0]], data.qvel[of.dofadr[0]]
        parent, child = self.body_id(joint.parent), self.body_id(joint.child)
        of_parent, of_child = _matrix(data, parent), _matrix(data, child)
        frame, axis = of_parent * _turn(joint.orientation), np.array(joint.axis)
        if joint.type == "revolute":
            turned = frame.inv() * of_child * _turn(joint.child_orientation)
            return float(turned.as_rotvec() @ axis), 0.0
        end = data.xpos[child] + of_child.apply(np.array(joint.child_origin))
        start = data.xpos[parent] + of_parent.apply(np.array(joint.origin))
        return float((end - start) @ frame.apply(axis)), 0.0

    def _write_body(self, data: Any, body: Body, number: int, now: dict[str, Any]) -> None:
        model, kinds = self._model, self._mujoco.mjtJoint
        first = int(model.body_jntadr[number])
        joints = range(first, first + int(model.body_jntnum[number]))
        turn, spin = _turn(now["orientation"]), now["angular_velocity"]
        if [model.jnt_type[j] for j in joints] == [kinds.mjJNT_FREE]:
            place = [*now["position"], *np.roll(now["orientation"], 1)]
            self._put(data, first, place, [*now["velocity"], *turn.inv().apply(spin)])
            return
        for joint in joints:
            at = model.jnt_qposadr[joint]
            size = 4 if model.jnt_type[joint] == kinds.mjJNT_BALL else 1
            data.qpos[at : at + size] = model.qpos0[at : at + size]
        self.refresh(data)
        center = np.array(inertia_of(body).center)
        base, arm = _matrix(data, number), turn.apply(center)
        way = now["position"] + arm - data.xpos[number] - base.apply(center)
        speed = now["velocity"] + np.cross(spin, arm)
        axes = data.xaxis[first : first + len(joints)].copy()
        for joint, axis in zip(joints, axes, strict=True):
            if model.jnt_type[joint] == kinds.mjJNT_SLIDE:
                self._put(data, joint, [way @ axis], [speed @ axis])
            elif model.jnt_type[joint] == kinds.mjJNT_BALL:
                quaternion = np.roll((base.inv() * turn).as_quat(), 1)
                self._put(data, joint, quaternion, turn.inv().apply(spin))
            else:
                self._put(data, joint, [(turn * base.inv()).as_rotvec() @ axis], [spin @ axis])

    def _put(self, data: Any, joint: int, position: ArrayLike, velocity: ArrayLike) -> None:
        place, speed = np.asarray(position), np.asarray(velocity)
        at, of = self._model.jnt_qposadr[joint], self._model.jnt_dofadr[joint]
        data.qpos[at : at + len(place)] = place
        data.qvel[of : of + len(speed)] = speed

    def _check(self, data: Any, name: str, wanted: dict[str, Any]) -> None:
        number = self.body_id(name)
        off = float(np.linalg.norm(data.xpos[number] - wanted["position"]))
        turn = (_matrix(data, number).inv() * _turn(wanted["orientation"])).magnitude()
        if max(off, turn) > PLACED:
            raise ValueError(
                f"state has '{name}' at {wanted['position']}, which the model's joints miss by "
                f"{off:.3g} m and {turn:.3g} rad, expected a pose that they reach"
            )


def _turn(orientation: Any) -> Rotation:
    return Rotation.from_quat(np.array(orientation))


def _matrix(data: Any, body: int) -> Rotation:
    return Rotation.from_matrix(data.xmat[body].reshape(3, 3))
