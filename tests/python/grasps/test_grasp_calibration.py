"""Poses that are off by run, found without a label; probabilities that mean what they say."""

import numpy as np
import pytest

import energymargin as em
from energymargin.grasps import GraspObject, GraspSet, ParallelGripper, calibrate, recalibrate

HAND = ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=20.0)
BLOCK = GraspObject(em.Box((0.04, 0.04, 0.06)), mass=0.2)


def from_above(count, *, deep, run, spread=0.004, seed=0):
    """Grasps of a block's upper part, so deep too far, and turned about the vertical."""
    random = np.random.default_rng(seed)
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (count, 1, 1))
    poses[:, 2, 3] = 0.02 - deep + random.uniform(-spread, spread, count)
    poses[:, 1, 3] = random.uniform(-spread, spread, count)
    return GraspSet(poses, columns={"run": np.array([run] * count)})


def joined(*sets):
    columns = {"run": np.concatenate([one.columns["run"] for one in sets])}
    return GraspSet(np.concatenate([one.poses for one in sets]), columns=columns)


def test_a_run_that_stands_too_deep_is_moved_back_and_a_right_one_stays():
    """The palm is 35 mm above the pads' middle, and the block's top 10 mm: 40 mm is too deep."""
    grasps = joined(from_above(20, deep=0.04, run="deep"), from_above(20, deep=0.0, run="right"))
    found = calibrate(grasps, HAND, BLOCK, group="run")
    assert found.groups == ("deep", "right") and (found.count == 20).all()
    deep, right = found.offsets
    assert right == 0.0 and 0.012 <= deep <= 0.022  # 15 mm are needed, 19 mm for all of them
    assert (found.before == (0.0, 1.0)).all() and (found.after >= 0.9).all()
    moved = found.grasps[0].poses[:, 2, 3] - grasps.poses[:, 2, 3]
    assert np.allclose(moved, np.repeat([deep, 0.0], 20))
    assert "| deep | 20 |" in found.to_markdown()


def test_groups_of_several_objects_are_taken_together():
    few = [from_above(5, deep=0.04, run="deep", seed=k) for k in range(3)]
    alone = calibrate(few[0], HAND, BLOCK, group="run")
    assert alone.offsets[0] == 0.0  # five are too few
    found = calibrate(few, HAND, [BLOCK] * 3, group="run")
    assert found.offsets[0] > 0.01 and len(found.grasps) == 3 and found.count[0] == 15


def test_what_cannot_be_calibrated_is_named():
    grasps = from_above(10, deep=0.0, run="a")
    with pytest.raises(ValueError, match="group is 'planner', expected 'run'"):
        calibrate(grasps, HAND, BLOCK, group="planner")
    with pytest.raises(ValueError, match="object has 1 objects, expected 2"):
        calibrate([grasps, grasps], HAND, BLOCK)


@pytest.mark.parametrize("method", ["platt", "isotonic"])
def test_probabilities_that_are_too_sure_are_made_milder(method):
    random = np.random.default_rng(1)
    true = random.uniform(0.2, 0.8, 2000)
    sure = np.clip(0.5 + 1.6 * (true - 0.5), 0.0, 1.0)  # .02 where it is .2
    held = random.random(2000) < true
    found = recalibrate(sure[:1000], held[:1000], sure[1000:], method=method)
    assert np.abs(found - true[1000:]).mean() <= 0.05 < np.abs(sure - true)[1000:].mean()
    assert (np.diff(found[np.argsort(sure[1000:])]) >= -1e-12).all()


def test_outcomes_that_teach_nothing_are_named():
    with pytest.raises(ValueError, match="held has outcomes that are all alike"):
        recalibrate([0.2, 0.8], [1, 1])
    with pytest.raises(ValueError, match="or neither 0 nor 1"):
        recalibrate([0.2, 0.8], [0.2, 0.7])
    for wrong in ([20, 80], [0.2, np.nan], [[0.2, 0.8]]):  # percents, for one
        with pytest.raises(ValueError, match="expected a list of numbers from 0 to 1"):
            recalibrate(wrong, [0, 1])
        with pytest.raises(ValueError, match=r"others is .*expected a list of numbers from 0 to 1"):
            recalibrate([0.2, 0.8], [0, 1], wrong)
    with pytest.raises(ValueError, match="method is 'line', expected 'platt'"):
        recalibrate([0.2, 0.8], [0, 1], method="line")
