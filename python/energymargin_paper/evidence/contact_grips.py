"""Grips: an object between pads that press at its faces, and what friction bears of its weight.

A finger is a pad on a rail with a drive of limited force (`links`), or a free body that a constant
force presses and that moves along one axis alone (`bodies`). Either way each pad presses with a
known force F, so that Coulomb's law says what the grip bears: the sum of mu F over the pads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import Box, Capsule, ConvexHull, Cylinder, Inertial, Scene, Sphere
from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_statics import Pad, largest_weight
from energymargin_paper.evidence.contact_traces import GRAVITY, MILLI, simulated

__all__ = [
    "KINDS",
    "PADS",
    "Finger",
    "Grip",
    "Held",
    "four_fingers",
    "grip_scene",
    "hold",
    "off_centre_limits",
    "opposed_fingers",
    "pair_of_fingers",
    "pinch",
    "preloaded_slip",
    "random_grip",
    "star_of_fingers",
]

KINDS = ("links", "bodies")
PADS = ("box", "thin box", "cylinder", "capsule", "hull")

PAD = 0.02  # m: width and height of a pad
THICKNESS = 0.01  # m: of a pad
THIN = 0.002  # m: of a thin one
CUBE = 0.04  # m: edge of the object
REACH = 0.01  # m inside the object: the target of a drive, so far that the drive is at its limit
RISE = 0.002  # m: error of the position at which a drive reaches its limit
DURATION = 1.0  # s


class Held(NamedTuple):
    """What the object did."""

    sink: float
    """Way of the centre of mass along the load [mm]."""
    creep: float
    """Speed along the load in the last half [mm/s]."""
    wander: float
    """Largest distance from the start, in any direction [mm]."""


@dataclass(frozen=True)
class Finger:
    """One pad and how it presses."""

    direction: tuple[float, float, float]
    """In which it presses, a horizontal unit vector."""
    force: float
    """[N]"""
    aside: float = 0.0
    """Place of the pad's middle, to the left of the direction [m]."""


@dataclass(frozen=True)
class Grip:
    """An object in a grip, and the weight that it has."""

    fingers: tuple[Finger, ...]
    share: float = 0.9
    """Weight over what friction bears."""
    kind: str = "links"
    """One of KINDS."""
    pad: str = "box"
    """One of PADS."""
    friction: float = 0.5
    """Coefficient of pads and object."""
    mass: float = 0.1
    """Mass of each pad [kg]."""
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the object's mass, in its frame [m]."""
    load: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """Direction of the load, a unit vector; what is not downward is a constant force."""
    object_mass: float | None = None
    """[kg]; the load is then a force and there is no gravity. By default the load is the weight."""
    preload: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A force on the object beside the load, over what friction bears."""
    step: float | None = None
    """Step of the scene [s]; by default the default one."""

    @property
    def limit(self) -> float:
        """What friction bears of a load through the middle [N]."""
        return self.friction * sum(finger.force for finger in self.fingers)


def pair_of_fingers(force: float = 10.0) -> tuple[Finger, ...]:
    """Two that press at each other."""
    return Finger((1.0, 0.0, 0.0), force), Finger((-1.0, 0.0, 0.0), force)


def opposed_fingers(force: float = 10.0, apart: float = CUBE) -> tuple[Finger, ...]:
    """Three: one, and two opposite to it at either side that share its force."""
    one = Finger((1.0, 0.0, 0.0), force)
    others = (Finger((-1.0, 0.0, 0.0), force / 2, side * apart / 2) for side in (-0.55, 0.55))
    return one, *others


def four_fingers(force: float = 10.0) -> tuple[Finger, ...]:
    """Two pairs across each other."""
    across = (Finger((0.0, side, 0.0), force) for side in (1.0, -1.0))
    return *pair_of_fingers(force), *across


def star_of_fingers(force: float = 10.0, count: int = 3) -> tuple[Finger, ...]:
    """Some, evenly around the vertical axis: of three, only on rails (`links`)."""
    turns = [2.0 * math.pi * number / count for number in range(count)]
    return tuple(Finger((math.cos(turn), math.sin(turn), 0.0), force) for turn in turns)


def random_grip(seed: int, share: float) -> Grip:
    """Two, three or four fingers of a random kind, pad, mass, force and friction."""
    random = np.random.default_rng(seed)
    kind, pad = str(random.choice(KINDS)), str(random.choice(PADS))
    force = float(np.exp(random.uniform(math.log(2.0), math.log(50.0))))
    arrangements = [pair_of_fingers, pair_of_fingers, opposed_fingers, four_fingers]
    if kind == "links":
        arrangements.append(star_of_fingers)
    arrange = arrangements[int(random.integers(len(arrangements)))]
    mass = float(np.exp(random.uniform(math.log(0.01), math.log(2.0))))
    friction = float(random.uniform(0.2, 1.0))
    return Grip(arrange(force), share, kind, pad, friction, mass)


def hold(grip: Grip, duration: float = DURATION) -> Held:
    """What the object does in a grip from rest, the pads just touching."""
    trace = simulated(grip_scene(grip), duration)
    turns = Rotation.from_quat(trace.of("object", "orientation"))
    path = MILLI * (trace.position("object") + turns.apply(grip.center))
    ways = path - path[0]
    sink, half = ways @ np.array(grip.load), trace.at(duration / 2)
    creep = (sink[-1] - sink[half]) / (trace.times[-1] - trace.times[half])
    return Held(float(sink[-1]), float(creep), float(np.linalg.norm(ways, axis=1).max()))


def off_centre_limits(grip: Grip) -> tuple[float, float]:
    """Between which shares a grip of square pads slips, if its mass is not in the middle.

    The lower one is the load that friction bears where the corners of a pad press alike, the upper
    one the largest load that any pressures at the corners bear.
    """
    half = PAD / 2
    pads = []
    for finger in grip.fingers:
        along = np.array(finger.direction)
        left = np.cross((0.0, 0.0, 1.0), along)
        middle = -CUBE / 2 * along + finger.aside * left
        corners = [middle + y * left + (0.0, 0.0, z) for y in (-half, half) for z in (-half, half)]
        pads.append(Pad(corners, along, finger.force))
    center = np.array(grip.center)
    weights = (
        largest_weight(pads, center, grip.friction, load=grip.load, even=even)
        for even in (True, False)
    )
    low, high = (weight / grip.limit for weight in weights)
    return low, high


def pinch(
    force: float = 5.0,
    *,
    swing: float = math.pi / 2,
    aside: float = 0.009,
    step: float | None = None,
) -> float:
    """How fast the contacts of two spherical fingertips wander over a cube's faces [mm/s].

    They hold the cube of 50 g off its middle, so that it swings about the axis between them, which
    points cannot keep it from. Friction is ample. `swing`: where it starts, from hanging [rad].
    """
    radius, seconds = 0.008, 1.0
    scene = Scene() if step is None else Scene(step=step)
    scene.add_body("palm", Box((0.01,) * 3), mass=0.0, position=(0, 0, 1.0))
    cube, place = Box((CUBE,) * 3), aside * np.array((0.0, math.sin(swing), -math.cos(swing)))
    scene.add_body("object", cube, mass=0.05, friction=1.0, role="object", position=place)
    for name, side in (("left", 1.0), ("right", -1.0)):
        scene.add_body(name, Sphere(radius), mass=0.1, friction=1.0, role="effector")
        scene.add_joint(
            name,
            type="prismatic",
            parent="palm",
            child=name,
            origin=(-side * (CUBE / 2 + radius), 0.0, -1.0),
            axis=(side, 0.0, 0.0),
            target=REACH,
            stiffness=force / RISE,
            torque_limit=force,
        )
    trace = simulated(scene, seconds)
    inverse = Rotation.from_quat(trace.of("object", "orientation")).inv()
    wander = 0.0
    for name in ("left", "right"):
        path = inverse.apply(trace.position(name) - trace.position("object"))[:, 1:]
        wander = max(wander, float(np.linalg.norm(path - path[0], axis=1).max()))
    return MILLI * wander / seconds


def preloaded_slip(grip: Grip, tolerance: float = 0.002, slide: float = 5.0) -> float:
    """The share of what friction bears at which the object slides more than `slide` [mm] in 1 s.

    By bisection; with a preload of .7 across it is sqrt(1 - .49) = .714 on paper.
    """
    low, high = 0.0, 1.5
    while high - low > tolerance:
        middle = (low + high) / 2
        if hold(replace(grip, share=middle)).sink > slide:
            high = middle
        else:
            low = middle
    return (low + high) / 2


def grip_scene(grip: Grip) -> Scene:
    """The object in the middle, at the origin, and the pads around it."""
    weight, falls = grip.share * grip.limit, grip.object_mass is None
    gravity = weight * np.array(grip.load) / _mass(grip) if falls else np.zeros(3)
    scene = Scene(gravity) if grip.step is None else Scene(gravity, grip.step)
    force = np.array(grip.preload) * grip.limit
    if not falls:
        force = force + weight * np.array(grip.load)
    shape, face = _object(grip.fingers)
    scene.add_body(
        "object",
        shape,
        mass=_mass(grip),
        friction=1.0,
        role="object",
        force=force,
        **_inertial(grip),
    )
    if grip.kind == "links":
        scene.add_body("palm", Box((0.01, 0.01, 0.01)), mass=0.0, position=(0, 0, 1.0))
        scene.disable_collisions("palm", "object")
    for number, finger in enumerate(grip.fingers):
        _add_finger(scene, grip, f"finger{number}", finger, face)
    return scene


def _mass(grip: Grip) -> float:
    """Mass of the object [kg]: with gravity of 9.81 m/s^2 it weighs what the share says."""
    if grip.object_mass is not None:
        return grip.object_mass
    return grip.share * grip.limit / GRAVITY


def _inertial(grip: Grip) -> dict[str, Any]:
    """Inertia of the object, if its mass is not in the middle: that of an even cube, moved."""
    if not any(grip.center):
        return {}
    moments = np.full(3, _mass(grip) * CUBE**2 / 6)
    return {"inertial": Inertial(grip.center, inertia=moments)}


def _object(fingers: Sequence[Finger]) -> tuple[Any, float]:
    """A cube, or a prism with three faces towards three fingers; how far the faces are [m]."""
    if all(abs(x) in (0.0, 1.0) for finger in fingers for x in finger.direction):
        return Box((CUBE, CUBE, CUBE)), CUBE / 2
    face = CUBE / 2
    radius = face / math.cos(math.pi / 6)  # of the corners of a hexagon
    corners = [
        (radius * math.cos(turn), radius * math.sin(turn), z)
        for turn in np.radians(np.arange(30, 390, 60))
        for z in (-CUBE / 2, CUBE / 2)
    ]
    return ConvexHull(corners), face


def _add_finger(scene: Scene, grip: Grip, name: str, finger: Finger, face: float) -> None:
    shape, depth, turn = _pad(grip.pad)
    along = np.array(finger.direction)
    left = np.cross((0.0, 0.0, 1.0), along)
    yaw = math.atan2(along[1], along[0])
    place = -(face + depth) * along + finger.aside * left
    body: dict[str, Any] = {"mass": grip.mass, "friction": grip.friction, "position": place}
    orientation = _times(_about_z(yaw), turn)
    if grip.kind == "bodies":
        # The pads are held against the load of gravity, which acts on them too, by their locks.
        body["linear_factor"], body["angular_factor"] = np.abs(along).round(), (0, 0, 0)
        body["force"] = finger.force * along
        scene.add_body(name, shape, orientation=orientation, role="effector", **body)
        return
    scene.add_body(name, shape, orientation=orientation, role="effector", **body)
    scene.add_joint(
        name,
        type="prismatic",
        parent="palm",
        child=name,
        origin=place - (0.0, 0.0, 1.0),
        orientation=_about_z(yaw),
        child_orientation=_inverse(turn),
        axis=(1.0, 0.0, 0.0),
        target=REACH,
        stiffness=finger.force / RISE,
        torque_limit=finger.force,
    )


def _pad(pad: str) -> tuple[Any, float, Floats]:
    """Its shape, how far its face is from its middle [m], and its turn in the finger's frame."""
    none, z_to_x = (
        np.array((0.0, 0.0, 0.0, 1.0)),
        np.array((0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))),
    )
    half = PAD / 2
    match pad:
        case "box":
            return Box((THICKNESS, PAD, PAD)), THICKNESS / 2, none
        case "thin box":
            return Box((THIN, PAD, PAD)), THIN / 2, none
        case "cylinder":
            return Cylinder(half, THICKNESS), THICKNESS / 2, z_to_x
        case "capsule":
            return Capsule(THICKNESS / 2, PAD), THICKNESS / 2, none
        case "hull":
            face = [(THICKNESS / 2, y, z) for y in (-half, half) for z in (-half, half)]
            back = [(-THICKNESS / 2, y, z) for y in (-half / 2, half / 2) for z in (-half, half)]
            return ConvexHull([*face, *back]), THICKNESS / 2, none
    raise ValueError(f"pad is {pad!r}, expected one of {', '.join(PADS)}")


def _about_z(yaw: float) -> Floats:
    return np.array((0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def _inverse(turn: Floats) -> Floats:
    return turn * (-1.0, -1.0, -1.0, 1.0)


def _times(a: Floats, b: Floats) -> Floats:
    """The product of two quaternions (x, y, z, w): b first."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array((*vector, a[3] * b[3] - a[:3] @ b[:3]))
