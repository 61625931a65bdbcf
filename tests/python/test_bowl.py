"""A concave mesh holds a ball, and the ball's escape energy is that of its closed form."""

from pathlib import Path

import numpy as np
import pytest
from command_line import invoke

import energymargin as em
from energymargin_paper.evidence import bowl


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[bowl.Bowl, Path]:
    folder = tmp_path_factory.mktemp("bowl")
    return bowl.STUDY.reproduce(bowl.STUDY.quick, folder), folder


def test_the_bowl_is_several_parts_with_the_mass_of_the_mesh(
    made: tuple[bowl.Bowl, Path],
) -> None:
    shape = made[0].shape
    assert len(shape.parts) > 4
    assert shape.solid is not None
    # Guldin: a ring's volume is the area of its profile times the way of the area's centre.
    x, z = np.transpose(bowl.PROFILE)
    cross = x * np.roll(z, -1) - np.roll(x, -1) * z
    moment = abs((cross * (x + np.roll(x, -1))).sum()) / 6
    turn = bowl.SECTIONS * np.sin(2 * np.pi / bowl.SECTIONS)  # of a polygon instead of 2 pi
    assert shape.solid.volume == pytest.approx(turn * moment, rel=1e-6)


def test_a_ball_that_is_dropped_into_the_bowl_stays_in_it(made: tuple[bowl.Bowl, Path]) -> None:
    result, _ = made
    ball = result.rolled[:, result.problem.scene.slice("ball")]
    assert np.hypot(ball[-1, 0], ball[-1, 1]) < 0.03
    assert np.hypot(ball[:, 0], ball[:, 1]).max() < 0.06
    # It lies on the inside, not in it.
    assert ball[-240:, 2].min() > bowl.FLOOR + bowl.BALL_RADIUS - 2e-4
    assert ball[-240:, 2].max() < bowl.FLOOR + 2 * bowl.BALL_RADIUS


@pytest.mark.parametrize("planner", bowl.PLANNERS)
def test_its_escape_energy_is_that_of_the_closed_form(
    made: tuple[bowl.Bowl, Path], planner: str
) -> None:
    ratios = made[0].ratios(planner)
    assert len(ratios) == 2
    assert (ratios > 0.999).all()  # what counts as touching is a thousandth of the ball's radius
    assert (ratios < 1.05).all()


def test_the_problem_in_the_file_has_the_same_escape_energy(
    made: tuple[bowl.Bowl, Path],
) -> None:
    result, folder = made
    loaded = em.Problem.load(folder / "problem.json")
    again = em.escape_energy(loaded, planner="bit*", samples=500, seed=0)
    assert again.history == result.runs[0].found.history


def test_the_picture_and_the_tables_show_every_search(made: tuple[bowl.Bowl, Path]) -> None:
    result, folder = made
    bowl.figure_bowl(result).savefig(folder / "bowl.png", dpi=50)
    assert (folder / "bowl.png").stat().st_size > 10_000
    lines = result.to_csv().splitlines()
    assert len(lines) == 1 + sum(len(run.found.history) for run in result.runs)
    assert "| bit* | 2 |" in result.to_markdown()


def test_the_command_writes_its_files_and_says_where(tmp_path: Path) -> None:
    command = ["reproduce", "bowl", "--samples", "100", "--seeds", "1", "-o", str(tmp_path)]
    result = invoke(command)
    assert result.exit_code == 0, result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert {"bowl.md", "bowl.csv", "bowl.png", "bowl.obj", "problem.json"} <= names
