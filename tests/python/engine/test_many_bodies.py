"""Many bodies that are pressed together: what rests stays, and nearly all steps converge."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import energymargin as em

SETTLED = 240  # steps


def moved(scene: em.Scene, steps: int) -> tuple[float, em.Simulation]:
    """The longest way of an object after the first steps [m], and the simulation of these steps."""
    world = em.World(scene)
    started = world.simulate(scene.pack(), steps=steps).states[-1]
    played = world.simulate(started, steps=steps)
    ends = (scene.unpack(started), scene.unpack(played.states[-1]))
    names = [body.name for body in scene.bodies if body.role == "object"]
    ways = [ends[1][name]["position"] - ends[0][name]["position"] for name in names]
    return float(max(np.linalg.norm(way) for way in ways)), played


def row_at_a_wall(force: float) -> em.Scene:
    """Five boxes in a row, the last of which a force presses against a wall [N]."""
    scene = em.Scene()
    scene.add_plane("floor", friction=0.5)
    scene.add_body("wall", em.Box((0.1, 1.0, 1.0)), mass=0.0, position=(-0.05, 0.0, 0.5))
    random = np.random.default_rng(0)
    for i in range(5):
        scene.add_body(
            *(f"box {i}", em.Box((0.1, 0.1, 0.1))),
            mass=0.5,
            position=(0.05 + 0.103 * i, random.uniform(-0.02, 0.02), 0.05),
            yaw=random.uniform(-0.05, 0.05),
            force=(-force if i == 4 else 0.0, 0.0, 0.0),
            role="object",
        )
    return scene


def deck_of_cards(cards: int, thickness: float) -> em.Scene:
    """Cards on each other, a little shifted and turned [m]."""
    scene = em.Scene()
    scene.add_plane("floor", friction=0.5)
    random = np.random.default_rng(0)
    for i in range(cards):
        x, y, yaw = random.uniform(-1.0, 1.0, 3) * (0.002, 0.002, 0.05)
        scene.add_body(
            *(f"card {i}", em.Box((0.063, 0.088, thickness))),
            density=1000.0,
            friction=0.3,
            position=(x, y, thickness * (i + 0.5)),
            yaw=yaw,
            role="object",
        )
    return scene


def bin_of_boxes(boxes: int, friction: float) -> em.Scene:
    """Boxes that fall into a narrow bin, four a layer."""
    width, height, wall, size = 0.2, 0.6, 0.02, (0.04, 0.05, 0.06)
    scene = em.Scene()
    scene.add_plane("floor", friction=friction)
    parts = []
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        sides = (wall, width + 2 * wall, height) if x else (width + 2 * wall, wall, height)
        parts.append(em.Part(em.Box(sides), (x * 0.11, y * 0.11, height / 2)))
    scene.add_body("bin", em.Compound(parts), mass=0.0, friction=friction)
    random = np.random.default_rng(1)
    room = math.hypot(*size)
    for i in range(boxes):
        layer, place = divmod(i, 4)
        turn = random.normal(size=4)
        scene.add_body(
            *(f"box {i}", em.Box(size)),
            mass=0.1,
            friction=friction,
            position=(0.1 * (place // 2) - 0.05, 0.1 * (place % 2) - 0.05, room * (layer + 0.6)),
            orientation=turn / np.linalg.norm(turn),
            role="object",
        )
    return scene


def test_boxes_pressed_against_a_wall_stay() -> None:
    way, played = moved(row_at_a_wall(200.0), SETTLED)
    assert way < 1e-4
    assert (played.unconverged, played.lost_time) == (0, 0.0)


def test_contacts_of_a_thin_card_reach_the_next_one_alone() -> None:
    scene = deck_of_cards(12, 0.0003)
    touching = {
        frozenset((contact.body_a, contact.body_b))
        for contact in em.World(scene).contacts(scene.pack())
    }
    names = ["floor", *(f"card {i}" for i in range(12))]
    assert touching == {frozenset(pair) for pair in itertools.pairwise(names)}


def test_deck_of_cards_rests() -> None:
    way, played = moved(deck_of_cards(52, 0.0003), 60)
    assert way < 1e-4
    assert (played.unconverged, played.lost_time) == (0, 0.0)


@pytest.mark.parametrize("friction", [0.5, 1.0])
def test_boxes_poured_into_a_bin_stay_in_it_and_steps_converge(friction: float) -> None:
    scene = bin_of_boxes(54, friction)
    world = em.World(scene)
    played = world.simulate(scene.pack(), steps=240)
    assert played.unconverged <= 0.02 * 240
    bodies = scene.unpack(played.states[-1])
    places = np.array([bodies[f"box {i}"]["position"] for i in range(54)])
    below = 54 if friction < 1.0 else 53  # at 1 the bin is full before the last one comes
    assert np.abs(places[:below, :2]).max() < 0.1
    assert places[:, 2].min() > 0.0
    assert world.energy(played.states[-1]) < world.energy(scene.pack())


def test_forces_between_poured_boxes_are_in_their_cones_and_bear_what_they_carry() -> None:
    scene = bin_of_boxes(54, friction=1.0)
    world = em.World(scene)
    state = world.simulate(scene.pack(), steps=480).states[-1]
    after = world.simulate(state, steps=1)
    assert after.unconverged == 0
    contacts = world.contacts(state)
    for contact in contacts:
        most = contact.friction * contact.normal_force
        assert np.linalg.norm(contact.tangential_force) <= most * (1 + 1e-6) + 1e-9
    changed = scene.unpack(after.states[-1])
    for i, body in enumerate(scene.unpack(state)[f"box {i}"] for i in range(54)):
        forces = [
            (1.0 if contact.body_a == f"box {i}" else -1.0)
            * (contact.normal_force * contact.normal + contact.tangential_force)
            for contact in contacts
            if f"box {i}" in (contact.body_a, contact.body_b)
        ]
        gain = changed[f"box {i}"]["velocity"] - body["velocity"]
        pulled = np.sum(forces, axis=0) + 0.1 * np.array(scene.gravity)
        assert np.abs(0.1 * gain * 240 - pulled).max() < 1e-3
