"""One grasp, a hand on its way to it, and what became of its trials.

A hand begins open, beside the object: where that is, and how deep it is in anything there.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import Compound, Contact, Plane, Scene, World, mass_properties
from energymargin.base.aliases import Floats
from energymargin.grasps.hands import Fitted
from energymargin.scenes import pose, shape_parts

ENDINGS = ("held", "slipped", "turned", "not gripped", "collided", "diverged")
SUNK = 0.5  # share of the thinner body's half extent; a Problem refuses a state that is deeper
NO_GRIP = {
    "collided": "is in the object or the table",
    "not gripped": "does not close on the object",
    "diverged": "diverges as it closes",
}

State = NDArray[np.float64]


class Grasp(NamedTuple):
    """One grasp."""

    number: int
    pose: Floats
    """The grasp frame in the object's frame, (4, 4)."""
    opening: float
    """Of the hand before it closes [m]; NaN: as wide as it opens."""
    placed: Floats
    """The object's frame in the world's, (4, 4)."""


class Outcome(NamedTuple):
    """What became of one trial."""

    ending: str
    """One of ENDINGS."""
    time: float = np.nan
    """When it was lost, after the hand had closed [s]; inf: it was held, NaN: it did not grip."""
    redrawn: int = 0
    """Poses that were drawn again, since the hand was inside the object or the table."""
    back: float = 0.0
    """How far the hand was moved back along its approach, out of what it was in [m]."""
    steps: int = 0
    """Of the simulation, while the hand closes and later."""
    unconverged: int = 0
    """Of these, steps whose contact solver did not converge."""
    lost_time: float = 0.0
    """In which nothing moved, as bodies would have passed through each other [s]."""


class Closed(NamedTuple):
    """A hand that has closed, or why it could not."""

    hand: Fitted
    state: State
    """Where the hand closed; if it had no place, or diverged, where it began, open."""
    base: Floats
    """The frame of the hand's base, (4, 4)."""
    thing: Floats
    """The object's axes about its centre of mass in the frame of the hand's base, (4, 4)."""
    outcome: Outcome
    """Of the trial so far; `ending` is "" if all of its fingers press on the object."""

    @property
    def ending(self) -> str:
        """That of the outcome."""
        return self.outcome.ending


class HandStart(NamedTuple):
    """A hand where it begins to close."""

    state: State | None
    """None: the hand was inside the object or the table, and found no place."""
    redrawn: int = 0
    back: float = 0.0


def state_of(scene: Scene, hand: Fitted, grasp: Floats, placed: Floats) -> State:
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


def _body(frame: Floats) -> dict[str, Any]:
    turned = Rotation.from_matrix(frame[:3, :3]).as_quat()
    meant = -turned if turned[0] > 0 else turned  # (1, 0, 0, 0) looks like one in another order
    return {"position": frame[:3, 3], "orientation": meant}


def stepped_back(distance: float) -> Floats:
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
