"""How bodies meet beside Coulomb's friction, against closed forms."""

import math

import numpy as np
import pytest

import energymargin as em

G = 9.81
RADIUS, MASS = 0.05, 0.2
INERTIA = 0.4 * MASS * RADIUS**2


def ball_on_table(
    *, step=1 / 240, height=RADIUS, table_friction=1.0, table_velocity=(0, 0, 0), **ball
):
    scene = em.Scene(step=step)
    scene.add_plane("table", friction=table_friction, surface_velocity=table_velocity)
    ball = {"mass": MASS, "friction": 0.5, "position": (0, 0, height)} | ball
    scene.add_body("ball", em.Sphere(RADIUS), role="object", **ball)
    return scene


def motion(scene, duration):
    """Times [s], positions, velocities and spins of the ball, after each step."""
    steps = round(duration / scene.step)
    simulation = em.World(scene).simulate(scene.pack(), steps)
    assert simulation.unconverged == 0
    states = np.asarray(simulation.states)
    return np.ravel(simulation.times), states[:, :3], states[:, 7:10], states[:, 10:13]


def time_to_rest(times, speeds, share=1e-3):
    return times[np.argmax(np.abs(speeds) < share * np.abs(speeds[0]))]


@pytest.mark.parametrize("torsional", [0.002, 0.01])
def test_ball_spins_to_rest(torsional):
    start = 0.5 * torsional * MASS * G / INERTIA  # [rad/s], for half a second
    scene = ball_on_table(
        surface=em.Surface(torsional_friction=torsional), angular_velocity=(0, 0, start)
    )
    times, positions, _, spins = motion(scene, 0.7)
    assert time_to_rest(times, spins[:, 2]) == pytest.approx(0.5, rel=0.02)
    assert np.abs(positions[-1, :2]).max() < 1e-6


@pytest.mark.parametrize("rolling", [0.0005, 0.002])
def test_ball_rolls_to_rest(rolling):
    slowing = rolling * G / (RADIUS * 1.4)
    start = 1.0 * slowing
    scene = ball_on_table(
        surface=em.Surface(rolling_friction=rolling),
        velocity=(start, 0, 0),
        angular_velocity=(0, start / RADIUS, 0),
    )
    times, positions, velocities, _ = motion(scene, 1.3)
    assert time_to_rest(times, velocities[:, 0], 0.01) == pytest.approx(1.0, rel=0.02)
    assert positions[-1, 0] == pytest.approx(0.5 * start, rel=0.02)
    assert np.abs(velocities[-1]).max() < 1e-3 * start


def peaks(heights):
    """Heights of the tops of a bouncing ball's way."""
    rises = (heights[1:-1] >= heights[:-2]) & (heights[1:-1] > heights[2:])
    return heights[1:-1][rises] - RADIUS


@pytest.mark.parametrize("restitution", [0.5, 0.8, 1.0])
@pytest.mark.parametrize("ground", ["plane", "box"])
def test_ball_bounces(restitution, ground):
    drop = 0.6
    errors = []
    for step in (1 / 240, 1 / 480):
        scene = em.Scene(step=step)
        if ground == "plane":
            scene.add_plane("ground")
        else:
            scene.add_body("ground", em.Box((1, 1, 0.2)), mass=0, position=(0, 0, -0.1))
        surface = em.Surface(restitution=restitution)
        scene.add_body(
            "ball", em.Sphere(RADIUS), mass=MASS, position=(0, 0, RADIUS + drop), surface=surface
        )
        _, positions, _, _ = motion(scene, 2.0)
        tops = peaks(positions[:, 2])[:2]
        right = drop * restitution ** (2 * np.arange(1, len(tops) + 1))
        errors.append(np.abs(tops / right - 1).max())
        assert len(tops) == 2
    print(ground, restitution, errors)
    assert errors[0] < 0.02
    assert errors[1] < 0.6 * errors[0] or errors[1] < 1e-3


def test_ball_is_carried_by_a_belt():
    """Friction speeds it up at mu g until it rolls: then it goes at 2/7 of the belt's speed."""
    belt = 0.7
    times, _, velocities, spins = motion(ball_on_table(table_velocity=(belt, 0, 0)), 0.5)
    end = 2 / 7 * belt / (0.5 * G)
    slipping = times < 0.95 * end
    assert velocities[slipping, 0] == pytest.approx(0.5 * G * times[slipping], rel=0.02)
    assert velocities[-1, 0] == pytest.approx(2 / 7 * belt, rel=0.02)
    assert velocities[-1, 0] - spins[-1, 1] * RADIUS == pytest.approx(belt, rel=0.02)


def test_soft_ball_sinks_by_its_weight():
    stiffness = 2000.0
    damping = 2 * math.sqrt(stiffness * MASS)
    surface = em.Surface(stiffness=stiffness, damping=damping)
    _, positions, velocities, _ = motion(ball_on_table(surface=surface), 1.0)
    assert RADIUS - positions[-1, 2] == pytest.approx(MASS * G / stiffness, rel=0.01)
    assert np.abs(velocities[-1]).max() < 1e-6


def test_soft_ball_swings():
    stiffness = 200.0
    scene = ball_on_table(surface=em.Surface(stiffness=stiffness), height=RADIUS, step=1 / 2000)
    times, positions, _, _ = motion(scene, 0.45)
    depth = RADIUS - positions[:, 2]
    period = 2 * math.pi * math.sqrt(MASS / stiffness)
    lows = np.flatnonzero((depth[1:-1] > depth[:-2]) & (depth[1:-1] >= depth[2:])) + 1
    assert times[lows[1]] - times[lows[0]] == pytest.approx(period, rel=0.02)
    assert depth.max() == pytest.approx(2 * MASS * G / stiffness, rel=0.03)


def cube_in_fingertips(torque, torsional, force=20.0, friction=1.0):
    """A cube between two balls that press with a force; a torque turns it about their axis."""
    scene = em.Scene(gravity=(0, 0, 0))
    cube = em.Box((0.04,) * 3)
    scene.add_body("cube", cube, mass=0.1, friction=friction, role="object")
    for name, side in (("left", -1), ("right", 1)):
        scene.add_body(
            name,
            em.Sphere(0.01),
            mass=0.05,
            position=(side * 0.03, 0, 0),
            friction=1.0,
            linear_factor=(1, 0, 0),
            angular_factor=(0, 0, 0),
            force=(-side * force, 0, 0),
            surface=em.Surface(torsional_friction=torsional),
        )
    world = em.World(scene)
    drive = np.zeros((240, 6))
    drive[24:, 3] = torque
    state = np.asarray(world.simulate(scene.pack(), 240, drives={"cube": drive}).states)[-1]
    return np.linalg.norm(state[10:13])


def test_cube_turns_in_soft_fingertips_beyond_their_torsional_friction():
    most = 2 * 0.004 * 20.0
    assert cube_in_fingertips(0.98 * most, 0.004) < 1e-2
    assert cube_in_fingertips(1.02 * most, 0.004) > 1.0
    assert cube_in_fingertips(0.02 * most, 0.0) > 1.0
