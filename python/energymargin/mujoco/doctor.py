"""What is wrong with a MuJoCo scene as it is configured: it moves, creeps, overlaps or is weak."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, positive_number
from energymargin.base.reprs import Record
from energymargin.mujoco.states import require_data
from energymargin.summary import Summarized

DEEP = 1e-3  # m; an overlap at the start that is told
MOVED, TURNED = 1e-3, 0.02  # m, rad; what moves by more is not at rest
CREEP = 5e-5  # m/s; a faster one lets an object slip by a millimetre in twenty seconds
WINDOW = 0.5  # s; over which a creep is measured, at the end
STILL = 0.02  # m/s; what is faster slides or falls, and does not creep
STEADY = (0.9, 1.3)  # speed of a creep in the second half of the window over that in the first
PUSHES = 1e-3  # m; a margin that is told
SAG = 0.1  # rad or m; a position drive that is off by more does not hold its load
HELD = 0.9  # of the load of a joint; a drive that gives less is not what holds it
FEW = 3  # geoms that are named
STEPS_OF_SOLREF = 2.0  # a time constant below so many steps is as stiff as none
DIVERGES = [getattr(mujoco.mjtWarning, f"mjWARN_BAD{what}") for what in ("QPOS", "QVEL", "QACC")]
FIXED = mujoco.mjtGain.mjGAIN_FIXED
PLAIN = (  # drives whose force follows their control
    *(mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT),
)


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

    It tells bodies that overlap, that move or turn although nothing pushes them, that creep in a
    grip or on a slope (and whether elliptic cones with impratio 10 would stop that), contacts whose
    solref is shorter than two steps or too stiff for one, margins that push from a millimetre away,
    and drives that are weaker than what they carry, or hold it far from where they are told.

    Raises ValueError on a time that is not above 0, and on data of another model.
    """
    positive_number("time", time)
    start = _start(model, data)
    played = _played(model, start, time)
    findings = [*_overlaps(model, start), *_settings(model), *_weak_drives(model, start, played)]
    if played.diverged:
        findings.append(Finding("diverges", "all", f"MuJoCo warns of its state within {time:g} s"))
    for body, (away, turned) in played.moved.items():
        text = f"moves by {1e3 * away:.3g} mm and turns by {turned:.2g} rad in {time:g} s although "
        findings.append(Finding("not at rest", body, f"{text}nothing pushes it"))
    findings += _told_creeps(model, start, time, played)
    return Diagnosis(tuple(findings))


def _start(model: Any, data: Any) -> Any:
    check_type("model", model, mujoco.MjModel, "a mujoco.MjModel")
    if data is not None:
        require_data(model, data)
        return copy(data)
    made = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, made, 0)
    return made


def _name(model: Any, kind: Any, number: int) -> str:
    return mujoco.mj_id2name(model, kind, number) or f"number {number}"


def _parts(model: Any, contact: Any) -> str:
    """Names of the bodies that touch; what is soft has no geom there."""
    of = mujoco.mjtObj
    bodies = [_name(model, of.mjOBJ_BODY, model.geom_bodyid[g]) for g in contact.geom if g >= 0]
    soft = [_name(model, of.mjOBJ_FLEX, flex) for flex in contact.flex if flex >= 0]
    return " and ".join(sorted(bodies + soft))


def _first(names: list[str], chosen: NDArray[np.bool_]) -> str:
    """Some names; of many the first."""
    numbers = np.flatnonzero(chosen).tolist()
    more = [f"and {len(numbers) - FEW} more"] if len(numbers) > FEW else []
    return ", ".join([*(names[one] for one in numbers[:FEW]), *more])


def _overlaps(model: Any, start: Any) -> Iterator[Finding]:
    data = copy(start)
    mujoco.mj_forward(model, data)
    deepest: dict[str, float] = {}
    for contact in data.contact:
        pair = _parts(model, contact)
        deepest[pair] = max(deepest.get(pair, 0.0), -float(contact.dist))
    for pair, depth in deepest.items():
        if depth > DEEP:
            text = f"begin {1e3 * depth:.3g} mm in each other, and are driven apart"
            yield Finding("overlap", pair, text)


def _touching(model: Any) -> tuple[list[str], Floats, Floats]:
    """Names of what may touch, geoms and pairs or what options put in their place; the solref of
    each, shape (n, 2); the margin [m] from which on contacts push, shape (n,)."""
    option, of = model.opt, mujoco.mjtObj
    if option.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        return ["option"], option.o_solref[None].copy(), np.array([option.o_margin])
    geoms = np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    names = [_name(model, of.mjOBJ_GEOM, one) for one in geoms.tolist()]
    pairs = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
    names += [" and ".join(_name(model, of.mjOBJ_GEOM, one) for one in pair) for pair in pairs]
    gaps = np.concatenate([model.geom_gap[geoms], model.pair_gap]) * _gap_is_taken_off()
    margins = np.concatenate([model.geom_margin[geoms], model.pair_margin])
    return names, np.concatenate([model.geom_solref[geoms], model.pair_solref]), margins - gaps


@cache
def _gap_is_taken_off() -> bool:
    """Whether this MuJoCo takes a geom's gap off its margin; later ones do not."""
    ball = '<geom size=".1" margin=".01" gap=".01"/>'
    other = f'<body pos="0 0 .205"><freejoint/>{ball}</body>'
    text = f"<mujoco><worldbody>{ball}{other}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(data.contact.includemargin[0] == 0.0)


def _settings(model: Any) -> Iterator[Finding]:
    step, (names, solref, margin) = float(model.opt.timestep), _touching(model)
    constant, other = solref.T
    quick = (constant > 0) & (constant < STEPS_OF_SOLREF * step)
    if quick.any():
        text = f"solref {constant[quick].min():g} s is below two steps of {step:g} s: contacts are "
        text += "softer than it says, or ring; a timestep of half of it, or a longer solref"
        yield Finding("solref", _first(names, quick), text)
    hard = (constant < 0) & (np.maximum(-constant * step**2, -other * step) > 1.0)
    if hard.any():
        text = f"solref is a stiffness of {-constant[hard].min():g} /s^2 and a damping of "
        text += f"{-other[hard].min():g} /s, too much for a step of {step:g} s: contacts ring or "
        text += "throw things off; a shorter timestep, or a softer solref"
        yield Finding("solref", _first(names, hard), text)
    pushes = margin >= PUSHES
    if pushes.any():
        most = 1e3 * float(margin[pushes].max())
        text = f"margin pushes things off from {most:.3g} mm away; a smaller one does not"
        yield Finding("margin", _first(names, pushes), text)


def _moments(model: Any, data: Any) -> Floats:
    """What a unit of each actuator's force does at each degree of freedom, shape (nu, nv)."""
    dense = np.zeros((model.nu, model.nv))
    if hasattr(data, "moment_rownnz"):
        rows = data.moment_rownnz, data.moment_rowadr, data.moment_colind
        mujoco.mju_sparse2dense(dense, data.actuator_moment.ravel(), *rows)
        return dense
    return np.reshape(data.actuator_moment, dense.shape)


def _forces(model: Any) -> tuple[Floats, Floats]:
    """Largest force of each actuator, and how stiff a servo is, whose targets limit no force."""
    gain, bias = np.abs(model.actuator_gainprm[:, 0]), model.actuator_biastype
    plain = np.isin(model.actuator_dyntype, PLAIN) & (model.actuator_gaintype == FIXED)
    motor = plain & (bias == mujoco.mjtBias.mjBIAS_NONE) & (model.actuator_ctrllimited != 0)
    most = np.where(motor, gain * np.abs(model.actuator_ctrlrange).max(axis=1), np.inf)
    limit = np.abs(model.actuator_forcerange).max(axis=1)
    most = np.minimum(most, np.where(model.actuator_forcelimited, limit, np.inf))
    servo = plain & (bias == mujoco.mjtBias.mjBIAS_AFFINE)
    return most, np.where(servo, -model.actuator_biasprm[:, 1], 0.0)


def _weak_drives(model: Any, start: Any, played: Played) -> Iterator[Finding]:
    """Drives whose largest forces are below what gravity asks of their joint where it begins, and
    servos that hold it far from where they are told; not where something else holds the joint: its
    end, friction, a weld, or what it lies on."""
    data = copy(start)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    moments, (forces, stiffness) = np.abs(_moments(model, data)), _forces(model)
    for dof in np.flatnonzero(moments.any(axis=0)).tolist():
        joint, of = int(model.dof_jntid[dof]), np.flatnonzero(moments[:, dof])
        taken = data.qfrc_passive[dof] + model.jnt_actgravcomp[joint] * data.qfrc_gravcomp[dof]
        load = abs(float(data.qfrc_bias[dof] - taken))
        most, stiff = moments[of, dof] @ forces[of], moments[of, dof] ** 2 @ stiffness[of]
        if model.jnt_actfrclimited[joint]:
            most = min(most, np.abs(model.jnt_actfrcrange[joint]).max())
        name = ", ".join(_name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, one) for one in of.tolist())
        if not played.gave_way[dof] and played.given[dof] < HELD * load:
            continue
        if most < load:
            text = f"gives at most {most:.3g} N or N m, and its joint carries {load:.3g}"
            yield Finding("weak drive", name, text)
        elif load > SAG * stiff > 0.0:
            text = (
                f"holds its joint's load of {load:.3g} N or N m {load / stiff:.2g} m or rad from "
            )
            yield Finding("weak drive", name, f"{text}where it is told; a larger kp, or gravcomp")


class Played(NamedTuple):
    """What became of a scene in some time."""

    moved: dict[str, tuple[float, float]]
    """By body how far it has moved [m] and turned [rad], of each tree that no drive moves the body
    that went farthest."""
    creeping: NDArray[np.intp]
    """Numbers of bodies that creep."""
    speeds: Floats
    """Of all bodies at the end [m/s], shape (b,)."""
    diverged: bool
    gave_way: NDArray[np.bool_]
    """Whether each degree of freedom has moved, shape (nv,)."""
    given: Floats
    """What drives give at the end, likewise [N, N m]."""


def _played(model: Any, start: Any, time: float) -> Played:
    data, step = copy(start), float(model.opt.timestep)
    warned = [data.warning[int(one)].number for one in DIVERGES]
    half = min(WINDOW, time / 2) / 2
    mujoco.mj_kinematics(model, data)
    poses = [(np.array(data.xipos), np.array(data.xquat))]
    for seconds in (time - 2 * half, half, half):
        mujoco.mj_step(model, data, max(1, round(seconds / step)))
        mujoco.mj_kinematics(model, data)
        poses.append((np.array(data.xipos), np.array(data.xquat)))
    way, given = np.zeros(model.nv), np.abs(data.qfrc_actuator)
    mujoco.mj_differentiatePos(model, way, 1.0, start.qpos, data.qpos)
    slides = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_SLIDE
    gave_way = np.abs(way) > np.where(slides, MOVED, TURNED)
    if warned != [data.warning[int(one)].number for one in DIVERGES]:
        none = np.zeros(0, int), np.zeros(model.nbody)
        return Played({}, *none, True, np.ones_like(gave_way), given)
    ways = [np.linalg.norm(two[0] - one[0], axis=1) for one, two in pairwise(poses)]
    speeds = (ways[1] + ways[2]) / (2 * half)
    away = np.linalg.norm(poses[-1][0] - poses[0][0], axis=1)
    turned = 2 * np.arccos(np.minimum(np.abs((poses[-1][1] * poses[0][1]).sum(axis=1)), 1.0))
    free = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    creeping = (speeds > CREEP) & (speeds < STILL) & np.isin(np.arange(model.nbody), free)
    creeping &= (ways[2] > STEADY[0] * ways[1]) & (ways[2] < STEADY[1] * ways[1])
    dofs = _moments(model, data).any(axis=0)
    still = np.isin(model.body_rootid, model.body_rootid[model.dof_bodyid[dofs]])
    still |= (away - creeping * speeds * time < MOVED) & (turned < TURNED)
    moved: dict[str, tuple[float, float]] = {}
    for root in np.unique(model.body_rootid[~still]):
        tree = np.flatnonzero(~still & (model.body_rootid == root))
        body = int(tree[np.argmax(away[tree])])
        name = _name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        moved[name] = float(away[body]), float(turned[body])
    return Played(moved, np.flatnonzero(creeping), speeds, False, gave_way, given)


def _told_creeps(model: Any, start: Any, time: float, played: Played) -> Iterator[Finding]:
    if not played.creeping.size:
        return
    other = copy(model)
    other.opt.cone, other.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
    stiffer = _played(other, start, time)
    cone = "pyramidal" if model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL else "elliptic"
    for body in played.creeping.tolist():
        speed, left = played.speeds[body], stiffer.speeds[body]
        text = f"creeps at {1e3 * speed:.3g} mm/s ({cone} cones, impratio {model.opt.impratio:g})"
        cured = left < speed / 2 and not stiffer.diverged
        text += f"; {1e3 * left:.3g} mm/s with elliptic cones and impratio 10" if cured else ""
        yield Finding("creep", _name(model, mujoco.mjtObj.mjOBJ_BODY, body), text)
