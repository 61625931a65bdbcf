"""States of a scene in MuJoCo's data, and back. Bodies and joints are those of the same names."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_shape, check_type
from energymargin.base.plausibility import warn
from energymargin.mujoco.kinematics import INTEGRATION
from energymargin.mujoco.mjcf_bodies import inertia_of

PLACED = 1e-6  # [m], [rad]: what is further off is somewhere else
FIXED = (
    "and it is fixed in the scene; from_mjcf takes it where it is now, data=data, or as a base "
    "that moves, base='free'"
)
CANNOT = "whose joints do not reach it, and it is no mocap body: MuJoCo cannot place it"


class States:
    """The states of a scene in the data of one model.

    A free body of the scene has a free joint in the model, is its mocap body, stands on slides and
    a hinge or a ball if it has locked axes, turns on a ball, or hangs on what the scene does not
    have. A held joint may be a weld.
    """

    def __init__(
        self, scene: em.Scene, model: Any, *, prefix: str = "", others: ArrayLike | None = None
    ) -> None:
        """`model`: a `mujoco.MjModel`. `prefix`: of the scene's names. `others`: a state, shape
        (n,), that says where the bodies and joints are that the model does not have.

        Raises ValueError on such if there is no `others`.
        """
        self._scene, self._model = scene, model
        self.names = names = Names(scene, model, prefix)
        self._free = [(body, at, scene.slice(body.name)) for body, at in names.free]
        self._own = [(joint, at, scene.joint_slice(joint.name)) for joint, at in names.moving]
        if others is None and names.missing:
            wrong = f"the model does not have {', '.join(map(repr, names.missing))}"
            raise ValueError(f"{wrong}; others=state says where they are, as scene.pack(...) does")
        self.rest = np.zeros(scene.dimension) if others is None else np.array(others, float)
        """`others`, or zeros."""
        check_shape("others", self.rest, (scene.dimension,))
        carriers = model.body_mocapid[model.body_rootid]  # a mocap body counts as the world's
        groups = list(zip(model.body_weldid.tolist(), carriers.tolist(), strict=True))
        self.bends = [weld for weld in names.welds if groups[weld[1]] != groups[weld[2]]]
        """Those of the welds that are soft; the others are where they are in `rest`."""
        if rigid := [weld for weld in names.welds if weld not in self.bends]:
            data = mujoco.MjData(model)
            self.refresh(data)
            self._read_welds(data, rigid, self.rest)
        self._twist, self._ball = np.zeros(6), mujoco.mjtJoint.mjJNT_BALL

    def read(self, data: Any) -> Floats:
        """The state in a `mujoco.MjData`, shape (n,), whose poses and velocities follow `qpos`."""
        self.refresh(data)
        state, model = self.rest.copy(), self._model
        for _, body, at in self._free:
            row, twist = state[at], self.twist(data, body, mujoco.mjtObj.mjOBJ_XBODY)
            row[:3], row[3:7] = data.xpos[body], np.roll(data.xquat[body], -1)
            row[7:10], row[10:] = twist[3:], twist[:3]
        for joint, number, at in self._own:
            speed = 0.0 if joint.held else data.qvel[model.jnt_dofadr[number]]
            state[at] = data.qpos[model.jnt_qposadr[number]], speed
        self._read_welds(data, self.bends, state)
        return state

    def _read_welds(self, data: Any, welds: list[Any], state: Floats) -> None:
        for joint, parent, child in welds:
            state[self._scene.joint_slice(joint.name)] = _held_at(data, joint, parent, child), 0.0

    def write(self, data: Any, state: ArrayLike) -> None:
        """Puts a state, shape (n,), into a `mujoco.MjData`, and refreshes that.

        Raises ValueError on a pose that the model's joints do not reach, as of a held joint.
        """
        now, model = self._scene.unpack(state), self._model
        for joint, number in self.names.joints:
            at = now["joints"][joint.name]
            data.qpos[model.jnt_qposadr[number]] = at["position"]
            data.qvel[model.jnt_dofadr[number]] = at["velocity"]
        for body, number, _ in self._free:
            self._write_body(data, body, number, now[body.name])
        self.refresh(data)
        for body, number, _ in self._free:
            self._require(data, body.name, number, now[body.name], CANNOT)
        for joint, _, child in self.names.welds:
            self._require(data, joint.child, child, now[joint.child], CANNOT)

    def refresh(self, data: Any) -> None:
        """Poses and velocities from `qpos` and `qvel`."""
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        mujoco.mj_comVel(self._model, data)

    def twist(self, data: Any, body: int, point: Any) -> Floats:
        """Angular and linear velocity along the world's axes, shape (6,): of a body's frame
        (mjOBJ_XBODY) or centre of mass (mjOBJ_BODY)."""
        mujoco.mj_objectVelocity(self._model, data, point, body, self._twist, 0)
        return self._twist

    def body_id(self, name: str) -> int:
        """The number of a body in the model; ValueError if there is none."""
        if name not in self.names.bodies:
            raise ValueError(f"model has no body '{name}', expected all that move in the scene")
        return self.names.bodies[name]

    def require_fixed(self, data: Any) -> None:
        """ValueError unless the model has the scene's fixed bodies where the scene has them, and
        links on fixed joints where their parents have them."""
        for body, number in self.names.fixed:
            there = {"position": body.position, "orientation": body.orientation}
            self._require(data, body.name, number, there, FIXED)
        for joint, parent, child in self.names.rigid:
            self._require(data, joint.child, child, _welded_at(data, joint, parent), FIXED)

    def _write_body(self, data: Any, body: em.Body, number: int, now: dict[str, Any]) -> None:
        model = self._model
        turn, spin = Rotation.from_quat(now["orientation"]), now["angular_velocity"]
        at = [*now["position"], *np.roll(now["orientation"], 1)]
        mocap, first = int(model.body_mocapid[number]), int(model.body_jntadr[number])
        joints = range(first, first + int(model.body_jntnum[number]))
        kinds = [model.jnt_type[joint] for joint in joints]
        if mocap >= 0:
            data.mocap_pos[mocap], data.mocap_quat[mocap] = at[:3], at[3:]
        elif kinds == [mujoco.mjtJoint.mjJNT_FREE]:
            self._put(data, first, at, [*now["velocity"], *turn.inv().apply(spin)])
        elif not all([*body.linear_factor, *body.angular_factor]) or self._ball in kinds:
            self._write_chain(data, body, number, now, joints)

    def _write_chain(
        self, data: Any, body: em.Body, number: int, now: dict[str, Any], joints: range
    ) -> None:
        """Puts a body with locked axes, or on a ball, to its pose and velocity."""
        model, kinds = self._model, mujoco.mjtJoint
        turn, spin = Rotation.from_quat(now["orientation"]), now["angular_velocity"]
        for joint in joints:
            at = model.jnt_qposadr[joint]
            size = 4 if model.jnt_type[joint] == self._ball else 1
            data.qpos[at : at + size] = model.qpos0[at : at + size]
        self.refresh(data)
        parent = int(model.body_parentid[number])
        spin = spin - self.twist(data, parent, mujoco.mjtObj.mjOBJ_XBODY)[:3]
        center = np.array(inertia_of(body).center)
        base, arm = _matrix(data, number), turn.apply(center)
        way = now["position"] + arm - data.xpos[number] - base.apply(center)
        speed = now["velocity"] + np.cross(spin, arm)
        axes = data.xaxis[joints.start : joints.stop].copy()
        for joint, axis in zip(joints, axes, strict=True):
            if model.jnt_type[joint] == kinds.mjJNT_SLIDE:
                self._put(data, joint, [way @ axis], [speed @ axis])
            elif model.jnt_type[joint] == self._ball:
                quaternion = np.roll((base.inv() * turn).as_quat(), 1)
                self._put(data, joint, quaternion, turn.inv().apply(spin))
            else:
                self._put(data, joint, [(turn * base.inv()).as_rotvec() @ axis], [spin @ axis])

    def _put(self, data: Any, joint: int, position: ArrayLike, velocity: ArrayLike) -> None:
        at, of = self._model.jnt_qposadr[joint], self._model.jnt_dofadr[joint]
        data.qpos[at : at + np.size(position)] = position
        data.qvel[of : of + np.size(velocity)] = velocity

    def _require(self, data: Any, name: str, body: int, wanted: dict[str, Any], hint: str) -> None:
        off = float(np.linalg.norm(data.xpos[body] - wanted["position"]))
        turn = (_matrix(data, body).inv() * Rotation.from_quat(wanted["orientation"])).magnitude()
        if max(off, turn) > PLACED:
            away = f"{off:.3g} m and {turn:.3g} rad from there in the model"
            raise ValueError(f"body {name!r} is {away}, {hint}")


def _held_at(data: Any, joint: em.Joint, parent: int, child: int) -> float:
    """Where a joint is that the model welds."""
    of_parent, of_child = _matrix(data, parent), _matrix(data, child)
    frame, axis = of_parent * Rotation.from_quat(joint.orientation), np.array(joint.axis)
    if joint.type == "revolute":
        turned = frame.inv() * of_child * Rotation.from_quat(joint.child_orientation)
        return float(turned.as_rotvec() @ axis)
    end = data.xpos[child] + of_child.apply(np.array(joint.child_origin))
    start = data.xpos[parent] + of_parent.apply(np.array(joint.origin))
    return float((end - start) @ frame.apply(axis))


def _welded_at(data: Any, joint: em.Joint, parent: int) -> dict[str, Any]:
    """Where the scene has a body that a fixed joint holds."""
    of_parent, of_joint = _matrix(data, parent), Rotation.from_quat(joint.orientation)
    turn = of_parent * of_joint * Rotation.from_quat(joint.child_orientation).inv()
    start = data.xpos[parent] + of_parent.apply(joint.origin)
    return {"position": start - turn.apply(joint.child_origin), "orientation": turn.as_quat()}


def _matrix(data: Any, body: int) -> Rotation:
    return Rotation.from_matrix(data.xmat[body].reshape(3, 3))


class Names:
    """The bodies and joints of a scene in a model, with their numbers there."""

    def __init__(self, scene: em.Scene, model: Any, prefix: str = "") -> None:
        """`prefix`: of the scene's names, which the model's lack."""
        bodies, joints = (
            {prefix + (getattr(model, kind)(k).name or f"{kind}{k}"): k for k in range(count)}
            for kind, count in (("body", model.nbody), ("joint", model.njnt))
        )
        self.prefix = prefix
        """Of the scene's names."""
        self.tendons = scene.tendons
        """All of the scene, whether the model has them or not."""
        links = {joint.child for joint in scene.joints}
        ends = [body for body in scene.bodies if body.name not in links]
        there = [(body, bodies[body.name]) for body in ends if body.name in bodies]
        jointed = [j for j in scene.joints if {j.parent, j.child} <= bodies.keys()]
        between = [(j, bodies[j.parent], bodies[j.child]) for j in jointed]
        moving = [joint for joint in scene.joints if joint.type != "fixed"]
        self.bodies = bodies
        """All that the model has, by name."""
        self.fixed = [(body, number) for body, number in there if body.fixed and number]
        """Fixed bodies that no joint carries; the world is where it is."""
        self.free = [(body, number) for body, number in there if not body.fixed]
        """Free bodies that no joint carries."""
        self.joints = [(joint, joints[joint.name]) for joint in moving if joint.name in joints]
        """Joints that move, also those that follow others."""
        self.moving = [(joint, number) for joint, number in self.joints if joint.mimic is None]
        """Those of them with numbers in a state."""
        self.rigid = [found for found in between if found[0].type == "fixed"]
        """Fixed joints of whose parent and child the model has both, with their numbers."""
        held = {joint.name for joint in moving if joint.held and not joint.mimic} - joints.keys()
        self.welds = [found for found in between if found[0].name in held]
        """Held joints that the model does not have though it has both bodies: it welds them."""
        known = {body.name for body, _ in self.free} | {joint.name for joint, _ in self.moving}
        known |= {joint.name for joint, _, _ in self.welds}
        in_states = [body.name for body in ends if not body.fixed]
        in_states += [joint.name for joint in moving if joint.mimic is None]
        self.missing = [name for name in in_states if name not in known]
        """Free bodies and joints of the scene's states that the model does not have."""


def require_data(model: Any, data: Any) -> None:
    """ValueError unless these are a `mujoco.MjModel` and its `mujoco.MjData`: MuJoCo itself would
    write beyond the arrays of another one's."""
    check_type("model", model, mujoco.MjModel, "a mujoco.MjModel")
    check_type("data", data, mujoco.MjData, "a mujoco.MjData")
    sizes = {"nq": data.qpos.size, "nv": data.qvel.size, "nbody": len(data.xpos)}
    for name, size in sizes.items():
        if size != (wanted := int(getattr(model, name))):
            expected = f"expected that of the model, which has {wanted}: mujoco.MjData(model)"
            raise ValueError(f"data is of a model with {name} = {size}, {expected}")


def state(
    scene: em.Scene, model: Any, data: Any, *, prefix: str = "", others: ArrayLike | None = None
) -> Floats:
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

    Raises ValueError on bodies and joints that the model does not have, and on a body that is fixed
    in the scene and elsewhere in the model. ImportError without MuJoCo.
    """
    require_data(model, data)
    states = States(scene, model, prefix=prefix, others=others)
    own = copy(data)
    states.refresh(own)
    states.require_fixed(own)
    return states.read(own)


def set_state(
    model: Any, data: Any, scene: em.Scene, state: ArrayLike, *, prefix: str = ""
) -> None:
    """Puts a state, shape (n,), into a `mujoco.MjData`, and brings that forward (mj_forward).

    Controls become those that ask for the targets of the scene's joints, so that what the scene
    grips stays gripped; a control beyond its range is a PlausibilityWarning, since MuJoCo clips it.
    What the model has and the scene does not stays; so does what the model does not have. A free
    body of the scene has a free joint in the model, is its mocap body, or hangs on what stays and
    is there already. One with locked axes may stand on slides and a hinge or a ball.

    Raises ValueError on a body that MuJoCo cannot place, and then changes nothing. ImportError
    without MuJoCo.
    """
    require_data(model, data)
    own = copy(data)
    States(scene, model, prefix=prefix, others=scene.pack()).write(own, state)
    for servo in servos(Names(scene, model, prefix), model).values():
        servo.write(own)
    whole = np.empty(mujoco.mj_stateSize(model, INTEGRATION))
    mujoco.mj_getState(model, own, whole, INTEGRATION)
    mujoco.mj_setState(model, data, whole, INTEGRATION)
    mujoco.mj_forward(model, data)


def targets(scene: em.Scene, model: Any, data: Any, *, prefix: str = "") -> dict[str, float]:
    """By joint or tendon under position control, the target [rad or m] that the control asks for.

    For `Plan(targets=...)`, or a scene whose joints were made at another control. It is that of
    `em.scenes.from_mjcf` for joints that one actuator drives, also by a tendon or beside a spring.
    Raises ImportError without MuJoCo.
    """
    found = servos(Names(scene, model, prefix), model).items()
    return {name: servo.target(data) for name, servo in found if servo.actuator.stiffness > 0}


@dataclass(frozen=True)
class Servo:
    """A joint or a tendon of the scene, and what drives it in the model."""

    joint: em.Joint | em.Tendon
    actuator: em.scenes.Actuator

    def control(self, target: float) -> float:
        """That asks for a target [rad or m]; under velocity control for the joint's velocity."""
        force = self.actuator.stiffness * target + self._damping
        return (force - self.actuator.rest) / self.actuator.slope

    def target(self, data: Any) -> float:
        """That the control in a `mujoco.MjData` asks for [rad or m], under position control."""
        of = self.actuator
        control = float(np.clip(data.ctrl[of.address], of.low, of.high))
        return (of.rest + of.slope * control - self._damping) / of.stiffness

    def write(self, data: Any) -> None:
        """Sets the control in a `mujoco.MjData` to that of the scene's target."""
        control, of = self.control(self.joint.target), self.actuator
        if not of.low <= control <= of.high:
            about = f"joint {self.joint.name!r}: control"
            clipped = f"MuJoCo clips it to [{of.low:.6g}, {of.high:.6g}]."
            text = f"{about} {control:.6g} would ask for its target, and {clipped}"
            warn([(about, text)], repr((control, (of.low, of.high))))
        data.ctrl[of.address] = control
        if of.activation >= 0:
            data.act[of.activation] = control

    @property
    def _damping(self) -> float:
        """Force that the damping adds at the joint's target velocity."""
        return self.actuator.damping * self.joint.target_velocity


def servos(names: Names, model: Any) -> dict[str, Servo]:
    """By joint or tendon that is driven in the scene as in the model, by one actuator there."""
    alone = em.scenes.actuators(model).items()
    driven = {names.prefix + name: actuator for name, actuator in alone}
    moving: list[em.Joint | em.Tendon] = [joint for joint, _ in names.moving if not joint.held]
    return {
        of.name: Servo(of, driven[of.name])
        for of in [*moving, *names.tendons]
        if of.name in driven and (driven[of.name].stiffness > 0) == (of.stiffness > 0)
    }
