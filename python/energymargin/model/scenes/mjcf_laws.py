"""Laws of joints and tendons: limits and forces, as keywords of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from energymargin._core import Mimic
from energymargin.model.scenes.additions import FileMistakes
from energymargin.model.scenes.mjcf_equalities import Linear
from energymargin.model.scenes.mjcf_model import Selection, name_of

UNLIMITED = 1e4  # rad or m; a limit beyond it is none


@dataclass(eq=False)
class JointDrive:
    """Limits of a joint, and its force: force - stiffness * position - damping * velocity.

    For a joint that slides read m for rad and N for N m.
    """

    lower: float = -math.inf
    upper: float = math.inf
    force: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    armature: float = 0.0
    friction: float = 0.0
    most: list[float] = field(default_factory=list)
    """The force limit of each actuator."""
    passive_force: bool = False
    """Whether a spring of the joint acts beside its actuators."""
    controls: dict[int, float] = field(default_factory=dict)
    """By actuator with a constant gain, the force for each unit of its control."""
    motors: int = 0
    """Actuators that control a force alone."""
    idle: int = 0
    """Those of them whose force is 0."""
    ceiling: float = math.inf
    """Force limit of all actuators together."""

    def stop(self, lower: float, upper: float) -> None:
        """Narrows the limits; a number beyond UNLIMITED is none."""
        self.lower = max(self.lower, lower if lower > -UNLIMITED else -math.inf)
        self.upper = min(self.upper, upper if upper < UNLIMITED else math.inf)

    def push(
        self, factor: float, force: float, stiffness: float, damping: float, constant: float
    ) -> None:
        """Adds force - stiffness * length - damping * rate, along a length that is the `constant`
        and `factor` times the position."""
        self.force += factor * (force - stiffness * constant)
        self.stiffness += factor**2 * stiffness
        self.damping += factor**2 * damping

    def keywords(self) -> dict[str, Any]:
        """Those of `Scene.add_joint`."""
        law = {"stiffness": self.stiffness, "damping": self.damping}
        rotor = {"armature": self.armature, "friction": self.friction}
        given: dict[str, Any] = {"limits": (self.lower, self.upper), **law}
        given |= {name: value for name, value in rotor.items() if value}
        if self.stiffness > 0:
            given["target"] = self.force / self.stiffness
        elif self.damping > 0:
            given["target_velocity"] = self.force / self.damping
        limit = min(sum(self.most), self.ceiling) if self.most else math.inf
        if math.isfinite(limit):
            given["torque_limit"] = limit
        return given


@dataclass(frozen=True, eq=False)
class TendonDrive:
    """What acts along a sum of several joints' positions."""

    name: str
    sum: Linear
    drive: JointDrive


def joint_drives(
    selection: Selection,
    coupled: Mapping[int, Linear],
    driven: Mapping[int, JointDrive],
    control: Mapping[str, Mapping[str, Any]],
    *,
    prefix: str,
    mistakes: FileMistakes,
) -> dict[int, dict[str, Any]]:
    """By joint, keywords of `Scene.add_joint`: drive, limits and start, or what it follows.

    `control` replaces the model's, by joint. Joints that lead come first. Lists limits that
    contradict each other.
    """
    model, start, keywords = selection.model, selection.start, {}
    for joint, drive in driven.items():
        name = name_of(model, "joint", joint)
        own = control.get(name, {})
        if "limits" not in own and not drive.lower < drive.upper:
            mistakes.add(
                f"joint {name!r} and those that follow it have limits from {drive.lower} to "
                f"{drive.upper}; joints={{{name!r}: {{'limits': (lower, upper)}}}} says which "
                "hold, mimic_limits='leader' that those of the joints that lead do, for all"
            )
            continue
        given = {**drive.keywords(), **own}
        lower, upper = given["limits"]
        position = float(start.positions[model.jnt_qposadr[joint]])
        velocity = float(start.velocities[model.jnt_dofadr[joint]])
        begins = {"start": min(max(position, lower), upper)}
        if velocity and not given.get("held"):
            begins["start_velocity"] = velocity
        keywords[joint] = {**begins, **given}
    for joint, of in coupled.items():
        keywords[joint] = {"held": True, "start": of.constant}
        for source, multiplier in of.terms.items():
            leader = prefix + name_of(model, "joint", source)
            keywords[joint] = {"mimic": Mimic(leader, multiplier, of.constant)}
    return keywords


def tendon_drives(model: Any, tendons: list[TendonDrive], prefix: str) -> list[dict[str, Any]]:
    """Keywords of `Scene.add_tendon`, of those that do something."""
    found = []
    for tendon in tendons:
        joints = {prefix + name_of(model, "joint", j): v for j, v in tendon.sum.terms.items()}
        keywords = tendon.drive.keywords()
        if any(value for name, value in keywords.items() if name != "limits") or any(
            map(math.isfinite, keywords["limits"])
        ):
            found.append({"name": prefix + tendon.name, "joints": joints, **keywords})
    return found
