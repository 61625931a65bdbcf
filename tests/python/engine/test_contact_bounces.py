"""What bounces beside other bodies: one pair after another, and no energy from nowhere."""

import math

import numpy as np
import pytest

import energymargin as em

G = 9.81
RADIUS = 0.02


def row_after_a_blow(masses, restitution, gap, *, step=1 / 240):
    """Speeds of a row of balls at rest that the first one hits with 1 m/s."""
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    surface = em.Surface(restitution=restitution)
    for i, mass in enumerate(masses):
        at = i * (2 * RADIUS + gap) - (0.05 if i == 0 else 0.0)
        motion = {"position": (at, 0, 0), "velocity": (float(i == 0), 0, 0)}
        ball = em.Sphere(RADIUS)
        scene.add_body(f"{i}", ball, mass=mass, friction=0, surface=surface, **motion)
    played = em.World(scene).simulate(scene.pack(), round(1 / step))
    assert played.unconverged == 0 and played.lost_time == 0.0
    end = scene.unpack(played.states[-1])
    return np.array([end[f"{i}"]["velocity"][0] for i in range(len(masses))])


def speeds_pair_by_pair(masses, restitution):
    """The fastest pair first: that which is closest in time where all gaps are the same."""
    speeds = np.zeros(len(masses))
    speeds[0] = 1.0
    while (closing := -np.diff(speeds)).max() > 0.1:
        i = int(np.argmax(closing))
        a, b = masses[i], masses[i + 1]
        impulse = (1 + restitution) * closing[i] * a * b / (a + b)
        speeds[i] -= impulse / a
        speeds[i + 1] += impulse / b
    return speeds


@pytest.mark.parametrize("gap", [0.0, 1e-4, 1e-3, 4e-3])
@pytest.mark.parametrize(
    ("masses", "restitution"),
    [
        ((0.1, 0.1, 0.1), 1.0),
        ((0.1,) * 5, 1.0),
        ((0.1, 0.3, 0.2), 0.8),
        ((0.3, 0.1, 0.2, 0.05, 0.4), 1.0),
    ],
)
def test_a_blow_goes_through_a_row_pair_by_pair(masses, restitution, gap):
    right = speeds_pair_by_pair(masses, restitution)
    found = row_after_a_blow(masses, restitution, gap)
    assert found == pytest.approx(right, abs=2e-3)


@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 1000])
def test_two_balls_that_come_into_a_row_send_out_two(step):
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    for i in range(5):
        motion = {"position": (2 * RADIUS * i - 0.03 * (i < 2), 0, 0), "velocity": (i < 2, 0, 0)}
        surface = em.Surface(restitution=1.0)
        scene.add_body(f"{i}", em.Sphere(RADIUS), mass=0.1, friction=0, surface=surface, **motion)
    end = scene.unpack(em.World(scene).simulate(scene.pack(), round(0.5 / step)).states[-1])
    speeds = [end[f"{i}"]["velocity"][0] for i in range(5)]
    assert speeds == pytest.approx([0, 0, 0, 1, 1], abs=1e-3)


@pytest.mark.parametrize("gap", [0.0, 1e-3, 5e-3, 20e-3])
def test_a_small_ball_on_a_large_one_leaves_at_three_times_the_speed(gap):
    scene = em.Scene()
    surface = em.Surface(restitution=1.0)
    scene.add_plane("floor", surface=surface, friction=0)
    balls = (("large", 0.05, 1.0, 0.55), ("small", 0.02, 0.01, 0.62 + gap))
    for name, radius, mass, height in balls:
        upright = {"position": (0, 0, height), "linear_factor": (0, 0, 1), "friction": 0}
        scene.add_body(name, em.Sphere(radius), mass=mass, surface=surface, **upright)
    states = em.World(scene).simulate(scene.pack(), 120).states
    fastest = max(scene.unpack(state)["small"]["velocity"][2] for state in states)
    right = (3 - 0.01) / (1 + 0.01) * math.sqrt(2 * G * 0.5)
    assert fastest == pytest.approx(right, rel=0.01)


def balls_in_a_box(seed, *, count=6, gravity=0.0, friction=0.0, boxes=False, step=1 / 240):
    random = np.random.default_rng(seed)
    scene = em.Scene(step=step, gravity=(0, 0, -gravity))
    room, radius = 0.3, 0.05
    for axis in range(3):
        for side in (-1, 1):
            size, place = np.full(3, 1.0), np.zeros(3)
            size[axis], place[axis] = 0.2, side * (room + 0.1)
            wall = em.Box(tuple(size))
            scene.add_body(f"{axis}{side}", wall, mass=0, position=place, friction=friction)
    places = []
    while len(places) < count:
        place = random.uniform(-room + 2 * radius, room - 2 * radius, 3)
        if all(np.linalg.norm(place - other) > 4 * radius for other in places):
            places.append(place)
    surface = em.Surface(restitution=1.0)
    for i, place in enumerate(places):
        size = radius * random.uniform(0.6, 1)
        motion = {"position": place, "velocity": random.normal(size=3)}
        if boxes:
            motion["angular_velocity"] = 3 * random.normal(size=3)
        solid = em.Box((1.5 * size, 2 * size, size)) if boxes else em.Sphere(size)
        how = {"mass": random.uniform(0.1, 1), "friction": friction, "surface": surface}
        scene.add_body(f"ball {i}", solid, **how, **motion)
    return scene


def energies(scene, duration):
    """Energy [J] of each step, with the velocities of that time: they lag by half a step."""
    world = em.World(scene)
    start = scene.pack()
    played = world.simulate(start, round(duration / scene.step))
    assert played.lost_time < 1e-9
    states = np.array([start, *played.states])
    for body in scene.bodies:
        if body.mass > 0:
            states[:, scene.slice(body.name).start + 9] += 0.5 * scene.step * scene.gravity[2]
    return np.array([world.energy(state) for state in states])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("gravity", [0.0, G])
@pytest.mark.parametrize("how", [{}, {"friction": 0.5}, {"friction": 0.5, "boxes": True}])
def test_elastic_bodies_in_a_box_gain_no_energy(seed, gravity, how):
    scene = balls_in_a_box(seed, gravity=gravity, **how)
    found = energies(scene, 20.0 if not how else 5.0)
    moving = found[0] + sum(body.mass for body in scene.bodies) * gravity * 0.3
    assert found.max() < found[0] + 1e-3 * moving
    if not how:
        assert found[-1] > found[0] - 0.03 * moving


@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 1000])
def test_a_ball_between_two_walls_keeps_its_speed(step):
    scene = em.Scene(gravity=(0, 0, 0), step=step)
    for side in (-1, 1):
        wall = em.Box((0.1, 1, 1))
        scene.add_body(f"{side}", wall, mass=0, position=(side * (0.05 + 0.03), 0, 0))
    surface = em.Surface(restitution=1.0)
    motion = {"velocity": (3.0, 0, 0), "surface": surface, "friction": 0.5}
    scene.add_body("ball", em.Sphere(RADIUS), mass=0.1, **motion)
    played = em.World(scene).simulate(scene.pack(), round(1 / step))
    assert played.lost_time < 1e-9
    speeds = [abs(scene.unpack(state)["ball"]["velocity"][0]) for state in played.states]
    assert speeds == pytest.approx(np.full(len(speeds), 3.0), rel=1e-3)


def test_a_ball_in_a_corner_comes_back_where_it_came_from():
    scene = em.Scene(gravity=(0, 0, 0))
    for axis in range(3):
        place = np.zeros(3)
        place[axis] = -0.05
        size = np.full(3, 1.0)
        size[axis] = 0.1
        scene.add_body(f"{axis}", em.Box(tuple(size)), mass=0, position=place)
    surface = em.Surface(restitution=1.0)
    motion = {"position": (0.2, 0.2, 0.2), "velocity": (-1.0, -1.0, -1.0), "friction": 0.0}
    scene.add_body("ball", em.Sphere(RADIUS), mass=0.1, surface=surface, **motion)
    end = scene.unpack(em.World(scene).simulate(scene.pack(), 60).states[-1])
    assert end["ball"]["velocity"] == pytest.approx([1, 1, 1], rel=1e-3)


def test_a_ball_bounces_on_a_plate_that_lies_on_the_floor():
    """What does not bounce bears what it touches: the plate takes nothing of the blow."""
    scene = em.Scene()
    scene.add_body("floor", em.Box((1, 1, 0.1)), mass=0, position=(0, 0, -0.05))
    scene.add_body("plate", em.Box((0.2, 0.2, 0.02)), mass=0.05, position=(0, 0, 0.01))
    surface = em.Surface(restitution=0.9)
    scene.add_body("ball", em.Sphere(RADIUS), mass=0.2, position=(0, 0, 0.34), surface=surface)
    states = em.World(scene).simulate(scene.pack(), 120).states
    fastest = max(scene.unpack(state)["ball"]["velocity"][2] for state in states)
    assert fastest == pytest.approx(0.9 * math.sqrt(2 * G * 0.3), rel=0.02)


@pytest.mark.parametrize("step", [1 / 240, 1 / 1000])
def test_pendulums_that_touch_hand_on_a_swing_and_gain_nothing(step):
    scene = em.Scene(step=step)
    scene.add_body("frame", em.Box((0.4, 0.02, 0.02)), mass=0, position=(0, 0, 0.5))
    surface = em.Surface(restitution=1.0)
    for i in range(4):
        scene.add_body(f"{i}", em.Sphere(RADIUS), mass=0.1, friction=0.0, surface=surface)
        hinge = {"axis": (0, -1, 0), "origin": (2 * RADIUS * i, 0, 0), "child_origin": (0, 0, 0.3)}
        scene.add_joint(f"{i}", parent="frame", child=f"{i}", start=0.5 * (i == 3), **hinge)
    world = em.World(scene)
    start = scene.pack()
    states = [start, *world.simulate(start, round(1.0 / step)).states]
    angles = np.array([scene.unpack(state)["joints"]["0"]["position"] for state in states])
    assert np.abs(angles).max() == pytest.approx(0.5, rel=0.03)
    found = np.array([world.energy(state) for state in states])
    assert found.max() < found[0] + 0.03 * 0.1 * G * 0.3 * (1 - math.cos(0.5))
