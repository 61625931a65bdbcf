"""Where a hand begins: states of an open hand beside an object, and how deep it is in anything."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Compound, Contact, Plane, Scene, World, mass_properties
from energymargin.grasps.hands import Fitted
from energymargin.grasps.outcomes import Pose, State
from energymargin.scenes import pose, shape_parts

SUNK = 0.5  # share of the thinner body's half extent; a Problem refuses a state that is deeper


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
    own = set(hand.bodies)
    return sum(c.normal_force for c in contacts if len({c.body_a, c.body_b} & own) == 1)


def clearance(world: World, hand: Fitted, state: State) -> float:
    """From the hand to all else, negative in it [m].

    `World.contacts` would tell of the end of a step in which the drives close the fingers.
    """
    others = [body.name for body in world.scene.bodies if body.name not in hand.bodies]
    return min(world.distance(state, one, other) for one in hand.bodies for other in others)


def is_sunk(world: World, hand: Fitted, state: State) -> bool:
    """Whether two bodies are so deep in each other that no Problem can start there, of which one at
    least is not of the hand."""
    extents = {body.name: smallest_half_extent(body.shape) for body in world.scene.bodies}
    pairs = [pair for pair in combinations(extents, 2) if not set(pair) <= set(hand.bodies)]
    return any(world.distance(state, a, b) < -SUNK * min(extents[a], extents[b]) for a, b in pairs)


def smallest_half_extent(shape: Any) -> float:
    """Half the extent of a shape along its thinnest principal axis [m], of several parts that of
    the thickest one; inf of a plane, and without parts."""
    if isinstance(shape, Plane):
        return np.inf
    extents = []
    for solid in (part.shape for part in shape.parts) if isinstance(shape, Compound) else (shape,):
        axes = pose((0, 0, 0), mass_properties(solid).axes)[:3, :3]
        extents.append(np.ptp(shape_parts(solid)[0] @ axes, axis=0).min())
    return float(max(extents, default=np.inf)) / 2
