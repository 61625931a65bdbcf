"""Nothing is squeezed through a gap or shaken through a wall; grasps of a mug are MuJoCo's."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from energymargin_paper.evidence import contact, contact_mug
from energymargin_paper.evidence.contact_checks import Bar
from energymargin_paper.evidence.contact_problems import balls_outside, plate_effort


def test_no_ball_leaves_a_shaken_cup() -> None:
    lost_once = (20, 31, 43, 51, 71, 85)  # where steps lose time, which the cup does not
    seeds = (*range(20), *lost_once)
    assert [balls_outside(seed) for seed in seeds] == [0] * len(seeds)


@pytest.mark.parametrize("excess", [1.005, 1.01, 1.02])
def test_no_push_squeezes_a_plate_through_a_gap_that_is_too_narrow(excess: float) -> None:
    assert [plate_effort(excess, seed) for seed in range(15)] == [math.inf] * 15


def test_pushes_bring_a_plate_through_a_gap_that_is_wide_enough() -> None:
    assert min(plate_effort(0.95, seed) for seed in range(4)) < math.inf


@pytest.mark.skipif(contact_mug.given() is None, reason="ENERGYMARGIN_GRASPS names no folder")
def test_grasps_of_a_mug_lose_no_time_and_end_as_in_mujoco() -> None:
    pytest.importorskip("mujoco")
    grasps = contact_mug.given()
    assert grasps is not None
    jobs = [contact.Job("", contact.GRASP, number) for number in grasps.chosen(12, 1)]
    found = [contact.MugGrasp(*values) for values in map(contact.run, jobs) if values]
    assert [grasp.still for grasp in found if grasp.still > contact.STALLED] == []
    assert sum(grasp.held != grasp.held_there for grasp in found if grasp.is_sure) <= 1


def test_study_tells_what_is_asked_what_was_measured_and_what_did_not_hold(tmp_path: Path) -> None:
    settings = contact.Settings(percent=1, grasps=0)
    result = contact.STUDY.reproduce(settings, tmp_path, threads=1)
    text = (tmp_path / "contact.md").read_text()
    assert "| sliding box | lifts [mm] | at most 0.1 |" in text
    assert "| 1 of 1 |" in text
    assert (tmp_path / "contact.csv").read_text().startswith("check,seed,quantity,low,high,value")
    again = contact.STUDY.reproduce(settings, tmp_path, threads=1)
    assert vars(again) == vars(result)


def test_grasps_of_a_mug_that_miss_what_is_asked_are_told_of() -> None:
    alike, unlike, thrown = (1, 1, 1, 0, 0.1, 0.1), (1, 0, 0, 0, 0.1, 0.1), (0, 0, 0, 0, 9.0, 0.1)
    grasps = [alike] * 17 + [unlike, thrown, ()]
    found = {contact.Job("", contact.GRASP, i): values for i, values in enumerate(grasps)}
    text = contact.Contact(found).to_markdown()
    assert "- grasps of a mug, held or lost as in MuJoCo: 18 of 19, asked at least 95%\n" in text
    assert "- grasps of a mug, lost in MuJoCo: 2 of 19, asked at least 25%\n" in text
    assert "- grasps of a mug, thrown by the closing hand: 1 of 19, asked none\n" in text
    assert text.count("\n- ") == 3 and "Nothing." not in text


def test_bar_says_which_value_is_worst() -> None:
    assert Bar("x", high=1.0).worst([0.5, 3.0]) == 3.0
    assert Bar("x", low=1.0).worst([0.5, 3.0]) == 0.5
    assert Bar("x", 0.0, 2.0).worst([0.9, 3.5, -1.0]) == 3.5
    assert [str(bar) for bar in (Bar("x", high=1.0), Bar("x", 0.0, 2.0))] == ["at most 1", "0 to 2"]
