"""The state of a scene in the data of the MuJoCo model that it comes from, and back."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Joint, Scene, Tendon
from energymargin.mujoco.states import Names, States
from energymargin.plausibility import warn
from energymargin.scenes.mjcf_couplings import couplings
from energymargin.scenes.mjcf_drives import Drive, drives
from energymargin.scenes.mjcf_model import (
    Features,
    Selection,
    control_address,
    disabled,
    engine,
    start_of,
    word,
)

Vector = NDArray[np.float64]


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

    Raises ValueError on bodies and joints that the model does not have, and on a body that is fixed
    in the scene and elsewhere in the model. ImportError without MuJoCo.
    """
    states = States(scene, model, prefix=prefix, others=others)
    own = copy(data)
    states.refresh(own)
    states.require_fixed(own)
    return states.read(own)


def set_state(model: Any, data: Any, scene: Scene, state: ArrayLike, *, prefix: str = "") -> None:
    """Puts a state, shape (n,), into a `mujoco.MjData`, and brings that forward (mj_forward).

    Controls become those that ask for the targets of the scene's joints, so that what the scene
    grips stays gripped; a control beyond its range is a PlausibilityWarning, since MuJoCo clips it.
    What the model has and the scene does not stays; so does what the model does not have. A free
    body of the scene has a free joint in the model, is its mocap body, or hangs on what stays and
    is there already. One with locked axes may stand on slides and a hinge or a ball.

    Raises ValueError on a body that MuJoCo cannot place, and then changes nothing. ImportError
    without MuJoCo.
    """
    own = copy(data)
    States(scene, model, prefix=prefix, others=scene.pack()).write(own, state)
    for servo in servos(Names(scene, model, prefix), model).values():
        servo.write(own)
    engine().mj_copyData(data, model, own)
    engine().mj_forward(model, data)


def targets(scene: Scene, model: Any, data: Any, *, prefix: str = "") -> dict[str, float]:
    """By joint or tendon under position control, the target [rad or m] that the control asks for.

    For `Plan(targets=...)`, or a scene whose joints were made at another control. It is that of
    `em.scenes.from_mjcf` for joints that one actuator drives, also by a tendon or beside a spring.
    Raises ImportError without MuJoCo.
    """
    found = servos(Names(scene, model, prefix), model)
    control = start_of(model, data, None).control
    return {
        name: servo.target(float(control[servo.address]))
        for name, servo in found.items()
        if servo.drive.stiffness > 0
    }


FILTERS = ("filter", "filterexact")  # activations that follow the control


@dataclass(frozen=True)
class Servo:
    """The one actuator that drives a joint or a tendon by position or velocity control."""

    joint: Joint | Tendon
    """The scene's."""
    address: int
    """Place of its control in `ctrl`."""
    slope: float
    rest: float
    drive: Drive
    activation: int
    """Place of a filter's state in `act`; -1 without one."""
    low: float
    high: float
    """To which MuJoCo clips the control."""

    def control(self, target: float) -> float:
        """That asks for a target [rad or m]; under velocity control for the joint's velocity."""
        force = self.drive.stiffness * target + self.drive.damping * self.joint.target_velocity
        return (force - self.rest) / self.slope

    def target(self, control: float) -> float:
        """That a control asks for [rad or m], under position control."""
        force = self.rest + self.slope * control - self.drive.damping * self.joint.target_velocity
        return force / self.drive.stiffness

    def write(self, data: Any) -> None:
        """Sets the control in a `mujoco.MjData` to that of the scene's target."""
        control = self.control(self.joint.target)
        if not self.low <= control <= self.high:
            about = f"joint {self.joint.name!r}: control"
            text = f"{about} {control:.6g} would ask for its target, and MuJoCo clips it to "
            text += f"[{self.low:.6g}, {self.high:.6g}]."
            warn([(about, text)], repr((control, (self.low, self.high))))
        data.ctrl[self.address] = control
        if self.activation >= 0:
            data.act[self.activation] = control


def servos(names: Names, model: Any) -> dict[str, Servo]:
    """By joint or tendon that is driven in the scene as in the model, by one actuator there."""
    features = Features(())
    selection = Selection(model, None, "fixed", start_of(model, None, None), features)
    found, tendons = drives(selection, couplings(selection, features), (), features)
    driven = {names.prefix + tendon.name: tendon.drive for tendon in tendons}
    pairs: list[tuple[Joint | Tendon, Drive]] = [
        (joint, found[number])
        for joint, number in names.moving
        if number in found and not joint.held
    ]
    pairs += [(of, driven[of.name]) for of in names.tendons if of.name in driven]
    clamps, result = not disabled(model, "CLAMPCTRL"), {}
    for joint, drive in pairs:
        alike = (drive.stiffness > 0) == (joint.stiffness > 0)
        if len(drive.controls) != 1 or not alike:
            continue
        ((actuator, slope),) = drive.controls.items()
        address = control_address(model, actuator)
        rest = drive.force - slope * float(selection.start.control[address])
        filtered = word("mjtDyn", model.actuator_dyntype[actuator]) in FILTERS
        activation = int(model.actuator_actadr[actuator]) if filtered else -1
        limited = clamps and model.actuator_ctrllimited[actuator]
        limits = map(
            float, model.actuator_ctrlrange[actuator] if limited else (-math.inf, math.inf)
        )
        result[joint.name] = Servo(joint, address, slope, rest, drive, activation, *limits)
    return result
