"""Tosses of a cube, recorded here: the study finds what its own engine made."""

import os

import numpy as np
import pytest
from command_line import invoke

from energymargin_paper.evidence import tosses

RATE = 148.0  # Hz


@pytest.fixture
def recorded(tmp_path):
    """Three tosses that end where the engine of the library lets them end."""
    rows, starts = [], [0]
    for number in range(3):
        random = np.random.default_rng(number)
        turn = tosses.Rotation.random(random_state=number).as_quat()
        start = tosses.Pose(np.array([0, 0, 0.3]), turn, random.normal(0, 0.5, 3), np.zeros(3))
        job = tosses.Job("native", 0, 0.18, 0.125, 1 / 960, 0, 0, "")
        end = tosses._here(job, start, 1.0)
        rows += [start, *[end] * round(RATE)]
        starts.append(len(rows))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    place, turns, speed, rate = columns
    own = tosses.Rotation.from_quat(turns).inv().apply(rate)
    folder = tmp_path / "real" / "cube_tosses"
    folder.mkdir(parents=True)
    np.savez(
        folder / "tosses.npz",
        position=place - [0, 0, tosses.RAISED],
        quaternion_wxyz=np.roll(turns, 1, axis=1),
        velocity=speed,
        angular_velocity=own,
        start=np.array(starts),
        dt=1 / RATE,
    )
    return folder.parent


def test_what_was_made_here_ends_here_on_the_same_face(recorded, tmp_path):
    asked = tosses.Settings(str(recorded), frictions=(0.18, 0.6), draws=4)
    found = tosses.STUDY.compute(asked, tmp_path, 1, lambda done, total: None)
    assert found.chosen == 0.18 and found.tried["native", 0.18] == 1.0
    assert "| native | 1.000 | 0 mm |" in found.to_markdown()
    assert len(found.to_csv().splitlines()) == 1 + len(tosses.ENGINES)


def test_a_folder_without_tosses_is_named(tmp_path):
    told = invoke(["reproduce", "tosses", "--data", str(tmp_path), "-o", str(tmp_path / "out")])
    assert told.exit_code == 2 and "expected a folder with cube_tosses/ in it" in told.output


@pytest.mark.skipif(tosses.FOLDER not in os.environ, reason=f"{tosses.FOLDER} names no folder")
def test_real_tosses_end_on_their_faces_as_often_as_in_mujoco(tmp_path):
    asked = tosses.Settings(os.environ[tosses.FOLDER], frictions=(0.18,), draws=1, every=2)
    found = tosses.STUDY.compute(asked, tmp_path, 2, lambda done, total: None)
    assert found.tried["native", 0.18] >= 0.75
    assert abs(found.tried["native", 0.18] - found.tried["MuJoCo", 0.18]) <= 0.1
