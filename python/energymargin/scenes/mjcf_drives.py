"""What moves and stops the joints of a MuJoCo model: springs, dampers, actuators and limits."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin._core import Mimic
from energymargin.scenes.mjcf_couplings import Coupling, Linear, linear_tendon
from energymargin.scenes.mjcf_model import (
    Features,
    Selection,
    control_address,
    disabled,
    name_of,
    word,
)

UNLIMITED = 1e4  # rad or m; a limit beyond it is none
SLACK = 1e-6  # rad or m, of limits of joints that follow: files are rounded


@dataclass(eq=False)
class Drive:
    """Limits of a joint, and its force: force - stiffness * position - damping * velocity.

    For a joint that slides read m for rad and N for N m.
    """

    lower: float = -math.inf
    upper: float = math.inf
    force: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    armature: float = 0.0
    most: list[float] = field(default_factory=list)
    """The force limit of each actuator."""
    passive_force: bool = False
    """Whether a spring of the joint acts beside its actuators."""
    controls: dict[int, float] = field(default_factory=dict)
    """By actuator with a constant gain, the force for each unit of its control."""
    motors: int = 0
    """Actuators that control a force alone."""
    ceiling: float = math.inf
    """Force limit of all actuators together."""

    def stop(self, lower: float, upper: float) -> None:
        """Narrows the limits; a number beyond UNLIMITED is none."""
        self.lower = max(self.lower, lower if lower > -UNLIMITED else -math.inf)
        self.upper = min(self.upper, upper if upper < UNLIMITED else math.inf)

    def keywords(self) -> dict[str, Any]:
        """Those of `Scene.add_joint`."""
        given: dict[str, Any] = {
            "limits": (self.lower, self.upper),
            "stiffness": self.stiffness,
            "damping": self.damping,
        }
        if self.armature > 0:
            given["armature"] = self.armature
        if self.stiffness > 0:
            given["target"] = self.force / self.stiffness
        elif self.damping > 0:
            given["target_velocity"] = self.force / self.damping
        limit = min(sum(self.most), self.ceiling) if self.most else math.inf
        if math.isfinite(limit):
            given["torque_limit"] = limit
        return given


def drives(
    selection: Selection,
    coupled: dict[int, Coupling],
    commanded: Collection[str],
    features: Features,
) -> dict[int, Drive]:
    """By joint that follows no other; what acts on joints that follow acts there.

    `commanded`: joints whose drives the caller gives, by name. Counts what is not simulated.
    """
    maker = _Drives(selection, coupled, features)
    maker.add_limits()
    maker.add_springs()
    maker.add_tendons()
    maker.add_actuators()
    maker.count(commanded)
    return maker.drives


class _Drives:
    def __init__(
        self, selection: Selection, coupled: dict[int, Coupling], features: Features
    ) -> None:
        self._model, self._start, self._features = selection.model, selection.start, features
        self._own = selection.all_joints()
        self._free = selection.free - ({selection.root} if selection.root is not None else set())
        self._linear = {
            joint: Linear({} if c.source is None else {c.source: c.multiplier}, c.offset)
            for joint, c in coupled.items()
        }
        self.drives = {joint: Drive() for joint in self._own if joint not in coupled}

    def _on_joint(self, length: Linear) -> tuple[Drive, float]:
        """The drive of the one joint that a length depends on, and its coefficient."""
        ((joint, factor),) = length.terms.items()
        return self.drives[joint], factor

    def _names(self, length: Linear) -> list[str]:
        """Names of the joints here that a length depends on."""
        return [name_of(self._model, "joint", j) for j in length.terms if j in self._own]

    def _of(self, joint: int) -> Linear:
        return Linear({joint: 1.0}).with_couplings(self._linear)

    def _stop(self, length: Linear, lower: float, upper: float) -> None:
        if length.terms:
            drive, factor = self._on_joint(length)
            drive.stop(*sorted((end - length.constant) / factor for end in (lower, upper)))

    def _push(
        self, length: Linear, force: float, stiffness: float, damping: float, *, passive: bool
    ) -> None:
        """Adds force - stiffness * length - damping * rate, along the length."""
        if length.terms:
            drive, factor = self._on_joint(length)
            drive.force += factor * (force - stiffness * length.constant)
            drive.stiffness += factor**2 * stiffness
            drive.damping += factor**2 * damping
            drive.passive_force |= passive and bool(stiffness)

    def add_limits(self) -> None:
        """Those of joints; a joint that follows stops the one that leads."""
        if disabled(self._model, "LIMIT"):
            return
        for joint in self._own:
            if self._model.jnt_limited[joint]:
                self._stop(self._of(joint), *map(float, self._model.jnt_range[joint]))

    def add_springs(self) -> None:
        """Stiffness, damping and armature of joints."""
        model = self._model
        damps, springs = (not disabled(model, of) for of in ("DAMPER", "SPRING"))
        for joint in self._own:
            at, dof = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
            damping = damps * float(model.dof_damping[dof])
            stiffness = springs * float(model.jnt_stiffness[joint])
            rest = float(model.qpos_spring[at])
            self._push(self._of(joint), stiffness * rest, stiffness, damping, passive=True)
            self._add_armature(self._of(joint), float(model.dof_armature[dof]))

    def _add_armature(self, length: Linear, armature: float) -> None:
        for joint, factor in length.terms.items():
            self.drives[joint].armature += factor**2 * armature

    def add_tendons(self) -> None:
        """Limits, springs and dampers of fixed tendons that depend on one joint."""
        for tendon in range(self._model.ntendon):
            self._add_tendon(tendon)

    def _add_tendon(self, tendon: int) -> None:
        model = self._model
        length = linear_tendon(model, tendon)
        acts = self._tendon_acts(tendon)
        if length is None:
            self._features.add("tendon", acts and self._near(tendon))
            return
        names = self._names(length)
        if not set(length.terms) & set(self._own):
            return
        if not set(length.terms) <= set(self._own):
            self._features.add("tendon", acts, names)
            return
        length = length.with_couplings(self._linear)
        losses = bool(model.tendon_frictionloss[tendon])
        self._features.add("tendon.frictionloss", losses and bool(length.terms))
        if len(length.terms) > 1:
            acts = self._pulls(tendon) or not self._within(tendon, length)
            self._features.add("tendon", acts, names)
        elif length.terms:
            self._add_simple_tendon(tendon, length)

    def _add_simple_tendon(self, tendon: int, length: Linear) -> None:
        model = self._model
        if model.tendon_limited[tendon] and not disabled(self._model, "LIMIT"):
            self._stop(length, *map(float, model.tendon_range[tendon]))
        low, high = map(float, model.tendon_lengthspring[tendon])
        stiffness = float(model.tendon_stiffness[tendon])
        damping = float(model.tendon_damping[tendon])
        self._features.add("tendon", bool(stiffness) and low != high)
        self._push(length, stiffness * low, stiffness, damping, passive=True)
        self._add_armature(length, _number(model, "tendon_armature", tendon))

    def _pulls(self, tendon: int) -> bool:
        """Whether a tendon resists motion within its limits."""
        names = ("stiffness", "damping", "armature")
        return any(_number(self._model, f"tendon_{name}", tendon) for name in names)

    def _tendon_acts(self, tendon: int) -> bool:
        model = self._model
        return bool(
            model.tendon_limited[tendon] or model.tendon_frictionloss[tendon] or self._pulls(tendon)
        )

    def _near(self, tendon: int) -> bool:
        """Whether a spatial tendon passes a body with joints of the selection, or below one."""
        model = self._model
        first, count = model.tendon_adr[tendon], model.tendon_num[tendon]
        sites = [
            int(model.wrap_objid[wrap])
            for wrap in range(first, first + count)
            if word("mjtWrap", model.wrap_type[wrap]) == "site"
        ]
        bodies = {int(model.site_bodyid[site]) for site in sites}
        moved = {int(model.jnt_bodyid[joint]) for joint in self._own} | self._free
        return any(above in moved for body in bodies for above in _chain(model, body))

    def _within(self, tendon: int, length: Linear) -> bool:
        """Whether the joints' limits keep a tendon within its own."""
        if not self._model.tendon_limited[tendon] or disabled(self._model, "LIMIT"):
            return True
        ends = np.array(
            [
                sorted((f * self.drives[j].lower, f * self.drives[j].upper))
                for j, f in length.terms.items()
            ]
        )
        least, most = ends.sum(axis=0) + length.constant
        low, high = self._model.tendon_range[tendon]
        return bool(low <= least and most <= high)

    def add_actuators(self) -> None:
        """Position and velocity control, at the control of the start."""
        if disabled(self._model, "ACTUATION"):
            return
        for actuator in range(self._model.nu):
            self._add_actuator(actuator)
        for joint in self._own:
            self._add_ceiling(joint)

    def _add_ceiling(self, joint: int) -> None:
        """The limit of all actuators of a joint together."""
        model, drive = self._model, self.drives.get(joint)
        if not model.jnt_actfrclimited[joint]:
            return
        low, high = map(float, model.jnt_actfrcrange[joint])
        if drive is None or low != -high:
            self._features.add("actuator.forcerange")
        if drive is not None:
            drive.ceiling = max(-low, high)

    def _add_actuator(self, actuator: int) -> None:
        model = self._model
        length = self._transmission(actuator)
        if length is None or not length.terms:
            return
        if word("mjtDyn", model.actuator_dyntype[actuator]) != "none":
            self._features.add("actuator/activation")
        extras = ("damping", "armature", "delay")
        self._features.add(
            "actuator.damping", any(_number(model, f"actuator_{e}", actuator) for e in extras)
        )
        law = self._law(actuator)
        if law is None or law[1] < 0 or law[2] < 0:
            self._features.add("actuator/gain", loose=self._names(length))
            return
        drive, factor = self._on_joint(length)
        if law[1] == 0 and law[2] == 0:
            drive.motors += 1
            return
        self._push(length, *law, passive=False)
        gain = float(model.actuator_gainprm[actuator][0])
        if word("mjtGain", model.actuator_gaintype[actuator]) == "fixed" and gain:
            drive.controls[actuator] = factor * gain
        drive.most.append(abs(factor) * self._force_limit(actuator))

    def _force_limit(self, actuator: int) -> float:
        if not self._model.actuator_forcelimited[actuator]:
            return math.inf
        low, high = map(float, self._model.actuator_forcerange[actuator])
        self._features.add("actuator.forcerange", low != -high)
        return max(-low, high)

    def _law(self, actuator: int) -> tuple[float, float, float] | None:
        """Force, stiffness and damping along the transmission, at the control of the start."""
        model = self._model
        terms = {"none": 0, "fixed": 1, "affine": 3}
        gains = terms.get(word("mjtGain", model.actuator_gaintype[actuator]))
        biases = terms.get(word("mjtBias", model.actuator_biastype[actuator]))
        if gains is None or biases is None:
            return None
        gain, bias = np.zeros(3), np.zeros(3)
        gain[:gains] = model.actuator_gainprm[actuator][:gains]
        bias[:biases] = model.actuator_biasprm[actuator][:biases]
        control = self._start.control[control_address(model, actuator)]
        force, length, velocity = gain * control + bias
        return float(force), float(-length), float(-velocity)

    def _transmission(self, actuator: int) -> Linear | None:
        """The length that an actuator acts along, of joints that lead; None if it has none here."""
        model = self._model
        end = int(model.actuator_trnid[actuator][0])
        kind = word("mjtTrn", model.actuator_trntype[actuator])
        gear = float(model.actuator_gear[actuator][0])
        length: Linear | None = None
        if kind in ("joint", "jointinparent"):
            if end in self._own:
                length = self._of(end)
            else:
                self._features.add("actuator/site", int(model.jnt_bodyid[end]) in self._free)
        elif kind == "tendon":
            length = self._tendon_transmission(end)
        else:
            self._features.add("actuator/site")
        return None if length is None else Linear({}).plus(length, gear)

    def _tendon_transmission(self, tendon: int) -> Linear | None:
        length = linear_tendon(self._model, tendon)
        if length is not None and not set(length.terms) & set(self._own):
            return None
        names = [] if length is None else self._names(length)
        whole = length is not None and set(length.terms) <= set(self._own)
        length = length.with_couplings(self._linear) if length is not None and whole else None
        if length is None or len(length.terms) > 1:
            self._features.add("actuator/tendon", loose=names)
            return None
        return length

    def count(self, commanded: Collection[str]) -> None:
        """What of the joints is not simulated."""
        model, add = self._model, self._features.add
        for joint in self._own:
            dof = model.jnt_dofadr[joint]
            add("joint.frictionloss", model.dof_frictionloss[dof] > 0)
            add("joint.damping", _number(model, "dof_dampingpoly", dof) != 0)
            yields = _number(model, "jnt_springyield", joint)
            add("joint.stiffness", _number(model, "jnt_stiffnesspoly", joint) != 0 or yields != 0)
        for body in self._free:
            self._count_free(body)
        for joint, drive in self.drives.items():
            if name_of(model, "joint", joint) in commanded:
                continue
            add("actuator/motor", drive.motors, [name_of(model, "joint", joint)])
            limited = any(math.isfinite(most) for most in drive.most)
            add("actuator.forcerange", limited and (len(drive.most) > 1 or drive.passive_force))

    def _count_free(self, body: int) -> None:
        model, add = self._model, self._features.add
        joint, dof = model.body_jntadr[body], model.body_dofadr[body]
        if model.body_jntnum[body] == 0:
            return
        of = slice(dof, dof + model.body_dofnum[body])
        add("joint.armature", bool(np.any(model.dof_armature[of] > 0)))
        add("joint.frictionloss", bool(np.any(model.dof_frictionloss[of] > 0)))
        add("joint.damping", bool(np.any(model.dof_damping[of] > 0)))
        add("joint.stiffness", bool(model.jnt_stiffness[joint] > 0))


def joint_drives(
    selection: Selection,
    coupled: Mapping[int, Coupling],
    driven: Mapping[int, Drive],
    control: Mapping[str, Mapping[str, Any]],
    prefix: str,
) -> dict[int, dict[str, Any]]:
    """By joint, keywords of `Scene.add_joint`: drive, limits and start, or what it follows.

    `control` replaces the model's, by joint. Joints that lead come first.
    """
    keywords = {}
    for joint, drive in driven.items():
        own = control.get(name_of(selection.model, "joint", joint), {})
        of_model = _checked(selection, joint, drive, own)
        keywords[joint] = _start(selection, joint, {**of_model, **own})
    for joint, of in coupled.items():
        if of.source is None:
            keywords[joint] = {"held": True, "start": of.offset}
        else:
            source = prefix + name_of(selection.model, "joint", of.source)
            keywords[joint] = {"mimic": Mimic(source, of.multiplier, of.offset)}
    return keywords


def _checked(
    selection: Selection, joint: int, drive: Drive, own: Mapping[str, Any]
) -> dict[str, Any]:
    if "limits" not in own and not drive.lower < drive.upper:
        name = name_of(selection.model, "joint", joint)
        raise ValueError(
            f"joint {name!r} and those that follow it have limits from {drive.lower} to "
            f"{drive.upper}; joints={{{name!r}: {{'limits': (lower, upper)}}}} says which hold"
        )
    return drive.keywords()


def _start(selection: Selection, joint: int, keywords: dict[str, Any]) -> dict[str, Any]:
    """With the start of the model where no other is given."""
    model, start = selection.model, selection.start
    lower, upper = keywords["limits"]
    position = float(start.positions[model.jnt_qposadr[joint]])
    velocity = float(start.velocities[model.jnt_dofadr[joint]])
    of_model = {"start": min(max(position, lower), upper)}
    if velocity and not keywords.get("held"):
        of_model["start_velocity"] = velocity
    return {**of_model, **keywords}


def _number(model: Any, name: str, index: int) -> float:
    """The largest of a model's numbers, 0 where this version of MuJoCo has none of the name."""
    values = getattr(model, name, None)
    return 0.0 if values is None else float(np.max(np.abs(values[index])))


def _chain(model: Any, body: int) -> list[int]:
    """A body and those above it."""
    chain = [body]
    while chain[-1] > 0:
        chain.append(int(model.body_parentid[chain[-1]]))
    return chain
