"""Bodies as boxes about them: how far their points get, how low they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from energymargin import Plan, Plane, Scene, mass_properties, scenes
from energymargin.base.aliases import Floats

Asked = tuple[Scene, Floats, Plan | None, float]
"""From a scene and a state on, for a plan and a horizon [s]."""
SIGNS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T


def movable(scene: Scene) -> list[str]:
    """Names of the bodies that forces move."""
    return [body.name for body in scene.bodies if not (body.fixed or body.kinematic)]


def require_contacts(scene: Scene, asked: str, otherwise: str = "") -> None:
    """Raises ValueError, which says what is asked, if the scene's engine tells no contacts."""
    if not isinstance(scene.engine, str):
        why = f"{asked} with the engine {scene.engine.name!r}, which tells no contacts"
        raise ValueError(f"{why}, expected {otherwise}scene.with_engine('native')")


def up_of(scene: Scene) -> Floats:
    """Unit vector against gravity, (3,). Raises ValueError without gravity."""
    gravity = np.array(scene.gravity)
    if not gravity.any():
        raise ValueError("scene is without gravity, expected some: nothing comes to rest in it")
    return np.asarray(-gravity / np.linalg.norm(gravity))


def center_of(body: Any, there: Mapping[str, Any]) -> Floats:
    """The centre of mass of a body that is `there`, as of `scene.unpack`, (3,)."""
    own = np.array((body.inertial or mass_properties(body.shape)).center)
    return moved(own, there["position"], there["orientation"])


def moved(points: Floats, position: ArrayLike, orientation: ArrayLike) -> Floats:
    """Points of a body's frame, (..., 3), where the body is."""
    return np.asarray(Rotation.from_quat(orientation).apply(points) + np.asarray(position))


def frame_of(scene: Scene) -> Floats:
    """Two horizontal axes and the one that is up, rows of (3, 3)."""
    up = up_of(scene)
    first = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first), up])


def box_of(shape: Any) -> Floats:
    """The corners of the box about a shape, along its frame's axes, (8, 3). No point of the shape
    is displaced farther than one of them. Its origin in place of a shape without parts."""
    points = np.concatenate(scenes.shape_parts(shape) or [np.zeros((1, 3))])
    return np.asarray(points.min(axis=0) + SIGNS * np.ptp(points, axis=0))


class Boxes:
    """The boxes of some bodies of a scene."""

    def __init__(self, scene: Scene, names: list[str]) -> None:
        """`names`: of bodies without planes."""
        shapes = {body.name: body.shape for body in scene.bodies}
        self._scene, self._boxes = scene, {name: box_of(shapes[name]) for name in names}

    def at(self, state: Floats) -> Floats:
        """Where their corners are in a state, (bodies, 8, 3)."""
        there = scenes.body_poses(self._scene, state) if self._boxes else {}
        placed = [moved(corners, *there[name]) for name, corners in self._boxes.items()]
        return np.array(placed).reshape(-1, 8, 3)


def farthest(corners: Floats, before: Floats) -> Floats:
    """How far a point of each body is from where it was, at most [m], (bodies,)."""
    return np.asarray(np.linalg.norm(corners - before, axis=2).max(axis=1, initial=0.0))


def lowest(scene: Scene, state: Floats) -> float:
    """The height of the lowest point of all bodies, along `up_of`; -inf above a plane."""
    up = up_of(scene)
    planes = {body.name: body.shape for body in scene.bodies if isinstance(body.shape, Plane)}
    if any(np.dot(plane.normal, up) > 0 for plane in planes.values()):
        return -np.inf
    names = [body.name for body in scene.bodies if body.name not in planes]
    return float((Boxes(scene, names).at(state) @ up).min(initial=np.inf))
