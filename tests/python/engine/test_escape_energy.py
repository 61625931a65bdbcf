import os
import signal
import threading

import numpy as np
import pytest

import energymargin as em

RIM = 0.1
WEIGHT = 0.2 * 9.81


@pytest.fixture(scope="module")
def pen():
    scene = em.Scene()
    scene.add_plane("floor")
    for name, x, y in [("east", 1, 0), ("west", -1, 0), ("north", 0, 1), ("south", 0, -1)]:
        size = (0.02 if x else 0.24, 0.02 if y else 0.24, RIM)
        scene.add_body(name, em.Box(size), mass=0, position=(0.11 * x, 0.11 * y, RIM / 2))
    ball = {"mass": 0.2, "position": (0, 0, 0.03), "velocity": (0.3, 0, 0), "role": "object"}
    scene.add_body("ball", em.Sphere(0.03), **ball)
    captured = em.regions.Box("ball", center=(0, 0, 0), size=(0.4, 0.4, np.inf))
    return em.Problem(
        scene, scene.pack(), force=(1, 1, 1), torque=(0, 0, 0), duration=0.3, captured=captured
    )


@pytest.mark.parametrize("planner", ["bit*", "rrt*"])
def test_ball_gets_out_over_the_rim_of_its_pen(pen, planner):
    found = em.escape_energy(pen, planner=planner, samples=500)
    assert found.energy == pytest.approx(WEIGHT * RIM, rel=0.02)
    assert found.history[-1][1] == found.energy
    assert repr(found) == f"EscapeEnergy(energy={found.energy!r}, samples=500, complete=True)"


def test_path_shows_the_way_over_the_barrier_at_rest(pen):
    found = em.escape_energy(pen, samples=500)
    world = em.World(pen.scene)
    energies = np.array([world.energy(state) for state in found.path])
    assert found.path.shape[1] == len(pen.state)
    assert (found.path[:, 7:13] == 0).all()
    assert energies.argmax() == found.barrier
    assert energies.max() - energies[0] == pytest.approx(found.energy, abs=1e-12)


def test_cage_is_inf_without_a_path():
    scene = em.Scene()
    scene.add_plane("floor")
    scene.add_body("ball", em.Sphere(0.03), mass=0.2, position=(0, 0, 0.03), role="object")
    for axis in range(2):
        for side in (-1, 1):
            position = np.array([0, 0, 0.05])
            position[axis] = 0.1 * side
            size = np.array([0.2, 0.2, 0.1])
            size[axis] = 0.02
            scene.add_body(f"wall {axis} {side}", em.Box(size), mass=0, position=position)
    scene.add_body("lid", em.Box((0.22, 0.22, 0.02)), mass=0, position=(0, 0, 0.11))
    captured = em.regions.Ball("ball", center=(0, 0, 0), radius=0.3)
    problem = em.Problem(
        scene, scene.pack(), force=(1, 1, 1), torque=(0, 0, 0), duration=0.3, captured=captured
    )
    found = em.escape_energy(problem, samples=500)
    assert found.energy == np.inf
    assert found.history == [] and found.barrier is None and len(found.path) == 0


def test_wrong_arguments_are_named(pen):
    for wrong, words in [
        ({"planner": "prm"}, "planner is 'prm', expected 'bit\\*' or 'rrt\\*'"),
        ({"samples": 0}, "samples is 0"),
        ({"reach": -1}, "reach is -1"),
        ({"reach": "far"}, "reach is 'far'"),
        ({"object": "floor"}, "object is 'floor', expected 'ball'"),
        ({"seed": -1}, "seed is -1"),
    ]:
        with pytest.raises(ValueError, match=words):
            em.escape_energy(pen, **wrong)


@pytest.mark.parametrize("planner", ["bit*", "rrt*"])
def test_ctrl_c_ends_a_long_search(pen, planner):
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        em.escape_energy(pen, planner=planner, samples=100_000_000)
