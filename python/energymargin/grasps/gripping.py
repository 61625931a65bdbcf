"""`em.grasps.grip`: a hand that has closed on an object, to be put into a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.checks import numbers_of
from energymargin.base.reprs import Record
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.hands import Hand, preset
from energymargin.grasps.outcomes import NO_GRIP, Grasp
from energymargin.grasps.protocols import Protocol, protocol_of
from energymargin.grasps.trials import STEP, GraspTrials
from energymargin.scenes import body_poses, pose


@dataclass(frozen=True, eq=False, repr=False)
class Grip(Record):
    """An object in a hand."""

    hand: Hand
    protocol: Protocol
    """What the hand does from now on."""
    base: NDArray[np.float64]
    """The frame of the hand's base in that of the object, (4, 4)."""
    joints: dict[str, float]
    """Where the hand's joints are that move by themselves [m] or [rad]."""


def grip(
    hand: Hand | str,
    object: GraspObject,
    grasp: ArrayLike,
    protocol: Protocol | str = "release",
    *,
    step: float = STEP,
) -> Grip:
    """Closes a hand on an object that floats, and says where its base and its fingers then are.

    Args:
        hand: as of `em.grasps.score`.
        object: what is gripped.
        grasp: the grasp frame in the object's frame, (4, 4).
        protocol: what the hand is to do with it, or a preset.
        step: of the simulation [s].

    Raises ValueError on bad arguments, and if the hand does not close on the object there.
    """
    found = preset(hand) if isinstance(hand, str) else hand
    does = protocol_of(protocol)
    trials = GraspTrials(found, object, does, step=step)
    where = numbers_of("grasp", grasp, "a pose (4, 4) of the hand", (4, 4))
    closed = trials.grip(Grasp(0, where, np.nan, np.eye(4)), trials.draw(-1))
    if closed.ending:
        raise ValueError(f"grasp is one whose hand {NO_GRIP[closed.ending]}")
    scene, _ = trials.scene(np.nan, trials.draw(-1), gravity=False)
    thing = pose(*body_poses(scene, closed.state)["object"])
    moving = [one.name for one in scene.joints if one.type != "fixed" and one.mimic is None]
    there = scene.unpack(closed.state)["joints"]
    joints = {name: float(there[name]["position"]) for name in moving}
    return Grip(found, does, np.linalg.inv(thing) @ closed.base, joints)
