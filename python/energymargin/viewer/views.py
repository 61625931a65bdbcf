"""What of a scene is looked at: where the bodies that matter move, and the ground below them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Plane, Problem, Scene
from energymargin.outlines import body_poses, placed, shape_parts

__all__ = ["View", "is_flat", "object_places", "view_around"]

AROUND = 0.08  # of the longest side, around what moves
AROUND_ONE = 0.6  # around a state alone, of which nobody knows where it leads
LEVEL = 0.02  # of the view: what is lifted less stays on the ground
SIDES = (("x", "y"), ("z", "x"))  # planes of outlines that show all three axes


class View(NamedTuple):
    """A box [m] that holds what matters."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    floor: float
    """Height of the ground, or of the lowest point if there is none."""

    @property
    def size(self) -> float:
        """Its longest side [m]."""
        return float((self.high - self.low).max())

    @property
    def center(self) -> NDArray[np.float64]:
        """Its middle."""
        return np.asarray((self.low + self.high) / 2)


def view_around(scene: Scene, states: Iterable[NDArray[np.float64]]) -> View:
    """A view of objects and effector in these states."""
    corners, states = [], list(states)
    shown = [body for body in scene.bodies if body.role != "none"]
    for state in states:
        poses = body_poses(scene, state)
        for body in shown:
            for part in shape_parts(body.shape):
                flat = placed(part, poses[body.name], SIDES[0])
                height = placed(part, poses[body.name], SIDES[1])[:, :1]
                corners.append(np.concatenate([flat, height], axis=1))
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    share = AROUND if len(states) > 1 else AROUND_ONE
    around = share * float((high - low).max())
    floor = _ground(scene)
    return View(low - around, high + around, float(low[2]) if floor is None else floor)


def object_places(scene: Scene) -> list[list[int]]:
    """Which numbers of a state are the places of the objects' centres, three of each object."""
    starts = [scene.slice(body.name).start for body in scene.bodies if body.role == "object"]
    return [[start, start + 1, start + 2] for start in starts]


def is_flat(problem: Problem, states: NDArray[np.float64], view: View) -> bool:
    """Whether no object is lifted or tipped: neither in these states, shape (K, n), nor by the
    disturbance."""
    if problem.force[2] != 0.0 or np.any(problem.torque[:2] != 0.0):
        return False
    heights = [states[:, place[2]] for place in object_places(problem.scene)]
    return all(float(np.ptp(height)) < LEVEL * view.size for height in heights)


def _ground(scene: Scene) -> float | None:
    """The height of the highest level plane."""
    level = [
        body.shape.offset
        for body in scene.bodies
        if isinstance(body.shape, Plane) and body.shape.normal[2] > 0.99
    ]
    return max(level, default=None)
