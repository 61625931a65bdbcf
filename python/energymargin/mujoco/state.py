"""The state of a scene in the data of the MuJoCo model that it comes from, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Scene
from energymargin.mujoco.names import Names
from energymargin.mujoco.needed import needed
from energymargin.mujoco.servos import servos
from energymargin.mujoco.states import States
from energymargin.scenes.mjcf_model import start_of

__all__ = ["set_state", "state", "targets"]

Vector = NDArray[np.float64]
PLACES = ("qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat")


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
    in the scene and elsewhere in the model, with what moves it there: the base, a ball joint or a
    mocap body. ImportError without MuJoCo.
    """
    states = States(scene, model, prefix=prefix, others=others)
    own = _copy(model, data)
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
    own = _copy(model, data)
    States(scene, model, prefix=prefix, others=scene.pack()).write(own, state)
    for servo in servos(Names(scene, model, prefix), model).values():
        servo.write(own)
    _move(own, data)
    needed().mj_forward(model, data)


def targets(scene: Scene, model: Any, data: Any, *, prefix: str = "") -> dict[str, float]:
    """By joint under position control, the target [rad or m] that MuJoCo's control asks for.

    For `Plan(targets=...)`, or a scene whose joints were made at another control. It is that of
    `em.scenes.from_mjcf` for joints that one actuator drives, also by a tendon or beside a spring.
    Raises ImportError without MuJoCo.
    """
    found = servos(Names(scene, model, prefix), model)
    control = start_of(model, data, None).control
    return {
        name: servo.target(float(control[servo.address]))
        for name, servo in found.items()
        if servo.stiffness > 0
    }


def _copy(model: Any, data: Any) -> Any:
    """Data of one's own, at the same place."""
    own = needed().MjData(model)
    _move(data, own)
    return own


def _move(one: Any, other: Any) -> None:
    for name in PLACES:
        getattr(other, name)[:] = getattr(one, name)
