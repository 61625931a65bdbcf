"""Bodies of all shapes in a closed cup that shakes and turns: they go along, and stay inside."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import energymargin as em

STEP = 1 / 240  # s
DURATION = 2.0  # s
SIDES = 10
BODIES = 3
RIGID = em.Surface()


class Cup(NamedTuple):
    """Its inner radius and height, and how thick its walls are [m]."""

    radius: float
    height: float
    wall: float

    def shape(self) -> em.Compound:
        """Walls that overlap at the edges, between a floor and a lid that stand out."""
        side = em.Box((self.wall, 2.1 * self.radius * math.tan(math.pi / SIDES), self.height))
        parts = []
        for turn in np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False):
            place = (self.radius * math.cos(turn), self.radius * math.sin(turn), self.height / 2)
            parts.append(em.Part(side, place, (0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2))))
        for height in (-self.wall / 2, self.height + self.wall / 2):
            end = em.Cylinder(radius=1.15 * self.radius, length=self.wall)
            parts.append(em.Part(end, (0.0, 0.0, height)))
        return em.Compound(parts)

    def encloses(self, place: np.ndarray) -> bool:
        aside = math.hypot(place[0], place[1])
        room = self.wall + 0.06 * self.radius
        return aside < self.radius + room and -room < place[2] < self.height + room


def solid(kind: str, size: float, random: np.random.Generator) -> object:
    if kind == "sphere":
        return em.Sphere(size)
    if kind == "box":
        return em.Box((size, 1.5 * size, 2.0 * size))
    if kind == "capsule":
        return em.Capsule(radius=size / 2, length=size)
    points = random.normal(size=(12, 3))
    return em.ConvexHull(size * points / np.linalg.norm(points, axis=1)[:, None])


def shaken(
    kind: str, seed: int, *, turns: bool, surface: em.Surface = RIGID
) -> tuple[bool, float, float]:
    """Whether all stayed, the fastest of them [m/s], and the lost time [s]."""
    random = np.random.default_rng(seed)
    cup = Cup(*random.uniform((0.03, 0.05, 0.001), (0.05, 0.09, 0.003)))
    scene = em.Scene(step=STEP)
    scene.add_body(
        *("cup", cup.shape()),
        mass=1.0,
        kinematic=True,
        role="effector",
        friction=0.6,
        surface=surface,
    )
    for i in range(BODIES):
        place = (0.012 * math.cos(1.57 * i), 0.012 * math.sin(1.57 * i), 0.015 + 0.012 * (i // 2))
        scene.add_body(
            f"body {i}",
            solid(kind, random.uniform(0.003, 0.0055), random),
            density=math.exp(random.uniform(math.log(300.0), math.log(8000.0))),
            position=place,
            friction=random.uniform(0.1, 0.9),
            role="object",
        )
    steps = round(DURATION / STEP)
    times = (np.arange(steps) + 0.5) * STEP
    rows = np.zeros((steps, 6))
    for axis in range(6):
        most, rates = (2.5, (2.0, 6.0)) if axis < 3 else (6.0 * turns, (1.0, 4.0))
        angle = 2.0 * math.pi * random.uniform(*rates) * times + random.uniform(0.0, 6.0)
        rows[:, axis] = most * random.uniform(0.2, 1.0) * np.cos(angle)
    world = em.World(scene, em.Plan(step=STEP, velocities={"cup": rows}))
    played = world.simulate(scene.pack(), steps=steps, record=list(range(0, steps + 1, 12)))
    stayed, fastest = True, 0.0
    for state in played.states:
        bodies = scene.unpack(state)
        turned = Rotation.from_quat(bodies["cup"]["orientation"]).inv()
        for i in range(BODIES):
            body = bodies[f"body {i}"]
            stayed &= cup.encloses(turned.apply(body["position"] - bodies["cup"]["position"]))
            fastest = max(fastest, float(np.linalg.norm(body["velocity"])))
    return stayed, fastest, played.lost_time


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("kind", ["sphere", "box", "hull", "capsule"])
def test_what_is_shaken_goes_along(kind: str, turns: bool) -> None:
    runs = [shaken(kind, seed, turns=turns) for seed in range(100, 108)]
    assert all(stayed for stayed, _, _ in runs)
    assert max(fastest for _, fastest, _ in runs) < 6.0
    assert max(lost for *_, lost in runs) < 0.1 * DURATION
    assert np.median([lost for *_, lost in runs]) < 0.02 * DURATION


@pytest.mark.parametrize("surface", [{"stiffness": 3e4, "damping": 1.0}, {"restitution": 0.9}])
@pytest.mark.parametrize("kind", ["sphere", "box", "hull", "capsule"])
def test_what_gives_way_or_bounces_goes_along(kind: str, surface: dict[str, float]) -> None:
    runs = [
        shaken(kind, seed, turns=turns, surface=em.Surface(**surface))
        for seed in range(100, 103)
        for turns in (False, True)
    ]
    assert all(stayed for stayed, _, _ in runs)
    assert max(fastest for _, fastest, _ in runs) < 12.0
    assert max(lost for *_, lost in runs) < 0.1 * DURATION


def left_a_box(seed: int, spin: float, speed: float) -> bool:
    """Whether a cube of 16 mm gets out of a closed box of 80 mm within a second."""
    random = np.random.default_rng(seed)
    half, wall = 0.04, 0.002
    parts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            size, place = np.full(3, 2.0 * (half + wall)), np.zeros(3)
            size[axis], place[axis] = wall, side * (half + wall / 2)
            parts.append(em.Part(em.Box(tuple(size)), tuple(place)))
    scene = em.Scene(step=STEP)
    scene.add_body("box", em.Compound(parts), mass=1.0, kinematic=True, friction=1.0)
    place = random.uniform(-0.022, 0.022, 3)
    scene.add_body("cube", em.Box((0.016,) * 3), mass=0.05, position=place, role="object")
    times = (np.arange(240) + 0.5) * STEP
    ways, turns = (each / np.linalg.norm(each) for each in random.normal(size=(2, 3)))
    late = random.uniform(0.0, 6.28)
    shakes = np.outer(np.sin(6.0 * math.pi * times), speed * ways)
    spins = np.outer(np.sin(6.0 * math.pi * times + late), spin * turns)
    plan = em.Plan(step=STEP, velocities={"box": np.hstack([shakes, spins])})
    for state in em.World(scene, plan).simulate(scene.pack(), steps=240).states:
        bodies = scene.unpack(state)
        turn = Rotation.from_quat(bodies["box"]["orientation"]).inv()
        inside = turn.apply(bodies["cube"]["position"] - bodies["box"]["position"])
        if np.abs(inside).max() > half:
            return True
    return False


def test_a_cube_stays_in_a_box_that_spins_fast() -> None:
    assert [seed for seed in range(40) if left_a_box(seed, spin=30.0, speed=3.0)] == []
