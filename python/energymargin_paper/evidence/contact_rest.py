"""What stays at rest: towers, a heavy box on a light one, an arch, and a house of cards."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin._core import Box, ConvexHull, Scene, mass_properties
from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_statics import Mass, Touch, required_friction
from energymargin_paper.evidence.contact_traces import MILLI, Trace, simulated

__all__ = [
    "Structure",
    "Tower",
    "arch",
    "card_house",
    "heavy_on_light",
    "moved",
    "stands",
    "tower",
    "tower_scene",
]

EDGE = 0.1  # m, of the towers' cubes
FRICTION = 0.6  # of two cubes
SETTLING = 0.5  # s
FRAMES = 24  # steps between two looks

STONES = 7
INNER, THICK, DEPTH = 0.5, 0.2, 0.3  # m, of the arch
CARD = 0.06  # m, depth of a card
RIDGE, LIP, HEIGHT = 0.006, 0.006, 0.12  # m
LEAN = math.radians(25.0)  # of a card, from upright
LEANS = (math.radians(15.0), math.radians(35.0))


class Tower(NamedTuple):
    """What a tower does."""

    settled: float
    """Largest way of a cube's centre in the first half second [mm]."""
    wander: float
    """Largest way from there on, of any cube [mm]."""
    fastest: float
    """Largest speed from there on, of any cube [mm/s]."""


class Structure(NamedTuple):
    """Bodies that stand on each other, with what statics ask of their friction."""

    scene: Scene
    required: float
    """Least coefficient of friction with which they can stand."""


def tower_scene(
    cubes: int, seed: int = 0, friction: float = FRICTION, step: float | None = None
) -> Scene:
    """Cubes of 1 kg on a plane, each turned and moved by chance a little (seed 0: straight)."""
    random, scene = np.random.default_rng(seed), Scene() if step is None else Scene(step=step)
    own = math.sqrt(friction)
    scene.add_plane("floor", friction=own)
    turn = random.uniform(0, 2 * math.pi) if seed else 0.0
    for number in range(cubes):
        aside = random.uniform(-0.005, 0.005, 2) if seed else np.zeros(2)
        yaw = turn + (random.uniform(-0.2, 0.2) if seed else 0.0)
        place = (*aside, EDGE * (number + 0.5))
        scene.add_body(
            f"cube{number}", Box((EDGE,) * 3), mass=1.0, position=place, yaw=yaw, friction=own
        )
    return scene


def tower(cubes: int, seed: int = 0, duration: float = 10.0) -> Tower:
    """How a tower settles in the first half second, and what it does in `duration` from then on."""
    scene = tower_scene(cubes, seed)
    trace = simulated(scene, SETTLING + duration, every=FRAMES)
    names = [f"cube{number}" for number in range(cubes)]
    after = trace.at(SETTLING)
    places = np.array([trace.position(name) for name in names])
    velocities = np.array([trace.of(name, "velocity") for name in names])[:, after:]
    settled = np.linalg.norm(places[:, : after + 1] - places[:, :1], axis=2).max()
    wander = np.linalg.norm(places[:, after:] - places[:, after : after + 1], axis=2).max()
    fastest = np.linalg.norm(velocities, axis=2).max()
    return Tower(*(float(MILLI * value) for value in (settled, wander, fastest)))


def heavy_on_light(ratio: float = 1000.0, seed: int = 0, duration: float = 10.0) -> float:
    """How far a heavy box, or the light one below it, goes from its place [mm]."""
    random, scene = np.random.default_rng(seed), Scene()
    scene.add_plane("floor", friction=1.0)
    light, yaw = 0.01, float(random.uniform(0, 2 * math.pi)) if seed else 0.0
    size = (EDGE,) * 3
    scene.add_body("light", Box(size), mass=light, position=(0, 0, EDGE / 2), yaw=yaw, friction=0.6)
    place = (0.0, 0.0, 1.5 * EDGE)
    scene.add_body("heavy", Box(size), mass=ratio * light, position=place, yaw=yaw, friction=0.6)
    return max(moved(simulated(scene, duration, every=FRAMES), ("light", "heavy")))


def moved(trace: Trace, bodies: Sequence[str]) -> list[float]:
    """The largest distance of each body from its start [mm]."""
    places = (trace.position(body) for body in bodies)
    return [float(MILLI * np.linalg.norm(p - p[0], axis=1).max()) for p in places]


def stands(
    make: Callable[[float, int], Structure], share: float, seed: int = 0, duration: float = 5.0
) -> tuple[float, float]:
    """How far the worst body of an `arch` or `card_house` goes [mm], and the friction it has.

    `share`: the coefficient over what statics require.
    """
    friction = share * make(1.0, seed).required
    scene = make(friction, seed).scene
    names = [body.name for body in scene.bodies if not body.fixed]
    return max(moved(simulated(scene, duration, every=FRAMES), names)), friction


def arch(friction: float, seed: int = 0) -> Structure:
    """Seven stones in a half circle, on the floor; a coefficient of friction for all pairs.

    Seed 0 is 20 cm thick and along x, others are thinner or thicker, and turned.
    """
    random = np.random.default_rng(seed)
    outer = INNER + (float(random.uniform(0.15, 0.35)) if seed else THICK)
    turns = np.linspace(math.pi, 0.0, STONES + 1)
    hulls = {}
    for number in range(STONES):
        corners = [
            (radius * math.cos(turn), side, radius * math.sin(turn))
            for radius in (INNER, outer)
            for turn in turns[number : number + 2]
            for side in (-DEPTH / 2, DEPTH / 2)
        ]
        hulls[f"stone{number}"] = np.array(corners)
    touches = []
    for number, turn in enumerate(turns):
        along = np.array((math.sin(turn), 0.0, -math.cos(turn)))  # towards the right foot
        left = f"stone{number - 1}" if number else "floor"
        right = f"stone{number}" if number < STONES else "floor"
        for radius in (INNER, outer):
            for side in (-DEPTH / 2, DEPTH / 2):
                point = np.array((radius * math.cos(turn), side, radius * math.sin(turn)))
                touches.append(Touch(right, left, point, along))
    return _structure(hulls, touches, friction, 2000.0, _yaw(random, seed))


def card_house(friction: float, seed: int = 0) -> Structure:
    """Two cards that lean at each other and one that lies on their ridge.

    The leaning cards meet in an upright face, stand on a level one, and bear the third one on a
    level one, so that every contact is one of faces. Seed 0 leans by 25 degrees, along x.
    """
    random = np.random.default_rng(seed)
    slope = math.tan(random.uniform(*LEANS) if seed else LEAN)
    foot, inner = RIDGE + HEIGHT * slope, (HEIGHT - LIP) * slope
    outline = [(0.0, HEIGHT), (RIDGE, HEIGHT), (foot, 0.0), (inner, 0.0), (0.0, HEIGHT - LIP)]
    sides = (-CARD / 2, CARD / 2)
    hulls = {
        name: np.array([(sign * x, y, z) for x, z in outline for y in sides])
        for name, sign in (("right", 1.0), ("left", -1.0))
    }
    top = [(x, y, z) for x in (-CARD / 2, CARD / 2) for y in sides for z in (HEIGHT, HEIGHT + LIP)]
    hulls["top"] = np.array(top)
    up, across = np.array((0.0, 0.0, 1.0)), np.array((1.0, 0.0, 0.0))
    touches = []
    for name, sign in (("right", 1.0), ("left", -1.0)):
        feet = [np.array((sign * x, y, 0.0)) for x in (inner, foot) for y in sides]
        ridge = [np.array((sign * x, y, HEIGHT)) for x in (0.0, RIDGE) for y in sides]
        touches += [Touch(name, "floor", point, up) for point in feet]
        touches += [Touch("top", name, point, up) for point in ridge]
    faces = [np.array((0.0, y, z)) for y in sides for z in (HEIGHT - LIP, HEIGHT)]
    touches += [Touch("right", "left", point, across) for point in faces]
    return _structure(hulls, touches, friction, 800.0, _yaw(random, seed))


def _yaw(random: np.random.Generator, seed: int) -> float:
    return float(random.uniform(0.0, 2.0 * math.pi)) if seed else 0.0


def _structure(
    hulls: Mapping[str, Floats],
    touches: Sequence[Touch],
    friction: float,
    density: float,
    yaw: float,
) -> Structure:
    """Hulls of points in the world, each about its middle, on a floor, turned about its z axis."""
    own, scene, bodies = math.sqrt(friction), Scene(), {}
    turn = Rotation.from_euler("z", yaw)
    scene.add_plane("floor", friction=own)
    for name, points in hulls.items():
        middle = points.mean(axis=0)
        hull = ConvexHull(points - middle)
        place = turn.apply(middle)
        scene.add_body(name, hull, density=density, position=place, yaw=yaw, friction=own)
        solid = mass_properties(hull)
        bodies[name] = Mass(density * solid.volume, middle + solid.center)
    return Structure(scene, required_friction(bodies, touches))
