"""What rolls over flush pieces, and what passes by an edge: neither meets anything."""

import math

import numpy as np
import pytest

import energymargin as em

SIDEWAYS = (math.sqrt(0.5), 0, 0, math.sqrt(0.5))


def roller(kind, radius):
    if kind == "ball":
        return em.Sphere(radius), (0, 0, 0, 1)
    solid = em.Cylinder(radius, radius) if kind == "cylinder" else em.Capsule(radius, radius)
    return solid, SIDEWAYS


def roll(kind, radius, speed, *, pieces=8, whole=False, step=1 / 240):
    """Speed at the end over that at the start, and the highest hop [m], over pieces of a floor."""
    scene = em.Scene(step=step)
    length = 2.0 / pieces
    boxes = [(em.Box((length, 1, 0.2)), ((i + 0.5) * length - 0.5, 0, -0.1)) for i in range(pieces)]
    if whole:
        floor = em.Compound([em.Part(box, place) for box, place in boxes])
        scene.add_body("floor", floor, mass=0, friction=1)
    else:
        for i, (box, place) in enumerate(boxes):
            scene.add_body(f"floor {i}", box, mass=0, position=place, friction=1)
    solid, orientation = roller(kind, radius)
    motion = {"velocity": (speed, 0, 0), "angular_velocity": (0, speed / radius, 0)}
    place = {"position": (0.01, 0.003, radius), "orientation": orientation}
    scene.add_body("body", solid, density=1000, friction=0.5, **place, **motion)
    played = em.World(scene).simulate(scene.pack(), round(1.0 / speed / step))
    assert played.lost_time == 0.0
    bodies = [scene.unpack(state)["body"] for state in played.states]
    hop = max(body["position"][2] for body in bodies) - radius
    return bodies[-1]["velocity"][0] / speed, hop


@pytest.mark.parametrize("kind", ["ball", "cylinder", "capsule"])
@pytest.mark.parametrize(("radius", "speed"), [(0.01, 0.3), (0.01, 1.5), (0.05, 0.3), (0.05, 1.5)])
@pytest.mark.parametrize("whole", [False, True])
def test_what_rolls_over_flush_pieces_keeps_its_speed(kind, radius, speed, whole):
    kept, hop = roll(kind, radius, speed, pieces=20, whole=whole)
    assert kept == pytest.approx(1.0, abs=1e-3)
    assert hop < 5e-6


@pytest.mark.parametrize("step", [1 / 60, 1 / 1000])
@pytest.mark.parametrize("kind", ["ball", "cylinder"])
def test_it_does_so_at_any_step(kind, step):
    kept, hop = roll(kind, 0.02, 0.5, step=step)
    assert kept == pytest.approx(1.0, abs=1e-3)
    assert hop < 5e-6


@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 1000])
@pytest.mark.parametrize("clearance", [1e-4, 1e-5])
@pytest.mark.parametrize("speed", [0.05, 0.3, 1.0, 3.0])
def test_a_ball_that_misses_an_edge_is_not_deflected(speed, clearance, step):
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=0)
    radius = 0.01
    place = {"position": (-0.1, 0.0037, 0.05 + radius + clearance), "velocity": (speed, 0, 0)}
    scene.add_body("ball", em.Sphere(radius), mass=0.01, **place)
    end = em.World(scene).simulate(scene.pack(), round(0.2 / speed / step)).states[-1]
    assert scene.unpack(end)["ball"]["velocity"] == pytest.approx([speed, 0, 0], abs=1e-6 * speed)


@pytest.mark.parametrize("step", [1 / 240, 1 / 1000])
def test_balls_that_miss_each_other_go_straight_on(step):
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    scene.add_body("a", em.Sphere(0.02), mass=0.1, position=(-0.2, 0, 0), velocity=(1.0, 0, 0))
    scene.add_body("b", em.Sphere(0.03), mass=0.1, position=(0.2, 0.0501, 0), velocity=(-1.0, 0, 0))
    end = scene.unpack(em.World(scene).simulate(scene.pack(), round(0.4 / step)).states[-1])
    assert end["a"]["velocity"] == pytest.approx([1, 0, 0], abs=1e-6)
    assert end["b"]["velocity"] == pytest.approx([-1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("step", [1 / 240, 1 / 1000])
def test_a_real_step_is_met(step):
    """By the angular momentum about its edge."""
    radius, height, speed = 0.05, 0.005, 1.5
    scene = em.Scene(step=step)
    low = em.Box((1, 1, 0.2))
    scene.add_body("low", low, mass=0, position=(-0.5, 0, -0.1), friction=1)
    scene.add_body("high", low, mass=0, position=(0.5, 0, height - 0.1), friction=1)
    motion = {"velocity": (speed, 0, 0), "angular_velocity": (0, speed / radius, 0)}
    at = {"position": (-0.2, 0.003, radius)}
    scene.add_body("ball", em.Sphere(radius), density=1000, friction=2.0, **at, **motion)
    states = em.World(scene).simulate(scene.pack(), round(0.25 / step)).states
    bodies = [scene.unpack(state)["ball"] for state in states]
    speeds = np.array([np.linalg.norm(body["velocity"]) for body in bodies])
    after = speeds[np.argmax(speeds < 0.99 * speed) + 1]
    share = 1 - height / radius / 1.4  # of the speed that is left
    assert after / speed == pytest.approx(share, abs=0.03)
    assert bodies[-1]["position"][2] > radius + 0.9 * height
