"""The four scenes of `make bench-contact`, and how wrong an engine's answer is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import energymargin as em
from contact_engines import Engine, Ours, Played
from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_grips import Grip, grip_scene, pair_of_fingers
from energymargin_paper.evidence.contact_push import Push, corners, coulomb, push_scene
from energymargin_paper.evidence.contact_rest import tower_scene

__all__ = ["SCENES", "Judged", "Question", "judged"]

MILLI = 1e3
STEP = 1 / 240  # s
BELOW, ABOVE, FALL = 0.9, 1.05, 20.0  # of a grip's limit; mm: it has fallen
CUBES = 10
SQUEEZE = 4.5  # N of each finger of the hand: friction bears 5.8 N of a weight of 2 N


@dataclass(frozen=True)
class Question:
    """A scene and how wrong what an engine does with it is."""

    name: str
    what: str
    """The error, with its unit."""
    make: Callable[[float], em.Scene]
    """By the step [s]."""
    times: tuple[float, ...]
    """At which poses are looked at [s]."""
    error: Callable[[em.Scene, Played], float]
    """From what was played [mm]."""


@dataclass(frozen=True)
class Judged:
    """An engine's answer."""

    error: float
    """[mm]"""
    step: float
    """Time of a step, median [s]."""
    second: float
    """Time of a simulated second, median [s]."""
    falls: bool | None
    """Whether a grip falls above its limit; None: it is no grip."""


def judged(question: Question, engine: Engine, runs: int) -> Judged:
    """An engine's error, and its times of so many runs."""
    scene = question.make(STEP / engine.parts if isinstance(engine, Ours) else STEP)
    played = [engine.play(scene, question.times) for _ in range(runs)]
    seconds = float(np.median([run.seconds for run in played]))
    error = question.error(scene, played[0])
    falls = None
    if question.name == "grip":
        fallen = engine.play(_grip(scene.step, ABOVE), question.times)
        falls = abs(_sink(scene, fallen)) > FALL
    return Judged(error, seconds / played[0].steps, seconds / played[0].duration, falls)


def _grip(step: float, share: float = BELOW) -> em.Scene:
    return grip_scene(Grip(pair_of_fingers(), share, step=step))


def _tower(step: float) -> em.Scene:
    return tower_scene(CUBES, step=step)


def _push(step: float) -> em.Scene:
    return push_scene(Push(), step)


def _hand(step: float) -> em.Scene:
    """Two fingers of two links that squeeze a cube and hold it against its weight.

    Their torques balance a force at the cube's middle, so that it stays where it is.
    """
    scene = em.Scene(step=step)
    scene.add_body("palm", em.Box((0.1, 0.04, 0.02)), mass=0.0, position=(0, 0, 0.11))
    scene.add_body("cube", em.Box((0.04,) * 3), mass=0.2, friction=0.8, role="object")
    hinges = {"upper": (0.05, 0.095), "lower": (0.06, 0.045)}  # m: length, height above the middle
    for name, side in (("left", -1.0), ("right", 1.0)):
        parent, origin = "palm", (side * 0.025, 0.0, -0.015)
        for link, (length, height) in hinges.items():
            body = f"{name} {link}"
            scene.add_body(
                body, em.Box((0.01, 0.02, length)), mass=0.05, friction=0.8, role="effector"
            )
            scene.add_joint(
                body,
                parent=parent,
                child=body,
                origin=origin,
                child_origin=(0, 0, length / 2),
                axis=(0, side, 0),
                target=SQUEEZE * height,
                stiffness=1.0,
                damping=0.005,
            )
            parent, origin = body, (0.0, 0.0, -length / 2)
        scene.disable_collisions("palm", f"{name} lower")
    return scene


def _sink(scene: em.Scene, played: Played) -> float:
    path = played.poses["object"]
    start = scene.unpack(scene.pack())["object"]["position"]
    return float(MILLI * abs(path[-1, 2] - start[2]))


def _wander(scene: em.Scene, played: Played) -> float:
    """The largest way of a cube from where it is after half a second."""
    ways = [np.linalg.norm(p[:, :3] - p[0, :3], axis=1).max() for p in played.poses.values()]
    return float(MILLI * max(ways))


def _way(scene: em.Scene, played: Played) -> float:
    """Way of the corner of the cube that is furthest from its start [m]."""
    size = (0.04,) * 3
    start = _corners(scene.pack()[scene.slice("cube")][:7], size)
    return _furthest(start, _corners(played.poses["cube"][-1], size))


def _apart(scene: em.Scene, played: Played) -> float:
    """Distance of the box's corner that is furthest from its end on paper [m]."""
    ends = corners(coulomb(Push())), corners(played.poses["box"][-1])
    return _furthest(*ends)


def _corners(pose: Floats, size: Sequence[float]) -> Floats:
    """Corners of a box of a size about a frame, shape (8, 3) [m]."""
    signs = np.stack(np.meshgrid(*([-0.5, 0.5],) * 3), axis=-1).reshape(-1, 3)
    corners: Floats = pose[:3] + Rotation.from_quat(pose[3:]).apply(signs * size)
    return corners


def _furthest(one: Floats, other: Floats) -> float:
    return float(MILLI * np.linalg.norm(one - other, axis=1).max())


SCENES = (
    Question("grip", f"sink after 1 s at {BELOW:g} of the limit [mm]", _grip, (1.0,), _sink),
    Question(
        f"tower of {CUBES}",
        "wander of a cube in 5 s [mm]",
        _tower,
        tuple(np.arange(0.5, 5.51, 0.1).round(1).tolist()),
        _wander,
    ),
    Question("push", "corner of the box after 1 s [mm]", _push, (1.0,), _apart),
    Question("hand", "way of a corner of the cube in 1 s [mm]", _hand, (1.0,), _way),
)
