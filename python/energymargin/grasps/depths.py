"""How deep a hand and what is around it are in each other."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from energymargin import Compound, Plane, World, mass_properties
from energymargin.grasps.hands import Fitted
from energymargin.grasps.outcomes import State
from energymargin.scenes import pose, shape_parts

SUNK = 0.5  # share of the thinner body's half extent; a Problem refuses a state that is deeper


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
    return any(
        world.distance(state, a, b) < -SUNK * min(extents[a], extents[b])
        for a, b in combinations(extents, 2)
        if not {a, b} <= set(hand.bodies)
    )


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
