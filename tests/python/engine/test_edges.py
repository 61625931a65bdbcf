"""Contacts at edges: faces that meet, pass or bear near an edge do it as sharp solids do."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from grips import GRAVITY, gripped

import energymargin as em

BLOCK = 0.2  # m, a cube that is far larger than what meets it, so its margin is too
STILL = 1e-5  # m
RIGID = em.Surface()
SOFT = em.Surface(stiffness=3000.0, damping=10.0)  # a load of 10 N presses it in by 0.8 mm
HARDER = em.Surface(stiffness=1e4, damping=10.0)


def cuboid(kind: str, *size: float) -> object:
    """A box, or a hull with its corners."""
    if kind == "box":
        return em.Box(size)
    return em.ConvexHull(list(itertools.product(*((-side / 2, side / 2) for side in size))))


def end(scene: em.Scene, seconds: float, **how: object) -> em.Scene:
    """All bodies after a time."""
    steps = round(seconds / scene.step)
    played = em.World(scene).simulate(scene.pack(), steps=steps, record=[steps], **how)
    return scene.unpack(played.states[0])


def pushed(force: float, steps: int) -> dict[str, np.ndarray]:
    """Along x."""
    return {"body": np.tile([force, 0.0, 0.0, 0.0, 0.0, 0.0], (steps, 1))}


@pytest.mark.parametrize("kind", ["box", "hull"])
@pytest.mark.parametrize("turned", [False, True])
def test_solids_that_are_apart_do_not_overlap(kind: str, turned: bool) -> None:
    random = np.random.default_rng(1)
    met = 0
    for _ in range(150):
        gap, aside = random.uniform(1e-4, 1e-3), random.uniform(-0.004, 0.004)
        yaw = random.uniform(-0.7, 0.7) if turned else 0.0
        reach = 0.05 * (abs(np.cos(yaw)) + abs(np.sin(yaw)))  # of the small one
        scene = em.Scene()
        scene.add_body("block", cuboid(kind, BLOCK, BLOCK, BLOCK), mass=0)
        place = (BLOCK / 2 + 0.05 + aside, BLOCK / 2 + reach + gap, 0.0)
        scene.add_body("body", cuboid(kind, 0.1, 0.1, 0.1), mass=1.0, position=place, yaw=yaw)
        contacts = em.World(scene).contacts(scene.pack())
        met += bool(contacts)
        assert all(contact.distance > 0.9 * gap for contact in contacts)
    assert turned or met > 20


@pytest.mark.parametrize("speed", [0.2, 3.0])
def test_what_passes_an_edge_is_not_touched(speed: float) -> None:
    random = np.random.default_rng(2)
    for size in (0.01, 0.1):
        for _ in range(10):
            scene = em.Scene(gravity=(0.0, 0.0, 0.0))
            scene.add_body("block", em.Box((2 * size,) * 3), mass=0)
            place = (-1.7 * size, 1.5 * size + random.uniform(2e-5, 7e-4), 0.0)
            scene.add_body(
                "body", em.Box((size,) * 3), mass=0.1, position=place, velocity=(speed, 0.0, 0.0)
            )
            body = end(scene, 4.0 * size / speed)["body"]
            np.testing.assert_allclose(body["velocity"], (speed, 0.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("kind", ["box", "hull"])
@pytest.mark.parametrize("width", [0.005, 0.06])
def test_a_plate_enters_a_slot_that_is_wider_and_no_narrower_one(kind: str, width: float) -> None:
    def place(share: float) -> float:
        scene = em.Scene(gravity=(0.0, 0.0, 0.0))
        for side in (-1.0, 1.0):
            at = (0.0, side * (BLOCK + width) / 2, 0.0)
            scene.add_body(f"block {side}", em.Box((BLOCK,) * 3), mass=0, position=at)
        scene.add_body(
            "body",
            cuboid(kind, 0.1, share * width, 0.1),
            mass=0.2,
            position=(-0.16, 0.0, 0.0),
            velocity=(0.1, 0.0, 0.0),
            linear_factor=(1, 1, 0),
            angular_factor=(0, 0, 1),
        )
        return float(end(scene, 1.0, drives=pushed(5.0, 240))["body"]["position"][0])

    assert place(0.995) > 0.0 and place(0.9) > 0.0
    assert place(1.002) < -0.149 and place(1.03) < -0.149


def test_a_drawer_with_little_play_closes() -> None:
    scene = em.Scene()
    sides = [em.Part(em.Box((0.27, 0.02, 0.14)), (0.0, side * 0.1601, 0.0)) for side in (-1, 1)]
    scene.add_body("cabinet", em.Compound(sides), mass=0)
    scene.add_body("body", em.Box((0.25, 0.3, 0.1)), mass=1.5, role="object")
    scene.add_body("rail", em.Box((0.01, 0.01, 0.01)), mass=0, position=(0.0, 0.0, -0.3))
    slide = {"type": "prismatic", "axis": (1, 0, 0), "origin": (0, 0, 0.3), "limits": (0, 0.5)}
    scene.add_joint("slide", parent="rail", child="body", start=0.35, **slide)
    joint = end(scene, 2.0, drives=pushed(-5.0, 480))["joints"]["slide"]
    assert abs(joint["position"]) < 1e-6


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("overlap", [0.0005, 0.002, 0.005])
def test_a_plank_lies_on_two_ledges(friction: float, overlap: float) -> None:
    scene = em.Scene()
    for side in (-1.0, 1.0):
        place = (side * (0.15 - overlap + BLOCK / 2), 0.0, -BLOCK / 2)
        name = f"block {side}"
        scene.add_body(name, em.Box((BLOCK,) * 3), mass=0, position=place, friction=friction)
    scene.add_body("plank", em.Box((0.3, 0.05, 0.02)), mass=0.5, position=(0, 0, 0.01), friction=1)
    np.testing.assert_allclose(end(scene, 2.0)["plank"]["position"], (0, 0, 0.01), atol=STILL)


@pytest.mark.parametrize(
    ("overlap", "surface"),
    [(0.0005, RIGID), (0.001, RIGID), (0.002, RIGID), (0.001, SOFT), (0.002, SOFT), (0.004, SOFT)],
)
def test_a_cube_is_held_by_its_rim(overlap: float, surface: em.Surface) -> None:
    below = 0.05 + 0.01 - overlap
    moved = gripped(em.Box((0.1,) * 3), 0.1, 0.9, below=below, pad=0.02, surface=surface)
    assert -moved[2] < 2e-5


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("surface", [RIGID, HARDER])
def test_flush_pieces_hold_no_more_than_one(seed: int, surface: em.Surface) -> None:
    random = np.random.default_rng(seed)
    cuts = np.sort(np.append(random.uniform(-0.09, 0.09, 6), (-0.1, 0.1)))
    cuts = cuts[np.append(True, np.diff(cuts) > 0.004)]
    slices = [
        em.Part(em.Box((0.04, 0.03, high - low)), (0.0, 0.0, (low + high) / 2))
        for low, high in itertools.pairwise(cuts)
    ]
    bar, pad = em.Compound(slices), random.uniform(0.015, 0.04)
    how = {"below": 0.0, "pad": pad, "surface": surface}
    assert -gripped(bar, 0.04, 0.97, **how)[2] < 2e-5
    one = em.Box((0.04, 0.03, cuts[-1] - cuts[0]))
    for load in (1.03, 1.2):
        sunk, right = (-gripped(shape, 0.04, load, **how)[2] for shape in (bar, one))
        assert sunk == pytest.approx(right, rel=0.02 if surface is RIGID else 0.05)
        assert sunk > 0.02


@pytest.mark.parametrize("floor", ["two", "pieces", "a lower one"])
@pytest.mark.parametrize("kind", ["box", "hull", "cylinder"])
@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_seams_of_a_floor_are_not_felt(floor: str, kind: str, speed: float) -> None:
    random = np.random.default_rng(3)
    friction = 0.1 * speed**2
    for thick in (0.02, 0.2):
        drop = 2e-4 if floor == "a lower one" else 0.0
        places = [(-0.5, 0.0, -thick / 2), (0.5, 0.0, -thick / 2 - drop)]
        scene = em.Scene()
        half = em.Box((1.0, 1.0, thick))
        if floor == "pieces":
            pieces = em.Compound([em.Part(half, place) for place in places])
            scene.add_body("floor", pieces, mass=0, friction=friction)
        else:
            for place in places:
                scene.add_body(f"{place}", half, mass=0, position=place, friction=friction)
        solid = em.Cylinder(0.04, 0.08) if kind == "cylinder" else cuboid(kind, 0.08, 0.08, 0.08)
        start = -0.1 - random.uniform(0.0, 0.01)
        scene.add_body(
            "body",
            solid,
            mass=0.5,
            friction=1.0,
            position=(start, 0.0, 0.04),
            yaw=random.uniform(-0.5, 0.5),
            velocity=(speed, 0.0, 0.0),
        )
        body = end(scene, 0.25 / speed)["body"]
        way = body["position"][0] - start
        paper = np.sqrt(speed**2 - 2.0 * friction * GRAVITY * way)
        assert body["velocity"][0] == pytest.approx(paper, rel=0.03 if drop else 0.01)
        assert -drop - STILL < body["position"][2] - 0.04 < STILL


@pytest.mark.parametrize("floor", ["two", "pieces"])
@pytest.mark.parametrize("kind", ["box", "hull", "cylinder"])
@pytest.mark.parametrize("surface", [(1000.0, 5.0), (5000.0, 5.0)])
def test_seams_are_not_felt_by_what_sinks_in(
    floor: str, kind: str, surface: tuple[float, float]
) -> None:
    stiffness, damping = surface
    how = {"mass": 0, "friction": 0.1, "surface": em.Surface(stiffness=stiffness, damping=damping)}
    for thick in (0.02, 0.2):
        places = [(side * 0.5, 0.0, -thick / 2) for side in (-1.0, 1.0)]
        half = em.Box((1.0, 1.0, thick))
        scene = em.Scene()
        if floor == "pieces":
            scene.add_body("floor", em.Compound([em.Part(half, place) for place in places]), **how)
        else:
            for place in places:
                scene.add_body(f"{place}", half, position=place, **how)
        solid = em.Cylinder(0.04, 0.08) if kind == "cylinder" else cuboid(kind, 0.08, 0.08, 0.08)
        place = {"position": (-0.1, 0.0, 0.04), "velocity": (1.0, 0.0, 0.0), "yaw": 0.3}
        scene.add_body("body", solid, mass=0.5, friction=1.0, **place)
        body = end(scene, 0.25)["body"]
        paper = np.sqrt(1.0 - 0.2 * GRAVITY * (body["position"][0] + 0.1))
        assert body["velocity"][0] == pytest.approx(paper, rel=0.03)
