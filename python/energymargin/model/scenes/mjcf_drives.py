"""What moves and stops the joints of a MuJoCo model: springs, dampers, actuators and limits."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from energymargin.model.scenes import mjcf_model
from energymargin.model.scenes.mjcf_equalities import Linear, couplings, linear_tendon
from energymargin.model.scenes.mjcf_laws import JointDrive, TendonDrive
from energymargin.model.scenes.mjcf_model import Features, Selection, disabled, name_of, word

FILTERS = ("filter", "filterexact")  # activations that follow the control


def drives(
    selection: Selection, coupled: Mapping[int, Linear], commanded: Collection[str], *, leader: bool
) -> tuple[dict[int, JointDrive], list[TendonDrive]]:
    """By joint that follows no other; what acts on joints that follow acts there. And of tendons.

    `commanded`: joints whose drives the caller gives, by name. `leader`: leaves out the limits of
    joints that follow. Counts what is not simulated.
    """
    maker, model = _Drives(selection, coupled), selection.model
    for joint in selection.all_joints():
        maker.add_joint(joint, stops=not leader or joint not in coupled)
    for tendon in range(model.ntendon):
        maker.add_tendon(tendon)
    if not disabled(model, "ACTUATION"):
        for actuator in range(model.nu):
            maker.add_actuator(actuator)
        for joint in selection.all_joints():
            maker.add_ceiling(joint)
    maker.count(commanded)
    return maker.drives, maker.tendons


@dataclass(frozen=True)
class Actuator:
    """The one actuator that drives a joint or a tendon by position or velocity control.

    At a control c it acts with slope * c + rest - stiffness * position - damping * velocity, in N m
    or N.
    """

    address: int
    """Place of its control in `ctrl`."""
    slope: float
    rest: float
    stiffness: float
    """0 under velocity control."""
    damping: float
    activation: int
    """Place of a filter's state in `act`; -1 without one."""
    low: float
    high: float
    """To which MuJoCo clips the control."""


def actuators(model: Any) -> dict[str, Actuator]:
    """The actuators of a `mujoco.MjModel`, by the joint or tendon that each drives alone."""
    start = mjcf_model.start_of(model, None, None)
    selection = Selection(model, None, "fixed", start, Features(()))
    of_joints, tendons = drives(selection, couplings(selection), (), leader=False)
    driven = {tendon.name: tendon.drive for tendon in tendons}
    driven |= {name_of(model, "joint", number): drive for number, drive in of_joints.items()}
    clamps, found = not disabled(model, "CLAMPCTRL"), {}
    for name, drive in driven.items():
        if len(drive.controls) != 1:
            continue
        ((number, slope),) = drive.controls.items()
        address = mjcf_model.control_address(model, number)
        rest = drive.force - slope * float(selection.start.control[address])
        filtered = word("mjtDyn", model.actuator_dyntype[number]) in FILTERS
        activation = int(model.actuator_actadr[number]) if filtered else -1
        limited = clamps and model.actuator_ctrllimited[number]
        low, high = model.actuator_ctrlrange[number] if limited else (-math.inf, math.inf)
        law = (address, slope, rest, drive.stiffness, drive.damping, activation)
        found[name] = Actuator(*law, float(low), float(high))
    return found


class _Drives:
    def __init__(self, selection: Selection, coupled: Mapping[int, Linear]) -> None:
        self._model, self._start = selection.model, selection.start
        self._features = selection.features
        self._own = selection.all_joints()
        self._free = selection.free - ({selection.root} if selection.root is not None else set())
        self._coupled = coupled
        self._stops, self._damps, self._springs, self._dry = (
            not disabled(self._model, what)
            for what in ("LIMIT", "DAMPER", "SPRING", "FRICTIONLOSS")
        )
        self.drives = {joint: JointDrive() for joint in self._own if joint not in coupled}
        self.tendons: list[TendonDrive] = []

    def _along(self, length: Linear) -> tuple[JointDrive, float]:
        """What drives a length, of one joint or of those of a tendon, and its coefficient."""
        if len(length.terms) > 1:
            found = self._of_tendon(length)
            assert found
            return found
        ((joint, factor),) = length.terms.items()
        return self.drives[joint], factor

    def _of_tendon(self, length: Linear) -> tuple[JointDrive, float] | None:
        """The same of several joints; None if no tendon is simulated that is a multiple of it."""
        first = next(iter(length.terms))
        for tendon in self.tendons:
            factor = length.terms[first] / tendon.sum.terms.get(first, math.inf)
            if not length.plus(tendon.sum, -factor).terms:
                return tendon.drive, factor
        return None

    def _of(self, joint: int) -> Linear:
        return Linear({joint: 1.0}).with_couplings(self._coupled)

    def _stop(self, length: Linear, limited: Any, ends: Any) -> None:
        """Limits; those of a joint that follows stop the one that leads."""
        if self._stops and limited and length.terms:
            drive, factor = self._along(length)
            drive.stop(*sorted((float(end) - length.constant) / factor for end in ends))

    def _spring(
        self, length: Linear, law: tuple[float, float, float], *, armature: float, friction: float
    ) -> None:
        """Adds what acts beside actuators; `law`: length at rest, stiffness, damping."""
        rest, stiffness, damping = law
        if length.terms:
            drive, factor = self._along(length)
            drive.push(factor, stiffness * rest, stiffness, damping, length.constant)
            drive.armature += factor**2 * armature
            drive.passive_force |= stiffness > 0
            drive.friction += abs(factor) * friction

    def add_joint(self, joint: int, *, stops: bool) -> None:
        """Limits, if it `stops` there, stiffness, damping and armature of a joint."""
        model, add, length = self._model, self._features.add, self._of(joint)
        self._stop(length, stops and model.jnt_limited[joint], model.jnt_range[joint])
        dof = model.jnt_dofadr[joint]
        rest = float(model.qpos_spring[model.jnt_qposadr[joint]])
        stiffness = self._springs * float(model.jnt_stiffness[joint])
        damping = self._damps * float(model.dof_damping[dof])
        friction = self._friction("joint.frictionloss", model.dof_frictionloss[dof])
        law, armature = (rest, stiffness, damping), float(model.dof_armature[dof])
        self._spring(length, law, armature=armature, friction=friction)
        add("joint.damping", _number(model, "dof_dampingpoly", dof) != 0)
        nonlinear = ("jnt_springyield", "jnt_stiffnesspoly")
        add("joint.stiffness", any(_number(model, name, joint) for name in nonlinear))

    def _friction(self, name: str, loss: float) -> float:
        """Dry friction, unless the model disables it or it is ignored."""
        self._features.leave(name, name in self._features.ignored and loss > 0)
        return float(loss) if self._dry and name not in self._features.ignored else 0.0

    def _tendon(self, tendon: int) -> tuple[Linear | None, list[str]]:
        """Length of a tendon, by joints that lead, and the joints here that it depends on, by name.

        The length is None of a spatial tendon, and of one that depends on joints elsewhere.
        """
        length = linear_tendon(self._model, tendon)
        if length is None:
            return None, []
        names = [name_of(self._model, "joint", j) for j in length.terms if j in self._own]
        here = len(names) == len(length.terms)
        return (length.with_couplings(self._coupled) if here else None), names

    def add_tendon(self, tendon: int) -> None:
        """Limits, springs and dampers of a fixed tendon."""
        model, add = self._model, self._features.add
        length, names = self._tendon(tendon)
        limited = model.tendon_limited[tendon]
        loss = self._friction("tendon.frictionloss", model.tendon_frictionloss[tendon])
        stiffness = float(model.tendon_stiffness[tendon])
        damping = float(model.tendon_damping[tendon])
        armature = _number(model, "tendon_armature", tendon)
        pulls = bool(stiffness or damping or armature or loss)
        if length is None:
            acts = limited or pulls
            add("tendon", acts and bool(names or self._near(tendon)), names)
        elif length.terms:
            if len(length.terms) > 1:
                limited = not self._within(tendon, length)
                if "tendon" in self._features.ignored:
                    add("tendon", pulls or limited, names)
                    return
                add("tendon", bool(armature))
                name = name_of(model, "tendon", tendon)
                taken = {name_of(model, "joint", joint) for joint in range(model.njnt)}
                name = f"{name}/tendon" if name in taken else name
                self.tendons.append(TendonDrive(name, Linear(length.terms), JointDrive()))
            self._stop(length, limited, model.tendon_range[tendon])
            low, high = map(float, model.tendon_lengthspring[tendon])
            add("tendon", bool(stiffness) and low != high)
            self._spring(length, (low, stiffness, damping), armature=armature, friction=loss)

    def _near(self, tendon: int) -> bool:
        """Whether a spatial tendon passes a body with joints of the selection, or below one."""
        model = self._model
        wraps = slice(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
        kinds = np.array([word("mjtWrap", kind) for kind in model.wrap_type[wraps]])
        bodies = set(model.site_bodyid[model.wrap_objid[wraps][kinds == "site"]].tolist())
        moved = {int(model.jnt_bodyid[joint]) for joint in self._own} | self._free
        return not bodies.isdisjoint(mjcf_model.below(model, moved))

    def _within(self, tendon: int, length: Linear) -> bool:
        """Whether the joints' limits keep a tendon within its own."""
        if not self._model.tendon_limited[tendon] or not self._stops:
            return True
        own = [(self.drives[joint], factor) for joint, factor in length.terms.items()]
        ends = [sorted((factor * drive.lower, factor * drive.upper)) for drive, factor in own]
        least, most = np.sum(ends, axis=0) + length.constant
        low, high = self._model.tendon_range[tendon]
        return bool(low <= least and most <= high)

    def add_ceiling(self, joint: int) -> None:
        """The limit of all actuators of a joint together."""
        limited, ends = self._model.jnt_actfrclimited[joint], self._model.jnt_actfrcrange[joint]
        if joint in self.drives:
            self.drives[joint].ceiling = self._most(limited, ends)
        else:
            self._features.add("actuator.forcerange", bool(limited))

    def _most(self, limited: Any, ends: Any) -> float:
        """The limit of a force, from its range; counts one that is not the same both ways."""
        if not limited:
            return math.inf
        low, high = map(float, ends)
        self._features.add("actuator.forcerange", low != -high)
        return max(-low, high)

    def add_actuator(self, actuator: int) -> None:
        """Position or velocity control, at the control of the start."""
        model, add = self._model, self._features.add
        length = self._transmission(actuator)
        if length is None or not length.terms:
            return
        add("actuator/activation", word("mjtDyn", model.actuator_dyntype[actuator]) != "none")
        extras = ("damping", "armature", "delay")
        add("actuator.damping", any(_number(model, f"actuator_{e}", actuator) for e in extras))
        law = self._law(actuator)
        if law is None or law[1] < 0 or law[2] < 0:
            names = [name_of(model, "joint", joint) for joint in length.terms]
            add("actuator/gain", loose=names)
            return
        drive, factor = self._along(length)
        if law[1] == 0 and law[2] == 0:
            drive.motors += 1
            drive.idle += law[0] == 0
            return
        drive.push(factor, *law, length.constant)
        gain = float(model.actuator_gainprm[actuator][0])
        if word("mjtGain", model.actuator_gaintype[actuator]) == "fixed" and gain:
            drive.controls[actuator] = factor * gain
        ends = model.actuator_forcerange[actuator]
        drive.most.append(abs(factor) * self._most(model.actuator_forcelimited[actuator], ends))

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
        control = self._start.control[mjcf_model.control_address(model, actuator)]
        force, length, velocity = gain * control + bias
        return float(force), float(-length), float(-velocity)

    def _transmission(self, actuator: int) -> Linear | None:
        """The length that an actuator acts along, of joints that lead; None if it has none here."""
        model, add = self._model, self._features.add
        end = int(model.actuator_trnid[actuator][0])
        kind = word("mjtTrn", model.actuator_trntype[actuator])
        length: Linear | None = None
        if kind == "tendon":
            length, names = self._tendon(end)
            several = length is not None and len(length.terms) > 1
            left_out = several and "actuator/tendon" in self._features.ignored
            if length is None or left_out or (several and not self._of_tendon(length)):
                add("actuator/tendon", bool(names) or linear_tendon(model, end) is None, names)
                return None
        elif kind not in ("joint", "jointinparent"):
            add("actuator/site")
        elif end in self._own:
            length = self._of(end)
        else:
            add("actuator/site", int(model.jnt_bodyid[end]) in self._free)
        gear = float(model.actuator_gear[actuator][0])
        return None if length is None else Linear({}).plus(length, gear)

    def count(self, commanded: Collection[str]) -> None:
        """What of free bodies, and of the drives, is not simulated."""
        model, add = self._model, self._features.add
        for body in self._free:
            joint, dof = model.body_jntadr[body], model.body_dofadr[body]
            if model.body_jntnum[body]:
                acting = {"armature": True, "frictionloss": self._dry, "damping": self._damps}
                for what, acts in acting.items():
                    values = getattr(model, f"dof_{what}")[dof : dof + model.body_dofnum[body]]
                    own = what == "damping" and mjcf_model.damps(model, body)
                    add(f"joint.{what}", acts and bool(np.any(values > 0)) and not own)
                add("joint.stiffness", self._springs and bool(model.jnt_stiffness[joint] > 0))
        driven = [([joint], drive) for joint, drive in self.drives.items()]
        for joints, drive in [*driven, *((list(t.sum.terms), t.drive) for t in self.tendons)]:
            names = [name_of(model, "joint", joint) for joint in joints]
            if not set(names) <= set(commanded):
                add("actuator/motor", drive.motors - drive.idle, names)
                self._features.leave("actuator/motor", drive.idle, names)
                limited = any(math.isfinite(most) for most in drive.most)
                add("actuator.forcerange", limited and (len(drive.most) > 1 or drive.passive_force))


def _number(model: Any, name: str, index: int) -> float:
    """The largest of a model's numbers, 0 where this version of MuJoCo has none of the name."""
    values = getattr(model, name, None)
    return 0.0 if values is None else float(np.max(np.abs(values[index])))
