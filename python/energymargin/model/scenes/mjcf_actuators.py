"""Which actuator of a MuJoCo model drives a joint or a tendon, and what its control asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from energymargin.model.scenes.mjcf_couplings import couplings
from energymargin.model.scenes.mjcf_drives import drives
from energymargin.model.scenes.mjcf_model import (
    Features,
    Selection,
    control_address,
    disabled,
    name_of,
    start_of,
    word,
)

FILTERS = ("filter", "filterexact")  # activations that follow the control


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
    features = Features(())
    selection = Selection(model, None, "fixed", start_of(model, None, None), features)
    of_joints, tendons = drives(selection, couplings(selection, features), (), features)
    driven = {tendon.name: tendon.drive for tendon in tendons}
    driven |= {name_of(model, "joint", number): drive for number, drive in of_joints.items()}
    clamps, found = not disabled(model, "CLAMPCTRL"), {}
    for name, drive in driven.items():
        if len(drive.controls) != 1:
            continue
        ((number, slope),) = drive.controls.items()
        address = control_address(model, number)
        rest = drive.force - slope * float(selection.start.control[address])
        filtered = word("mjtDyn", model.actuator_dyntype[number]) in FILTERS
        activation = int(model.actuator_actadr[number]) if filtered else -1
        limited = clamps and model.actuator_ctrllimited[number]
        low, high = model.actuator_ctrlrange[number] if limited else (-math.inf, math.inf)
        law = (address, slope, rest, drive.stiffness, drive.damping, activation)
        found[name] = Actuator(*law, float(low), float(high))
    return found
