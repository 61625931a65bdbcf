"""What can be another in a MuJoCo model: friction and masses of bodies, gains of actuators."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Any

import mujoco
import numpy as np


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
