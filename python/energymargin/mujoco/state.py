"""The state of a scene in the data of the MuJoCo model that it comes from, and back."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin._core import Body, Joint, Scene
from energymargin.mujoco.needed import needed

__all__ = ["set_state", "state", "targets"]

Vector = NDArray[np.float64]
PLACED = 1e-6  # m, rad; what is further off is somewhere else


def state(
    scene: Scene, model: Any, data: Any, *, prefix: str = "", others: ArrayLike | None = None
) -> Vector:
    """The state of a scene in a `mujoco.MjData`, shape (n,), for `problem.with_state`.

    Free bodies and joints are those of the model with the same names, behind `prefix`, as
    `em.scenes.from_mjcf` makes them. Poses and velocities are those of `qpos` and `qvel`, also
    where `data` was not brought forward since; `data` stays as it is. A free body's velocity is
    that of its frame, as everywhere in a scene; a held joint has none.

    Args:
        scene: whose state it is.
        model: the `mujoco.MjModel`.
        data: its `mujoco.MjData`.
        prefix: of the scene's names.
        others: a state of the scene, shape (n,), that says where the bodies and joints are that the
            model does not have. None refuses them.

    Raises ValueError on bodies and joints that the model does not have, and on a fixed body that
    is elsewhere in the model: then the scene's base has to be free. ImportError without MuJoCo.
    """
    mujoco, names = needed(), _Names(scene, model, prefix)
    own = mujoco.MjData(model)
    for name in ("qpos", "qvel", "mocap_pos", "mocap_quat"):
        getattr(own, name)[:] = getattr(data, name)
    for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
        step(model, own)
    for body, number in names.fixed():
        _require_place(own, body, number)
    result = _rest(scene, names, others)
    twist = np.zeros(6)
    for body, number in names.free():
        mujoco.mj_objectVelocity(model, own, mujoco.mjtObj.mjOBJ_XBODY, number, twist, 0)
        turn = np.roll(own.xquat[number], -1)
        row = [*own.xpos[number], *turn / np.linalg.norm(turn), *twist[3:], *twist[:3]]
        result[scene.slice(body.name)] = row
    for joint, number in names.moving():
        speed = 0.0 if joint.held else own.qvel[model.jnt_dofadr[number]]
        result[scene.joint_slice(joint.name)] = own.qpos[model.jnt_qposadr[number]], speed
    return result


def set_state(model: Any, data: Any, scene: Scene, state: ArrayLike, *, prefix: str = "") -> None:
    """Puts a state, shape (n,), into a `mujoco.MjData`, and brings that forward (mj_forward).

    What the model has and the scene does not stays; so does what the model does not have. A free
    body of the scene has a free joint in the model, is its mocap body, or hangs on what stays and
    is there already.

    Raises ValueError on a body that MuJoCo cannot place, and then changes nothing. ImportError
    without MuJoCo.
    """
    mujoco, names = needed(), _Names(scene, model, prefix)
    now = scene.unpack(state)
    own = mujoco.MjData(model)
    for name in ("qpos", "qvel", "mocap_pos", "mocap_quat"):
        getattr(own, name)[:] = getattr(data, name)
    for joint, number in names.joints():
        at = now["joints"][joint.name]
        own.qpos[model.jnt_qposadr[number]] = at["position"]
        own.qvel[model.jnt_dofadr[number]] = at["velocity"]
    hanging = [
        (body, number)
        for body, number in names.free()
        if not _put(model, own, number, now[body.name])
    ]
    mujoco.mj_kinematics(model, own)
    for body, number in hanging:
        _require_place(own, body, number, now[body.name])
    for name in ("qpos", "qvel", "mocap_pos", "mocap_quat"):
        getattr(data, name)[:] = getattr(own, name)
    mujoco.mj_forward(model, data)


def targets(scene: Scene, model: Any, data: Any, *, prefix: str = "") -> dict[str, float]:
    """By joint under position control, the target [rad or m] that MuJoCo's control asks for.

    For `Plan(targets=...)`, or a scene whose joints were made at another control: those with one
    position actuator on the joint itself. Raises ImportError without MuJoCo.
    """
    names = _Names(scene, model, prefix)
    found = {number: joint.name for joint, number in names.moving() if joint.stiffness > 0}
    result = {}
    for actuator in range(model.nu):
        joint = found.get(int(model.actuator_trnid[actuator][0]))
        on_joint = int(model.actuator_trntype[actuator]) == int(needed().mjtTrn.mjTRN_JOINT)
        stiffness = -float(model.actuator_biasprm[actuator][1])
        if joint is None or not on_joint or stiffness <= 0:
            continue
        control = float(data.ctrl[_control(model, actuator)])
        if model.actuator_ctrllimited[actuator]:
            control = float(np.clip(control, *model.actuator_ctrlrange[actuator]))
        force = model.actuator_gainprm[actuator][0] * control + model.actuator_biasprm[actuator][0]
        result[joint] = float(force / stiffness / model.actuator_gear[actuator][0])
    return result


def _control(model: Any, actuator: int) -> int:
    addresses = getattr(model, "actuator_ctrladr", None)  # of MuJoCo 4
    return actuator if addresses is None else int(addresses[actuator])


class _Names:
    """The bodies and joints of a scene in a model."""

    def __init__(self, scene: Scene, model: Any, prefix: str) -> None:
        self._scene, self._model, self._prefix = scene, model, prefix
        self._links = {joint.child for joint in scene.joints}

    def _number(self, kind: str, name: str) -> int | None:
        """Of a body or a joint by its name, or by its number where the model has no name."""
        if not name.startswith(self._prefix):
            return None
        own, mujoco = name.removeprefix(self._prefix), needed()
        of = {"body": mujoco.mjtObj.mjOBJ_BODY, "joint": mujoco.mjtObj.mjOBJ_JOINT}[kind]
        number = int(mujoco.mj_name2id(self._model, of, own))
        if number >= 0:
            return number
        index = own.removeprefix(kind)
        count = {"body": self._model.nbody, "joint": self._model.njnt}[kind]
        if own.startswith(kind) and index.isdecimal() and int(index) < count:
            nameless = not mujoco.mj_id2name(self._model, of, int(index))
            return int(index) if nameless else None
        return None

    def _bodies(self, *, fixed: bool) -> Iterator[tuple[Body, int]]:
        for body in self._scene.bodies:
            if body.fixed != fixed or body.name in self._links:
                continue
            number = self._number("body", body.name)
            if number is not None:
                yield body, number

    def fixed(self) -> Iterator[tuple[Body, int]]:
        """Fixed bodies that the model has; the world is where it is."""
        return ((body, number) for body, number in self._bodies(fixed=True) if number)

    def free(self) -> Iterator[tuple[Body, int]]:
        """Free bodies that the model has."""
        return self._bodies(fixed=False)

    def joints(self) -> Iterator[tuple[Joint, int]]:
        """Joints that the model has, also those that follow others."""
        for joint in self._scene.joints:
            number = None if joint.type == "fixed" else self._number("joint", joint.name)
            if number is not None:
                yield joint, number

    def moving(self) -> Iterator[tuple[Joint, int]]:
        """Those of them with numbers in a state."""
        return ((joint, number) for joint, number in self.joints() if joint.mimic is None)

    def missing(self) -> list[str]:
        """Free bodies and joints of the scene's states that the model does not have."""
        there = {body.name for body, _ in self.free()}
        there |= {joint.name for joint, _ in self.moving()}
        bodies = [b.name for b in self._scene.bodies if not b.fixed and b.name not in self._links]
        joints = [j.name for j in self._scene.joints if j.type != "fixed" and j.mimic is None]
        return [name for name in bodies + joints if name not in there]


def _rest(scene: Scene, names: _Names, others: ArrayLike | None) -> Vector:
    """The numbers of what the model does not have."""
    if others is None:
        missing = names.missing()
        if missing:
            raise ValueError(
                f"the model does not have {', '.join(map(repr, missing))}; others=state says where "
                "they are, as scene.pack(...) does"
            )
        return np.zeros(scene.dimension)
    given = np.array(others, float)
    if given.shape != (scene.dimension,):
        raise ValueError(f"others has the shape {given.shape}, expected ({scene.dimension},)")
    return given


def _require_place(
    data: Any, body: Body, number: int, wanted: dict[str, Any] | None = None
) -> None:
    """ValueError unless a body is in the model where the scene, or `wanted`, has it."""
    there = wanted or {"position": body.position, "orientation": body.orientation}
    off = float(np.linalg.norm(data.xpos[number] - there["position"]))
    of_model = Rotation.from_quat(np.roll(data.xquat[number], -1))
    turn = float((Rotation.from_quat(there["orientation"]).inv() * of_model).magnitude())
    if max(off, turn) > PLACED:
        if wanted is None:
            hint = "fixed in the scene; base='free' makes a base that moves"
        else:
            hint = "of no free joint, and no mocap body: MuJoCo cannot place it"
        raise ValueError(
            f"body {body.name!r} is {off:.3g} m and {turn:.3g} rad from there in the model, and "
            f"it is {hint}"
        )


def _put(model: Any, data: Any, body: int, now: dict[str, Any]) -> bool:
    """Places a body with a free joint, or a mocap body; whether it is one."""
    turn = np.roll(now["orientation"], 1)
    mocap, joint = int(model.body_mocapid[body]), int(model.body_jntadr[body])
    free = int(needed().mjtJoint.mjJNT_FREE)
    if mocap >= 0:
        data.mocap_pos[mocap], data.mocap_quat[mocap] = now["position"], turn
        return True
    if joint < 0 or int(model.jnt_type[joint]) != free:
        return False
    at, of = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    data.qpos[at : at + 7] = [*now["position"], *turn]
    spin = Rotation.from_quat(now["orientation"]).inv().apply(now["angular_velocity"])
    data.qvel[of : of + 6] = [*now["velocity"], *spin]
    return True
