"""Where a hand begins: states of an open hand beside an object."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Contact, Scene, World
from energymargin.grasps.hands import Fitted
from energymargin.grasps.outcomes import Pose, State
from energymargin.scenes import pose

__all__ = ["above_table", "approach_of", "hand_force", "state_of", "stepped_back"]


def state_of(scene: Scene, hand: Fitted, grasp: Pose, placed: Pose) -> State:
    """The open hand with its grasp frame at `grasp` and the object at `placed`, both (4, 4)."""
    base = grasp @ np.linalg.inv(hand.frame)
    return scene.pack(**{hand.base: _body(base), "object": _body(placed)}, joints=hand.start)


def above_table(world: World, hand: Fitted, state: State) -> State:
    """The hand lifted out of the table, in which it is no deeper than it may begin: it would stop
    there, as the hand's base does not yield."""
    if not any(body.name == "table" for body in world.scene.bodies):
        return state
    depth = -min(world.distance(state, one, "table") for one in hand.bodies)
    lifted = np.array(state)
    lifted[world.scene.slice(hand.base)][2] += max(depth, 0.0)
    return lifted


def _body(frame: Pose) -> dict[str, Any]:
    turned = Rotation.from_matrix(frame[:3, :3]).as_quat()
    meant = -turned if turned[0] > 0 else turned  # (1, 0, 0, 0) looks like one in another order
    return {"position": frame[:3, 3], "orientation": meant}


def stepped_back(distance: float) -> Pose:
    """A frame that stands so far back along its own z [m]."""
    back = np.eye(4)
    back[2, 3] = -distance
    return back


def approach_of(scene: Scene, hand: Fitted, state: State) -> NDArray[np.float64]:
    """The direction from which a hand comes, its grasp frame's z, (3,)."""
    base = scene.unpack(state)[hand.base]
    return (pose(base["position"], base["orientation"]) @ hand.frame)[:3, 2]


def hand_force(contacts: Iterable[Contact], hand: Fitted) -> float:
    """With which a hand presses on what is not of it [N], in sum."""
    return sum(
        contact.normal_force
        for contact in contacts
        if (contact.body_a in hand.bodies) != (contact.body_b in hand.bodies)
    )
