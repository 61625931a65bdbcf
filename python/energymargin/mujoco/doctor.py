"""What is wrong with a MuJoCo scene as it is configured: it moves, creeps, overlaps or is weak."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import positive_number
from energymargin.base.reprs import Record
from energymargin.summary import Summarized

DEEP = 1e-3  # m; an overlap at the start that is told
MOVED = 1e-3  # m; what moves by more is not at rest
CREEP = 5e-5  # m/s; a faster one lets an object slip by a millimetre in twenty seconds
WINDOW = 0.5  # s; over which a creep is measured, at the end
STILL = 0.02  # m/s; what is faster slides or falls, and does not creep
FEW = 3  # geoms that are named
STEPS_OF_SOLREF = 2.0  # a time constant below so many steps is as stiff as none
DIVERGES = (
    *(mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL),
    mujoco.mjtWarning.mjWARN_BADQACC,
)
STIFFER = {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC, "impratio": 10.0}

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong."""

    kind: str
    """"overlap", "not at rest", "creep", "solref", "margin", "weak drive" or "diverges"."""
    where: str
    """Names of the bodies, geoms or actuators."""
    text: str
    """What it is, with its size, and a way out."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Record, Summarized):
    """All that was found; empty of a healthy scene."""

    findings: tuple[Finding, ...]

    def __len__(self) -> int:
        """How many."""
        return len(self.findings)


def doctor(model: Any, data: Any = None, *, time: float = 1.0) -> Diagnosis:
    """Looks at a scene where it begins, and lets MuJoCo step it as it is configured.

    Args:
        model: a `mujoco.MjModel`.
        data: a `mujoco.MjData` at the state that is looked at, with its controls; None: the model's
            first keyframe, or its own start. It is copied.
        time: for how long it is stepped [s].

    It tells bodies that overlap, that move although nothing pushes them, that creep in a grip or on
    a slope (and whether elliptic cones with impratio 10 would stop that), contacts whose solref is
    shorter than two steps, margins that push at a distance, and position or motor drives that are
    weaker than what they carry. Raises ValueError on a time that is not above 0.
    """
    positive_number("time", time)
    start = _start(model, data)
    findings = [*_overlaps(model, start), *_settings(model), *_weak_drives(model, start)]
    moved, creeps, diverged = _played(model, start, time)
    if diverged:
        findings.append(Finding("diverges", "all", f"MuJoCo warns of its state within {time:g} s"))
    for body, away in moved.items():
        text = f"moves by {1e3 * away:.3g} mm in {time:g} s although nothing pushes it"
        findings.append(Finding("not at rest", body, text))
    if creeps:
        findings += _told_creeps(model, start, time, creeps)
    return Diagnosis(tuple(findings))


def _start(model: Any, data: Any) -> Any:
    if data is not None:
        return copy(data)
    made = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, made, 0)
    return made


def _name(model: Any, kind: Any, number: int) -> str:
    return mujoco.mj_id2name(model, kind, number) or f"number {number}"


def _body(model: Any, geom: int) -> str:
    return _name(model, mujoco.mjtObj.mjOBJ_BODY, int(model.geom_bodyid[geom]))


def _geoms(model: Any, chosen: NDArray[np.bool_]) -> str:
    """The names of some geoms; of many the first."""
    numbers = np.flatnonzero(chosen).tolist()
    names = [_name(model, mujoco.mjtObj.mjOBJ_GEOM, one) for one in numbers[:FEW]]
    more = [f"and {len(numbers) - FEW} more"] if len(numbers) > FEW else []
    return ", ".join([*names, *more])


def _overlaps(model: Any, start: Any) -> Iterator[Finding]:
    data = copy(start)
    mujoco.mj_forward(model, data)
    deepest: dict[str, float] = {}
    for contact in data.contact:
        pair = " and ".join(sorted(_body(model, geom) for geom in contact.geom))
        deepest[pair] = max(deepest.get(pair, 0.0), -float(contact.dist))
    for pair, depth in deepest.items():
        if depth > DEEP:
            text = f"begin {1e3 * depth:.3g} mm in each other, and are driven apart"
            yield Finding("overlap", pair, text)


def _settings(model: Any) -> Iterator[Finding]:
    step = float(model.opt.timestep)
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    constant = model.geom_solref[:, 0]
    quick = collides & (constant > 0) & (constant < STEPS_OF_SOLREF * step)
    if quick.any():
        least = float(constant[quick].min())
        text = (
            f"solref {least:g} s is below two steps of {step:g} s: contacts are softer than it "
            "says, or ring; a timestep of half of it, or a longer solref"
        )
        yield Finding("solref", _geoms(model, quick), text)
    pushes = collides & (model.geom_margin - model.geom_gap > 0)
    if pushes.any():
        most = 1e3 * float((model.geom_margin - model.geom_gap)[pushes].max())
        text = f"margin pushes things off from {most:.3g} mm away; gap=margin looks without pushing"
        yield Finding("margin", _geoms(model, pushes), text)


def _weak_drives(model: Any, start: Any) -> Iterator[Finding]:
    """Drives whose largest force is below what gravity asks of their joint where it begins."""
    data = copy(start)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    for number in np.flatnonzero(np.isin(model.actuator_trntype, joints)).tolist():
        joint, gear = int(model.actuator_trnid[number, 0]), float(model.actuator_gear[number, 0])
        limits = [(model.actuator_forcelimited[number], model.actuator_forcerange[number], gear)]
        limits.append((model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint], 1.0))
        most = min((abs(by) * np.abs(ends).max() for on, ends, by in limits if on), default=np.inf)
        dof = int(model.jnt_dofadr[joint])
        load = abs(float(data.qfrc_bias[dof] - data.qfrc_passive[dof]))
        if most < load:
            name = _name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, number)
            text = f"gives at most {most:.3g} N or N m, and its joint carries {load:.3g}"
            yield Finding("weak drive", name, text)


def _played(model: Any, start: Any, time: float) -> tuple[dict[str, float], dict[str, float], bool]:
    """By body how far it has moved without a drive [m], and how fast it creeps [m/s]; whether it
    diverged."""
    data, step = copy(start), float(model.opt.timestep)
    window = min(WINDOW, time / 2)
    mujoco.mj_kinematics(model, data)
    began = np.array(data.xipos)
    mujoco.mj_step(model, data, max(1, round((time - window) / step)))
    before = np.array(data.xipos)
    mujoco.mj_step(model, data, max(1, round(window / step)))
    mujoco.mj_kinematics(model, data)
    if any(data.warning[int(one)].number for one in DIVERGES):
        return {}, {}, True
    joints = model.actuator_trnid[model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT, 0]
    driven = {int(model.body_rootid[model.jnt_bodyid[joint]]) for joint in joints}
    moved: dict[str, float] = {}
    creeps: dict[str, float] = {}
    for body in range(1, model.nbody):
        name = _name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        away = float(np.linalg.norm(data.xipos[body] - began[body]))
        speed = float(np.linalg.norm(data.xipos[body] - before[body])) / window
        if CREEP < speed < STILL and _is_free(model, body):
            creeps[name] = speed
        elif away > MOVED and int(model.body_rootid[body]) not in driven:
            moved[name] = away
    return moved, creeps, False


def _is_free(model: Any, body: int) -> bool:
    first = int(model.body_jntadr[body])
    return first >= 0 and model.jnt_type[first] == mujoco.mjtJoint.mjJNT_FREE


def _told_creeps(
    model: Any, start: Any, time: float, creeps: dict[str, float]
) -> Iterator[Finding]:
    other = copy(model)
    for name, value in STIFFER.items():
        setattr(other.opt, name, value)
    _, stiffer, _ = _played(other, start, time)
    cone = "pyramidal" if model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL else "elliptic"
    for body, speed in creeps.items():
        left = stiffer.get(body, 0.0)
        text = f"creeps at {1e3 * speed:.3g} mm/s ({cone} cones, impratio {model.opt.impratio:g})"
        cured = left < speed / 2
        text += f"; {1e3 * left:.3g} mm/s with elliptic cones and impratio 10" if cured else ""
        yield Finding("creep", body, text)
