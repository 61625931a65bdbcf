"""The sets of a task: one for all objects, or that of each.

A task may have several objects. Its labels are then of two kinds: whether all of them are captured,
and whether at least one is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Region, Scene

__all__ = ["Regions", "all_inside", "any_inside", "set_of_object"]

Regions = Region | dict[str, Region]
"""A set of states, or the set of each object by its name."""


def set_of_object(sets: Regions, name: str | None) -> Region:
    """The set of an object, or the one for all if it has no name."""
    if isinstance(sets, dict) and name is not None:
        return sets[name]
    if isinstance(sets, dict) or name is not None:
        raise ValueError("`captured` gives one set for some states, and several for others")
    return sets


def all_inside(sets: Regions, scene: Scene, states: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether all objects are in their sets, of one state (n,) or of several (N, n)."""
    by_object = sets.values() if isinstance(sets, dict) else [sets]
    return np.asarray(np.all([r.contains(scene, states) for r in by_object], axis=0))


def any_inside(
    sets: Regions, scene: Scene, states: NDArray[np.float64]
) -> NDArray[np.bool_] | None:
    """Whether at least one object is in its set; None if there is one set for all."""
    if not isinstance(sets, dict):
        return None
    return np.asarray(np.any([r.contains(scene, states) for r in sets.values()], axis=0))
