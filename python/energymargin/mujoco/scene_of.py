"""The scene of a MuJoCo model that MuJoCo steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import energymargin as em
from energymargin.base.plausibility import kept_warnings
from energymargin.mujoco.variation import geoms_of

FRAME = 1e-3  # kg, of a body without mass
SMALLEST = 1e-3  # m, half an edge of a body without geoms


def scene_of(
    model: Any,
    data: Any,
    *,
    objects: Sequence[str],
    effector: Sequence[str] = (),
    step: float | None = None,
) -> em.Scene:
    """That of from_mjcf, in MuJoCo's step or another one [s]; of a model that it refuses, the named
    bodies alone, each a box about its geoms.

    Raises ValueError on names that the model does not have.
    """
    step = float(model.opt.timestep) if step is None else step
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
        inertial = em.Inertial(
            center=model.body_ipos[number],
            inertia=model.body_inertia[number],
            axes=np.roll(model.body_iquat[number], -1),
        )
    scene.add_body(
        name,
        em.Box([2 * max(reach, SMALLEST)] * 3),
        mass=mass or FRAME,
        inertial=inertial,
        position=data.xpos[number],
        orientation=np.roll(data.xquat[number], -1),
        role=role,
    )
