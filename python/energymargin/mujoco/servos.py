"""Which control of a MuJoCo model asks a scene's joint for its target.

A joint's drive in MuJoCo is that of `em.scenes.from_mjcf`: its force is rest + slope * control -
stiffness * position - damping * velocity, with its springs and the actuators of tendons.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energymargin._core import Joint
from energymargin.mujoco.names import Names
from energymargin.plausibility import warn
from energymargin.scenes.mjcf_couplings import couplings
from energymargin.scenes.mjcf_drives import Drive, drives
from energymargin.scenes.mjcf_features import Features
from energymargin.scenes.mjcf_model import Selection, control_address, disabled, start_of, word

__all__ = ["Servo", "servos"]

FILTERS = ("filter", "filterexact")  # activations that follow the control


@dataclass(frozen=True)
class Servo:
    """The one actuator that drives a joint by position or velocity control."""

    joint: Joint
    """The scene's."""
    address: int
    """Of its control in `ctrl`."""
    slope: float
    rest: float
    stiffness: float
    damping: float
    activation: int
    """Of a filter's state in `act`; -1 without one."""
    range: tuple[float, float] | None
    """To which MuJoCo clips the control."""

    def control(self, target: float) -> float:
        """That asks for a target [rad or m]; under velocity control for the joint's velocity."""
        force = self.stiffness * target + self.damping * self.joint.target_velocity
        return (force - self.rest) / self.slope

    def target(self, control: float) -> float:
        """That a control asks for [rad or m], under position control."""
        force = self.rest + self.slope * control - self.damping * self.joint.target_velocity
        return force / self.stiffness

    def write(self, data: Any) -> None:
        """Sets the control in a `mujoco.MjData` to that of the scene's target."""
        control = self.control(self.joint.target)
        if self.range is not None and not self.range[0] <= control <= self.range[1]:
            about = f"joint {self.joint.name!r}: control"
            low, high = self.range
            text = f"{about} {control:.6g} would ask for its target, and MuJoCo clips it to "
            warn([(about, text + f"[{low:.6g}, {high:.6g}].")], repr((control, self.range)))
        data.ctrl[self.address] = control
        if self.activation >= 0:
            data.act[self.activation] = control


def servos(names: Names, model: Any) -> dict[str, Servo]:
    """By joint of the scene that is driven in it as in the model, by one actuator there."""
    features = Features(())
    selection = Selection(model, None, "fixed", start_of(model, None, None), features)
    found = drives(selection, couplings(selection, features), (), features)
    result = {}
    for joint, number in names.moving():
        drive = found.get(number, Drive())
        alike = (drive.stiffness > 0) == (joint.stiffness > 0)
        if len(drive.controls) == 1 and alike and not joint.held:
            result[joint.name] = _servo(joint, drive, selection)
    return result


def _servo(joint: Joint, drive: Drive, selection: Selection) -> Servo:
    model = selection.model
    ((actuator, slope),) = drive.controls.items()
    address = control_address(model, actuator)
    limited = model.actuator_ctrllimited[actuator] and not disabled(model, "CLAMPCTRL")
    low, high = map(float, model.actuator_ctrlrange[actuator])
    filtered = word("mjtDyn", model.actuator_dyntype[actuator]) in FILTERS
    return Servo(
        joint,
        address,
        slope,
        drive.force - slope * float(selection.start.control[address]),
        drive.stiffness,
        drive.damping,
        int(model.actuator_actadr[actuator]) if filtered else -1,
        (low, high) if limited else None,
    )
