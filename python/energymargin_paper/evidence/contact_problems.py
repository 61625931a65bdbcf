"""Contacts as questions of the margin: lifted and held cubes, balls in a cup, plates in a gap."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin import regions
from energymargin._core import (
    Box,
    Compound,
    Cylinder,
    Part,
    Plan,
    Problem,
    Scene,
    Sphere,
    capture_probability,
    escape_effort,
)
from energymargin.base.plausibility import PlausibilityWarning
from energymargin_paper.evidence.contact_grips import CUBE, REACH, RISE, grip_scene, random_grip
from energymargin_paper.evidence.contact_traces import simulated, steps_of

__all__ = ["Refined", "balls_outside", "lifted", "plate_effort", "refined_grip"]

SLACK = 0.01  # m from its place in the hand: as far as a captured object goes

FORCE, FRICTION = 10.0, 0.4  # N of each finger, and of a pair: friction bears 8 N
LIFT = 1.0  # m/s^2, up and then down again
MASS = 0.2  # kg, of the lifted cube
LOAD = 1.8  # N of the disturbance, up or down and aside: with weight and lift 4.4 N at most

BALL, WALL, ROOM = 0.005, 0.002, 0.03  # m: radius of a ball, walls and inner width of the cup
SHAKE, RATE = 2.0, 5.0  # m/s and Hz

GAP, POST, ROOM_OF_PLATE = 0.03, 0.005, 0.1  # m: between posts, their radius, edge of the room


class Refined(NamedTuple):
    """A probability at two steps."""

    default: float
    eighth: float


def lifted(seed: int = 0, *, lifts: bool = True, rollouts: int = 300) -> float:
    """Probability that a cube stays in a gripper that lifts it, under loads far below friction.

    Loads of at most 4.4 N against 8 N of friction: on paper it is 1. `lifts`: or the hand rests.
    """
    scene = Scene()
    scene.add_body("palm", Box((0.1, 0.04, 0.02)), mass=1.0, position=(0, 0, 0.1), kinematic=True)
    cube = Box((CUBE,) * 3)
    scene.add_body("object", cube, mass=MASS, friction=1.0, role="object")
    for name, side in (("left", 1.0), ("right", -1.0)):
        scene.add_body(name, Box((0.01, 0.02, 0.02)), mass=0.1, friction=FRICTION, role="effector")
        scene.add_joint(
            name,
            type="prismatic",
            parent="palm",
            child=name,
            origin=(-side * (CUBE / 2 + 0.005), 0.0, -0.1),
            axis=(side, 0.0, 0.0),
            target=REACH,
            stiffness=FORCE / RISE,
            torque_limit=FORCE,
        )
    horizon = 1.0
    steps = steps_of(scene, horizon)
    velocities = np.zeros((steps, 6))
    if lifts:
        times = scene.step * np.arange(1, steps + 1)
        velocities[:, 2] = LIFT * np.minimum(times, horizon - times)
    problem = Problem(
        scene,
        scene.pack(),
        force=(0.0, LOAD, LOAD),
        torque=(0.0, 0.0, 0.0),
        duration=0.1,
        captured=_in_hand("palm", -0.1),
        plan=Plan(step=scene.step, velocities={"palm": velocities}),
        horizon=horizon,
    )
    return _probability(problem, rollouts, seed)


def refined_grip(seed: int, rollouts: int = 300) -> Refined:
    """The probability that a random grip holds under random loads, at two steps of the scene.

    The loads reach beyond what friction bears, so that it is neither 0 nor 1.
    """
    grip = replace(random_grip(seed, share=0.4), load=(0.0, 0.0, -1.0))
    random = np.random.default_rng((seed, 1))
    bound = float(random.uniform(0.75, 1.2)) * grip.limit  # against .6 of it that are left
    found = []
    for parts in (1, 8):
        scene = grip_scene(replace(grip, step=1.0 / 240.0 / parts))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PlausibilityWarning)  # of heavy objects
            problem = Problem(
                scene,
                scene.pack(),
                force=(0.0, 0.0, bound),
                torque=(0.0, 0.0, 0.0),
                duration=0.1,
                captured=_in_hand(None, 0.0),
                horizon=0.5,
            )
        found.append(_probability(problem, rollouts, seed))
    return Refined(*found)


def balls_outside(seed: int, duration: float = 2.0) -> int:
    """How many of four balls of 1 cm are outside of a shaken closed cup in the end, or ever were.

    The cup of walls of 2 mm goes to and fro at 2 m/s and 5 Hz, in a random direction and phase.
    """
    random, scene = np.random.default_rng(seed), Scene()
    scene.add_body("cup", _cup(), mass=1.0, friction=0.7, kinematic=True)
    places = [(x, y) for x in (-0.007, 0.007) for y in (-0.007, 0.007)]
    for number, (x, y) in enumerate(places):
        place = (x, y, -ROOM / 2 + BALL + float(random.uniform(0.0, 0.01)))
        scene.add_body(
            f"ball{number}", Sphere(BALL), mass=0.004, position=place, friction=0.7, role="object"
        )
    steps = steps_of(scene, duration)
    direction, phase = random.normal(size=3), random.uniform(0, 2 * math.pi)
    direction /= np.linalg.norm(direction)
    turn = 2 * math.pi * RATE * scene.step * np.arange(steps) + phase
    velocities = np.zeros((steps, 6))
    velocities[:, :3] = SHAKE * np.sin(turn)[:, None] * direction
    plan = Plan(step=scene.step, velocities={"cup": velocities})
    trace = simulated(scene, duration, plan=plan)
    inverse = Rotation.from_quat(trace.of("cup", "orientation")).inv()
    outside = 0
    for number in range(len(places)):
        way = inverse.apply(trace.position(f"ball{number}") - trace.position("cup"))
        outside += bool(np.abs(way).max() > ROOM / 2 + WALL / 2)
    return outside


def plate_effort(excess: float, seed: int, nodes: int = 200, force: float = 3.0) -> float:
    """The effort at which a square plate is pushed through a gap that is too narrow for it [J].

    `excess`: the plate's edge over the gap between two fixed posts, in the wall of a closed room.
    The plate moves in the plane of the room. On paper there is no escape: a square is nowhere
    narrower than its edge.
    """
    random = np.random.default_rng(seed)
    edge, scene = GAP * excess, Scene(gravity=(0, 0, 0))
    _add_room(scene, posts=str(random.choice(("boxes", "cylinders"))))
    mass, friction = random.uniform((0.05, 0.1), (0.5, 0.7))
    scene.add_body(
        "object",
        Box((edge, edge, float(random.uniform(0.005, 0.03)))),
        mass=mass,
        position=(-POST - edge / 2 - random.uniform(0.0, 0.01), 0.0, 0.0),
        friction=friction,
        role="object",
        linear_factor=(1, 1, 0),
        angular_factor=(0, 0, 1),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)  # of heavy plates
        problem = Problem(
            scene,
            scene.pack(),
            force=(force, force, 0.0),
            torque=(0.0, 0.0, force * edge / 2),
            duration=0.3,
            captured=regions.HalfSpace("object", (1.0, 0.0, 0.0), 0.0),
        )
        return escape_effort(problem, nodes=nodes, seed=seed).effort


def _add_room(scene: Scene, posts: str) -> None:
    """A square room on the left of x = 0, with two posts there and a gap between them."""
    thick, deep = 2 * POST, 0.1
    long = (ROOM_OF_PLATE - GAP) / 2
    middle = (ROOM_OF_PLATE + thick) / 2
    walls = {
        "west": ((thick, ROOM_OF_PLATE + 2 * thick), (-ROOM_OF_PLATE - thick, 0.0)),
        "south": ((ROOM_OF_PLATE + 2 * thick, thick), (-ROOM_OF_PLATE / 2, -middle)),
        "north": ((ROOM_OF_PLATE + 2 * thick, thick), (-ROOM_OF_PLATE / 2, middle)),
    }
    short = long if posts == "boxes" else long - POST  # a cylinder ends a wall roundly
    for name, side in (("lower", -1.0), ("upper", 1.0)):
        walls[name] = ((thick, short), (0.0, side * (ROOM_OF_PLATE - short) / 2))
        if posts == "cylinders":
            place = (0.0, side * (GAP / 2 + POST), 0.0)
            scene.add_body(f"{name} post", Cylinder(POST, deep), mass=0.0, position=place)
    for name, (size, middle_of) in walls.items():
        scene.add_body(name, Box((*size, deep)), mass=0.0, position=(*middle_of, 0.0))


def _cup() -> Compound:
    """Six walls around a room."""
    parts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            size, place = np.full(3, ROOM + 2 * WALL), np.zeros(3)
            size[axis], place[axis] = WALL, side * (ROOM + WALL) / 2
            parts.append(Part(Box(size), place))
    return Compound(parts)


def _in_hand(frame: str | None, height: float) -> regions.Region:
    size = (2 * SLACK,) * 3
    return regions.Box("object", (0.0, 0.0, height), size, frame=frame)


def _probability(problem: Problem, rollouts: int, seed: int) -> float:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)
        return capture_probability(problem, rollouts=rollouts, seed=seed).captured
