"""Frames of a recording as states of a scene without overlaps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin import Scene, World
from energymargin.base.checks import positive_number
from energymargin.base.reprs import Record
from energymargin.records.recordings.poses import planar
from energymargin.records.recordings.recording import Motion, Recording
from energymargin.scenes import moved_apart

MOST_OVERLAP = 0.01  # m; an arm's error of 5 to 8 mm, and a camera's
UPRIGHT = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Placed(Record):
    """K frames of a recording of B bodies in a scene."""

    states: NDArray[np.float64]
    """State vector of each frame, shape (K, n)."""
    moved: NDArray[np.float64]
    """Distances by which the bodies were moved out of an overlap [m], shape (K, B), in the order of
    the recording, tools last: of object and effector."""
    stuck: NDArray[np.bool_]
    """Frames as measured, whose bodies overlap wherever they are moved to, shape (K,)."""


def placed(
    recording: Recording,
    scene: Scene,
    *,
    object: str = "object",
    effector: str = "effector",
    most_overlap: float = MOST_OVERLAP,
) -> Placed:
    """The recording's frames as states of a scene.

    Poses and velocities are those of the recording, and all else is that of the scene, as the
    height of a body that moves in the plane. `object` and `effector` are what these bodies of the
    recording are called in the scene; other bodies have the same names in both. Bodies that overlap
    are moved until they touch: each out of what stands in the scene and of those before it, tools
    last; along the ground alone, if all bodies move in the plane. Raises ValueError on a body that
    is unknown, fixed or a link, on one that is tilted in the scene and moves in the plane, where a
    body would be moved by more than `most_overlap` [m], and if no frame at all has a place for all,
    as between two others.
    """
    most_overlap = positive_number("most_overlap", most_overlap)
    heights = {body.name: body.position[2] for body in scene.bodies}
    tools = {effector, *(body.name for body in scene.bodies if body.role == "effector")}
    motions = recording.in_scene(object, effector)
    _require_bodies(recording, scene, {"object": object, "effector": effector})
    names = sorted(motions, key=tools.__contains__)
    starts = [scene.slice(name).start for name in names]
    in_plane = [_moves_in_plane(scene, name, motions[name]) for name in names]
    ways = (1.0, 1.0, 0.0 if all(in_plane) else 1.0)
    world, states, reasons = World(scene), np.empty((len(recording), scene.dimension)), {}
    for k in range(len(recording)):
        poses = {name: motion.at(k, heights[name]) for name, motion in motions.items()}
        states[k] = scene.pack(**poses)
    measured = states.copy()
    for k, number in enumerate(recording.frames.tolist()):
        try:
            states[k] = moved_apart(world, measured[k], names, directions=ways)
        except ValueError as error:
            reasons[k] = f"{recording.name}, frame {number}: {error}"
    if len(reasons) == len(recording):
        raise ValueError(f"{reasons[0]}; so it is in every frame: do the shapes fit?")
    stuck = np.isin(np.arange(len(recording)), list(reasons))
    apart = [(states - measured)[:, start : start + 3] for start in starts]
    moved = np.linalg.norm(np.stack(apart, axis=1), axis=2)
    if moved.max() > most_overlap:
        k, body = divmod(int((moved > most_overlap).argmax()), len(names))
        raise ValueError(
            f"{recording.name}, frame {recording.frames[k]}: {names[body]!r} overlaps others by "
            f"{moved[k, body]:.3g} m, expected at most most_overlap = {most_overlap:g} m: do the "
            "shapes, the units and the origin of the camera's frame fit?"
        )
    return Placed(states, moved, stuck)


def _require_bodies(recording: Recording, scene: Scene, given: dict[str, str]) -> None:
    """Raises ValueError on a body that the scene does not have, with the way out."""
    known = ", ".join(body.name for body in scene.bodies)
    for body in recording.bodies:
        name = given.get(body, body)
        if name not in [one.name for one in scene.bodies]:
            way = f"{body}=NAME says how it is called there" if body in given else "rename one"
            raise ValueError(
                f"{recording.name} has the body {body!r}, and the scene has no {name!r}: {way}, "
                f"one of {known}"
            )


def _moves_in_plane(scene: Scene, name: str, motion: Motion) -> bool:
    """Whether a body moves in the plane; ValueError if it does, and is tilted in the scene."""
    start = scene.slice(name).start
    if planar(motion.poses) and math.hypot(*scene.pack()[start + 3 : start + 5]) > UPRIGHT:
        raise ValueError(
            f"body {name!r} is tilted in the scene, expected one that is turned about z alone"
        )
    return planar(motion.poses)
