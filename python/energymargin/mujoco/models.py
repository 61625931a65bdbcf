"""A MuJoCo model: the scene that stands for it, and what can be another in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import partial
from typing import Any

import mujoco
import numpy as np

import energymargin as em
from energymargin.base.plausibility import kept_warnings

FRAME = 1e-3  # kg, of a body without mass
SMALLEST = 1e-3  # m, half an edge of a body without geoms


def scene_of(
    model: Any, data: Any, *, objects: Sequence[str], effector: Sequence[str], step: float
) -> em.Scene:
    """That of from_mjcf, with a step [s]; of a model that it refuses, the named bodies alone, each
    a box about its geoms.

    Raises ValueError on names that the model does not have.
    """
    made: dict[str, Any] = {"gravity": model.opt.gravity, "step": step, "friction_rule": "max"}
    try:
        scene = em.Scene(**made)
        with kept_warnings():  # of what the scene leaves out: MuJoCo moves it all the same
            em.scenes.from_mjcf(model, scene, object=objects, effector=effector, data=data)
    except ValueError:
        scene = em.Scene(**made)
        for role, names in (("object", objects), ("effector", effector)):
            for name in names:
                _add_box(scene, model, data, name, role)
    return scene


def _add_box(scene: em.Scene, model: Any, data: Any, name: str, role: str) -> None:
    known = [model.body(i).name for i in range(model.nbody)]
    if name not in known:
        argument = {"object": "objects"}.get(role, role)
        raise ValueError(f"{argument} is {name!r}, expected one of {', '.join(known[1:])}")
    number = known.index(name)
    geoms = geoms_of(model, number)
    reaches = np.abs(model.geom_pos[geoms]).max(axis=1) + model.geom_rbound[geoms]
    reach = float(reaches.max(initial=0.0))
    mass, inertial = float(model.body_mass[number]), None
    if mass > 0.0 and model.body_inertia[number].all():
        center, axes = model.body_ipos[number], np.roll(model.body_iquat[number], -1)
        inertial = em.Inertial(center, inertia=model.body_inertia[number], axes=axes)
    add = partial(scene.add_body, mass=mass or FRAME, inertial=inertial, role=role)
    turn, box = np.roll(data.xquat[number], -1), em.Box([2 * max(reach, SMALLEST)] * 3)
    add(name, box, position=data.xpos[number], orientation=turn)


def values_of(model: Any) -> dict[str, float]:
    """By name: "friction.BODY", the largest sliding one of its geoms; "mass.BODY" [kg];
    "gain.ACTUATOR", the first number of its gain."""
    found: dict[str, float] = {}
    for number in range(model.nbody):
        name = model.body(number).name
        geoms = geoms_of(model, number)
        if name and geoms.size:
            found[f"friction.{name}"] = float(model.geom_friction[geoms, 0].max())
        if name and model.body_mass[number] > 0.0:
            found[f"mass.{name}"] = float(model.body_mass[number])
    for number in range(model.nu):
        name = model.actuator(number).name
        if name and model.actuator_gainprm[number, 0] != 0.0:
            found[f"gain.{name}"] = float(model.actuator_gainprm[number, 0])
    return found


def bytes_of(model: Any) -> bytes:
    """All that a model is."""
    found = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, found)
    return found.tobytes()


def varied_model(model: Any, changes: Mapping[str, float]) -> Any:
    """A copy with other values. The frictions of a body's geoms and of its contact pairs keep their
    ratios, an inertia grows with the mass, and what an actuator takes back with its gain."""
    made, now = copy(model), values_of(model)
    for name, value in changes.items():
        kind, _, of = name.partition(".")
        ratio = value / now[name] if now[name] else np.nan
        if kind == "friction":
            rows = geoms_of(made, made.body(of).id)
            slides = made.geom_friction[rows, 0] * ratio
            made.geom_friction[rows, 0] = slides if now[name] else value
            of_pairs = np.isin(made.pair_geom1, rows) | np.isin(made.pair_geom2, rows)
            if of_pairs.any() and not now[name]:
                why = "its contact pairs have no ratio to keep: give its geoms one above 0"
                raise ValueError(f"{name} is 0 in the model, and {why}")
            made.pair_friction[of_pairs, :2] *= ratio
        elif kind == "mass":
            number = made.body(of).id
            made.body_mass[number] = value
            made.body_inertia[number] *= ratio
        else:
            number = made.actuator(of).id
            made.actuator_gainprm[number, 0] = value
            made.actuator_biasprm[number] *= ratio
    mujoco.mj_setConst(made, mujoco.MjData(made))
    return made


def geoms_of(model: Any, body: int) -> Any:
    """Numbers of a body's geoms, shape (n,)."""
    return np.flatnonzero(model.geom_bodyid == body)
