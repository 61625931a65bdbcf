"""The study of grasps: figures against labels, both engines against Coulomb, the command."""

import json

import h5py
import numpy as np
import pytest
import trimesh
from command_line import run_here
from mesh_files import written

import energymargin as em
from energymargin import Cancel
from energymargin.grasps import GraspObject, GraspSet, Motion, ParallelGripper, Protocol, write
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.trials import GraspTrials
from energymargin_paper.evidence import grasps_numbers as numbers
from energymargin_paper.evidence.grasps import STUDY, Settings
from energymargin_paper.evidence.grasps_engines import ENGINES, Ends, Job, engines_text
from energymargin_paper.evidence.grasps_mujoco import Trial

GRIPPER = ParallelGripper(opening=0.08, force=10.0, palm=(0.1, 0.04, 0.04))
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # the approach points down, the fingers open along x
HOLD, SHAKE = Motion("hold", 0.5), Motion("shake", 1.0, 0.05, (0, 1, 0), frequency=3.0)


def trial(motion, mass, side=0.04, friction=0.5):
    cube = GraspObject(em.Box((side, side, side)), mass, friction)
    trials = GraspTrials(GRIPPER, cube, Protocol([motion]))
    return Trial(trials, grasp_of(GraspSet(DOWN[None]), 0), -1)


@pytest.mark.parametrize(
    ("motion", "most", "share", "held"),
    [
        (HOLD, 9.81, 0.93, True),
        (HOLD, 9.81, 1.07, False),
        (SHAKE, 20.3, 0.93, True),  # hypot(9.81, .05 (6 pi)^2) m/s2
        (SHAKE, 20.3, 1.25, False),  # which is more than the force for a moment only
    ],
)
def test_both_engines_hold_a_cube_up_to_coulomb_s_limit(motion, most, share, held):
    mass = share * 2 * 0.5 * GRIPPER.force / most
    asked = trial(motion, mass)
    assert asked.here(Cancel()) == (True, held)
    for how in ENGINES[:2]:
        assert asked.there(how, Cancel()) == (True, held)


def test_both_engines_see_a_hand_that_closes_on_nothing_or_begins_in_the_object():
    for side, height in ((0.12, 0.0), (0.04, 0.05)):
        pose = DOWN.copy()
        pose[2, 3] = height
        asked = trial(HOLD, 0.1, side)
        asked = asked._replace(grasp=asked.grasp._replace(pose=pose))
        assert asked.here(Cancel()) == asked.there(ENGINES[0], Cancel()) == (False, False)


def test_the_same_pieces_of_a_disturbance_are_within_the_bounds_and_fill_the_horizon():
    asked = trial(HOLD, 0.2)._replace(number=3, strength=1.0)
    pieces = asked.pieces(0.2)
    assert sum(piece.duration for piece in pieces) == pytest.approx(0.5)
    most = np.abs([piece.wrenches[0] for piece in pieces]).max(axis=0)
    bounds = np.repeat([0.5 * 0.2 * 9.81, 0.5 * 0.2 * 9.81 * 0.01], 3)
    assert (most <= bounds).all() and (most > 0.3 * bounds).any()
    again = asked.pieces(0.2)
    assert all((a.wrenches == b.wrenches).all() for a, b in zip(pieces, again, strict=True))


def test_others_mean_leaves_out_the_own_planner():
    means = numbers.others_mean(np.array([1.0, 0, 1, 1]), np.array(["a", "a", "b", "c"]))
    assert means.tolist() == pytest.approx([1.0, 1.0, 2 / 3, 2 / 3])
    assert np.isnan(numbers.others_mean(np.ones(2), np.array(["a", "a"]))).all()


def test_a_scaling_is_learned_from_other_groups():
    groups = np.repeat([0, 1, 2], 40)
    labels = np.tile([True, False], 60)
    chances = np.where(labels, 0.6, 0.5)
    assert numbers.share_brier(labels, groups) == pytest.approx(0.25)
    assert numbers.scaled_brier(10 * chances, labels, groups) < 0.05
    wrong = np.where(groups == 2, ~labels, labels)  # the other way round in one group
    assert numbers.scaled_brier(10 * chances, wrong, groups) > 1 / 4
    assert np.isnan(numbers.share_brier(labels, np.zeros(120, dtype=int)))


def test_kappa_is_0_by_chance_and_1_if_all_is_alike():
    one, other = (np.array(values, dtype=bool) for values in ([1, 1, 0, 0], [1, 0, 1, 0]))
    assert numbers.kappa(one, one) == 1.0
    assert numbers.kappa(one, other) == 0.0
    assert np.isnan(numbers.kappa(np.ones(3, dtype=bool), np.ones(3, dtype=bool)))


def job(number, thing="mug"):
    return Job("0", thing, number, 0.3, "hold", 2, 0)


def test_the_tables_count_what_the_engines_say():
    alike, split = (True,) * 4, (True, True, False, True)
    both, none = ((True, True),) * 2, ((False, False),) * 2
    ends = [
        Ends((True, True), alike, True, both, ((True, False), (True, True))),
        Ends((False, True), alike, True, none, none),
        Ends((True, True), split, True, both, both),
        Ends((False, False), (False,) * 4, False, none, none),
    ]
    text = engines_text({job(k): end for k, end in enumerate(ends)})
    row = "| mug | 4 | 3 | 3 | 66.7% | 66.7% | 0.40 | 100.0% | 1.00 | 100.0% |"
    assert row in text and row.replace("mug", "**all**") in text
    ours = "0.500 | 0.125 | 87.5% | "
    assert f"| mug | 8 | 0.375 | {3 * ours}".strip() in text


@pytest.fixture
def data(tmp_path):
    """A folder as that of the data, with a box for the tennis ball and for the mug."""
    box = trimesh.creation.box((0.05, 0.05, 0.08))
    graspa, acronym = tmp_path / "data" / "graspa", tmp_path / "data" / "acronym"
    (graspa / "meshes").mkdir(parents=True)
    acronym.mkdir()
    written(graspa / "meshes", box, "YcbTennisBall.stl")
    written(acronym, trimesh.creation.box((0.078, 0.05, 0.08)), "mug.obj")
    names = "x,y,z,qx,qy,qz,qw"
    (graspa / "objects.csv").write_text(
        f"layout,object,{names},mesh\n0,YcbTennisBall,0,0,0.04,0,0,0,1,YcbTennisBall.stl\n"
    )
    rows = [
        f"{planner},0,YcbTennisBall,{x},0,{z},1,0,0,0,{held},{held}"
        for planner in ("a", "b")
        for x, z, held in ((0, 0.075, 1), (0, 0.12, 0), (0.01, 0.07, 1))
    ]
    head = f"planner,layout,object,{names},grasped,stability"
    (graspa / "grasps.csv").write_text("\n".join([head, *rows]) + "\n")
    poses = np.tile(DOWN, (4, 1, 1))
    poses[:, 2, 3] = 0.03, 0.035, 0.08, 0.035
    write(acronym / "mug.h5", GraspSet(poses, labels=np.array([1.0, 1, 0, 0])))
    with h5py.File(acronym / "mug.h5", "a") as file:
        said = {"mass": 0.1, "scale": 1.0, "friction": 1.0, "com": np.zeros(3)}
        for name, value in {**said, "inertia": 1e-4 * np.eye(3)}.items():
            file[f"object/{name}"] = value
    return tmp_path / "data"


SMALL = ("--objects", "YcbTennisBall,mug", "--grasps", "1", "--draws", "1", "--protocol", "hold")
FEW = ("--rollouts", "2", "--threads", "1")


def test_the_command_makes_all_parts_and_goes_on_from_its_runs(data, tmp_path):
    folder = tmp_path / "out"
    command = ["reproduce", "grasps", "--data", str(data), *SMALL, *FEW, "-o", str(folder)]
    first = run_here(*command, cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    table = (folder / "grasps.md").read_text()
    parts = ("a. Two engines", "b. A real robot", "c. Another engine")
    assert all(f"## {part}" in table for part in parts)
    assert "### grasped" in table and "| probability | 1.00/1.00<br>" in table
    assert "FleX loses 2. In 1 of them" in table and "within 2 mm" in table
    lines = (folder / "engines.jsonl").read_text().splitlines()
    assert [json.loads(line)[0]["object"] for line in lines] == ["YcbTennisBall", "mug"]
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.jsonl")}
    assert run_here(*command, cwd=tmp_path).returncode == 0
    assert (folder / "grasps.md").read_text() == table
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*.jsonl")} == before


def test_a_folder_without_data_is_named(tmp_path):
    with pytest.raises(ValueError, match="expected a folder with graspa/ or acronym/"):
        STUDY.reproduce(Settings(data=str(tmp_path)), tmp_path / "out")


@pytest.mark.parametrize("given", [{"parts": ("d",)}, {"objects": ("cup",)}, {"every": 0}])
def test_settings_that_cannot_be_are_refused(given):
    with pytest.raises(ValueError, match=next(iter(given))):
        Settings(**given)
