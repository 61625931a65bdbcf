"""Equality constraints of a MuJoCo model: joints that follow others, and bodies that are tied.

Joints and fixed tendons are linear equations; connections, welds and ball joints are loops.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from energymargin.base.aliases import Floats
from energymargin.model.scenes import mjcf_model
from energymargin.model.scenes.mjcf_model import Selection, disabled, name_of, word
from energymargin.model.scenes.poses import Pose

TOLERANCE = 1e-9  # of equations that say the same


@dataclass(frozen=True, eq=False)
class Linear:
    """A sum of joints' positions, each times a coefficient, and a constant."""

    terms: Mapping[int, float]
    constant: float = 0.0

    def plus(self, other: Linear, factor: float = 1.0) -> Linear:
        """The sum with a multiple of another."""
        terms = dict(self.terms)
        for joint, value in other.terms.items():
            terms[joint] = terms.get(joint, 0.0) + factor * value
        least = TOLERANCE * max(map(abs, terms.values()), default=0.0)
        kept = {joint: value for joint, value in terms.items() if abs(value) > least}
        return Linear(kept, self.constant + factor * other.constant)

    def with_couplings(self, coupled: Mapping[int, Linear]) -> Linear:
        """This sum in terms of joints that follow no others."""
        result = Linear({}, self.constant)
        for joint, value in self.terms.items():
            result = result.plus(coupled.get(joint, Linear({joint: 1.0})), value)
        return result


@dataclass(frozen=True)
class _Equation:
    """A sum that is 0, the joint that it is written for, and what the model calls it."""

    sum: Linear
    joint: int | None
    feature: str


def couplings(selection: Selection) -> dict[int, Linear]:
    """By joint that follows, its position: a multiple of that of one other joint, or constant.

    Counts what is not linear or not of two joints.

    Joints with an actuator lead where they can. Raises ValueError on equations that contradict.
    """
    equations = _equations(selection)
    driven = _driven(selection.model)
    while True:
        solved = _solved(selection.model, equations, driven)
        bad = [joint for joint, (of, _) in solved.items() if len(of.terms) > 1]
        if not bad:
            return {joint: of for joint, (of, _) in solved.items()}
        dropped = [solved[joint][1] for joint in bad]
        for equation in dropped:
            joints = [name_of(selection.model, "joint", joint) for joint in equation.sum.terms]
            selection.features.add(equation.feature, loose=joints)
        equations = [equation for equation in equations if equation not in dropped]


def _solved(
    model: Any, equations: list[_Equation], driven: set[int]
) -> dict[int, tuple[Linear, _Equation]]:
    """By joint that follows: what it is, and the equation that was solved for it."""
    solved: dict[int, tuple[Linear, _Equation]] = {}
    for equation in equations:
        rest = equation.sum.with_couplings({joint: of for joint, (of, _) in solved.items()})
        if not rest.terms:
            if abs(rest.constant) > TOLERANCE:
                names = ", ".join(repr(name_of(model, "joint", j)) for j in equation.sum.terms)
                raise ValueError(f"equality constraints of joints {names} contradict each other")
            continue
        pivot = _pivot(rest, equation.joint, driven)
        factor = rest.terms[pivot]
        others = Linear({j: v for j, v in rest.terms.items() if j != pivot}, rest.constant)
        of = Linear({}).plus(others, -1.0 / factor)
        for joint, (other, its) in solved.items():
            solved[joint] = (other.with_couplings({pivot: of}), its)
        solved[pivot] = (of, equation)
    return solved


def _pivot(rest: Linear, wanted: int | None, driven: set[int]) -> int:
    """The joint that follows: the equation's own, or the last one, if another has an actuator."""
    passive = [joint for joint in rest.terms if joint not in driven]
    candidates = passive or list(rest.terms)
    return wanted if wanted in candidates else candidates[-1]


def _driven(model: Any) -> set[int]:
    """Joints that actuators move."""
    kinds = [word("mjtTrn", kind) for kind in model.actuator_trntype]
    return set(model.actuator_trnid[np.isin(kinds, ("joint", "jointinparent")), 0].tolist())


def _active(model: Any) -> Iterator[tuple[int, str]]:
    """Each constraint that acts, and its kind."""
    if not disabled(model, "EQUALITY"):
        for equality in np.flatnonzero(model.eq_active0).tolist():
            yield equality, word("mjtEq", model.eq_type[equality])


def _equations(selection: Selection) -> list[_Equation]:
    model = selection.model
    equations: list[_Equation] = []
    for i, kind in _active(model):
        ends = [int(end) for end in (model.eq_obj1id[i], model.eq_obj2id[i]) if end >= 0]
        if kind in ("joint", "tendon"):
            equation = _equation(selection, i, ends)
            equations += [equation] if equation else []
        elif kind == "distance":
            selection.features.add("equality/distance")
        elif kind not in ("connect", "weld"):
            selection.features.add("flex")
    return equations


def _equation(selection: Selection, equality: int, ends: list[int]) -> _Equation | None:
    """first = a0 + a1 second, of what lies beyond the references; None if it is of no use here."""
    model, own = selection.model, set(selection.all_joints())
    of_joints = word("mjtEq", model.eq_type[equality]) == "joint"
    feature = f"equality/{'joint' if of_joints else 'tendon'}"
    sides = [_beyond(model, end, of_joints=of_joints) for end in ends]
    joints = {joint for side in sides if side for joint in side.terms}
    if not joints & own and None not in sides:
        return None
    data = model.eq_data[equality]
    if None in sides or not joints <= own or (len(sides) > 1 and np.any(data[2:5] != 0)):
        names = [name_of(model, "joint", joint) for joint in sorted(joints & own)]
        selection.features.add(feature, loose=names)
        return None
    total = Linear({}, -float(data[0]))
    for side, factor in zip(sides, (1.0, -float(data[1])), strict=False):
        total = total if side is None else total.plus(side, factor)
    return _Equation(total, ends[0] if of_joints else None, feature)


def _beyond(model: Any, end: int, *, of_joints: bool) -> Linear | None:
    """A joint's position or a tendon's length, less the reference; None of a spatial tendon."""
    if of_joints:
        return Linear({end: 1.0}, -float(model.qpos0[model.jnt_qposadr[end]]))
    length = linear_tendon(model, end)
    return length and length.plus(Linear({}, -float(model.tendon_length0[end])))


def linear_tendon(model: Any, tendon: int) -> Linear | None:
    """The length of a fixed tendon, by its joints' positions; None for a spatial one."""
    wraps = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    if any(word("mjtWrap", model.wrap_type[w]) != "joint" for w in wraps):
        return None
    total = Linear({})
    for wrap in wraps:
        total = total.plus(Linear({int(model.wrap_objid[wrap]): float(model.wrap_prm[wrap])}))
    return total


@dataclass(frozen=True, eq=False)
class Tie:
    """A frame of one body and a frame of another that stay together."""

    kind: str
    """Of `Scene.add_loop`."""
    ends: list[tuple[int, Pose]]
    """Each body, and the frame in it."""


def ties(selection: Selection) -> list[Tie]:
    """Those of bodies that move; counts what holds bodies of the selection to others."""
    model, features, found = selection.model, selection.features, []
    for body, joint in selection.balls.items():
        anchor = np.asarray(model.jnt_pos[joint])
        parent = int(model.body_parentid[body])
        at = selection.at(body)
        frames = [_at(at[:3, :3] @ anchor + at[:3, 3]), _at(anchor)]
        found.append(Tie("point", list(zip((parent, body), frames, strict=True))))
        features.add("joint/ball", bool(model.jnt_limited[joint]))
    for i, kind in _active(model):
        if kind not in ("connect", "weld"):
            continue
        bodies = mjcf_model.tie_ends(model, i)
        outside = [body for body in bodies if body not in selection.lump]
        if (outside and selection.root in bodies) or (not outside and selection.rigid(*bodies)):
            continue  # where the base is, and how it moves, the caller says
        moving = [body for body in bodies if selection.yields(body)]
        feature = f"equality/{kind}"
        if moving and (outside or feature in features.ignored):
            features.add(feature, bodies=[name_of(model, "body", body) for body in moving])
        elif moving:
            frames = _frames(model, i, kind)
            turns = kind == "weld" and model.eq_data[i][10] > 0  # by its scale of torques
            found.append(Tie("weld" if turns else "point", list(zip(bodies, frames, strict=True))))
    return found


def _frames(model: Any, equality: int, kind: str) -> list[Pose]:
    """In the frames of its two bodies."""
    if word("mjtObj", model.eq_objtype[equality]) == "site":
        sites = model.eq_obj1id[equality], model.eq_obj2id[equality]
        return [mjcf_model.local_pose(model.site_pos[k], model.site_quat[k]) for k in sites]
    data = np.asarray(model.eq_data[equality])
    if kind == "connect":
        return [_at(data[:3]), _at(data[3:6])]
    return [mjcf_model.local_pose(data[3:6], data[6:10]), _at(data[:3])]


def _at(point: Floats) -> Pose:
    return mjcf_model.local_pose(point, (1.0, 0.0, 0.0, 0.0))
