"""A concave mesh holds a ball, and the ball's escape energy (Definition 2) is m g h."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import energymargin as em

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("coacd")

# Radius and height of the bowl's profile [m], from the middle of the foot over the rim and back.
PROFILE = (
    *((0.0, 0.0), (0.025, 0.0), (0.045, 0.012), (0.060, 0.050)),
    *((0.056, 0.050), (0.042, 0.015), (0.024, 0.005), (0.0, 0.005)),
)
SECTIONS = 32  # of a turn
RIM, FLOOR = 0.050, 0.005  # m, heights
RADIUS, MASS = 0.012, 0.02  # m, kg, of the ball
DROP = (0.02, 0.0, 0.045)  # m, from where the ball is let go


@pytest.fixture(scope="module")
def bowl(tmp_path_factory: pytest.TempPathFactory) -> Any:
    mesh = tmp_path_factory.mktemp("bowl") / "bowl.obj"
    trimesh.creation.revolve(np.array(PROFILE), sections=SECTIONS).export(mesh)
    return em.mesh(mesh)


@pytest.fixture(scope="module")
def problem(bowl: Any) -> em.Problem:
    """The ball at rest at the bottom; packed, the scene has it where it is dropped."""
    scene = em.Scene()
    scene.add_plane("table", friction=0.5)
    scene.add_body("bowl", bowl, mass=0.3, friction=0.5, role="effector")
    ball = em.Sphere(RADIUS)
    scene.add_body("ball", ball, mass=MASS, position=DROP, friction=0.5, role="object")
    return em.Problem(
        scene,
        scene.pack(ball={"position": (0.0, 0.0, FLOOR + RADIUS)}),
        force=(0.1, 0.1, 0.1),
        torque=(0.0, 0.0, 0.0),
        duration=0.2,
        captured=em.regions.Disc("ball", center=(0.0, 0.0), radius=0.09),
        rate=1000.0,
    )


def test_the_bowl_is_several_parts_with_the_mass_of_the_mesh(bowl: Any) -> None:
    assert len(bowl.parts) > 4
    # Guldin: a ring's volume is the area of its profile times the way of the area's centre.
    x, z = np.transpose(PROFILE)
    cross = x * np.roll(z, -1) - np.roll(x, -1) * z
    moment = abs((cross * (x + np.roll(x, -1))).sum()) / 6
    turn = SECTIONS * np.sin(2 * np.pi / SECTIONS)  # of a polygon instead of 2 pi
    assert bowl.solid.volume == pytest.approx(turn * moment, rel=1e-6)


def test_a_ball_that_is_dropped_into_the_bowl_stays_in_it(problem: em.Problem) -> None:
    scene = problem.scene
    rolled = em.World(scene).simulate(scene.pack(), round(2.0 / scene.step)).states
    ball = rolled[:, scene.slice("ball")]
    assert np.hypot(ball[-1, 0], ball[-1, 1]) < 0.03
    assert np.hypot(ball[:, 0], ball[:, 1]).max() < 0.06
    # It lies on the inside, not in it.
    assert ball[-240:, 2].min() > FLOOR + RADIUS - 2e-4
    assert ball[-240:, 2].max() < FLOOR + 2 * RADIUS


@pytest.mark.parametrize("seed", (0, 1))
@pytest.mark.parametrize("planner", ("bit*", "rrt*"))
def test_its_escape_energy_is_that_of_the_closed_form(
    problem: em.Problem, planner: str, seed: int
) -> None:
    found = em.escape_energy(problem, planner=planner, samples=500, seed=seed)
    ratio = found.energy / (MASS * 9.81 * (RIM - FLOOR))
    assert 0.999 < ratio < 1.05  # what counts as touching is a thousandth of the ball's radius


def test_the_problem_in_a_file_has_the_same_escape_energy(
    problem: em.Problem, tmp_path: Path
) -> None:
    problem.save(tmp_path / "problem.json")
    one, same = (
        em.escape_energy(asked, planner="bit*", samples=500, seed=0)
        for asked in (problem, em.Problem.load(tmp_path / "problem.json"))
    )
    assert same.history == one.history
