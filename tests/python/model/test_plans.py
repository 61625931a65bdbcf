"""Plans in steps of a scene, what is left of one, and times in whole steps."""

import numpy as np
import pytest

import energymargin as em
from energymargin.model.plans import in_steps, nearest_steps, whole_steps

STEP = 1 / 240
ROWS = np.arange(24.0).reshape(4, 6)


def plan(step=STEP):
    """Four rows of everything that a plan can have."""
    return em.Plan(
        step,
        wrenches={"a": ROWS},
        targets={"joint": np.arange(4.0)},
        velocities={"b": -ROWS},
        limits={"b": (3.0, 2.0)},
    )


def test_what_is_left_has_the_later_rows_of_everything():
    rest = plan().rest(1, STEP)
    assert (rest.rows, rest.step) == (3, STEP)
    assert np.array_equal(rest.wrenches["a"], ROWS[1:])
    assert np.array_equal(np.ravel(rest.targets["joint"]), [1, 2, 3])
    assert np.array_equal(rest.velocities["b"], -ROWS[1:])
    assert rest.limits == {"b": (3.0, 2.0)}


def test_a_row_that_has_begun_is_left_for_as_long_as_it_would_last():
    rest = plan(3 * STEP).rest(4, STEP)
    assert rest.step == STEP and rest.duration == pytest.approx(8 * STEP)
    assert np.array_equal(np.ravel(rest.targets["joint"]), [1, 1, 2, 2, 2, 3, 3, 3])


def test_coarse_rows_stay_coarse_where_one_begins():
    rest = plan(3 * STEP).rest(6, STEP)
    assert (rest.rows, rest.step) == (2, 3 * STEP)


@pytest.mark.parametrize("done", [-1, 4])
def test_after_its_end_nothing_is_left(done):
    with pytest.raises(ValueError, match=f"done is {done}, expected "):
        plan().rest(done, STEP)


def test_times_are_whole_steps():
    assert whole_steps("every", 0.1, STEP) == 24
    with pytest.raises(ValueError, match=r"every is 0\.11 s, expected whole steps .* 0\.108333"):
        whole_steps("every", 0.11, STEP)
    with pytest.raises(ValueError, match=r"every is 0\.001 s, expected whole steps"):
        whole_steps("every", 0.001, STEP)


@pytest.mark.parametrize("rate", [50, 60, 100, 125, 160, 200, 240])
def test_control_times_keep_their_rate_in_the_mean(rate):
    times = np.arange(10 * rate + 1) / rate
    steps = nearest_steps(times, STEP)
    assert steps[-1] == 2400
    assert np.abs(steps * STEP - times).max() <= STEP / 2 + 1e-9


def test_rows_of_50_hz_begin_at_the_steps_nearest_to_their_times():
    rows = np.arange(300.0).reshape(50, 6)
    fine = in_steps(em.Plan(0.02, velocities={"b": rows}, limits={"b": (3.0, 2.0)}), STEP)
    assert (fine.step, fine.rows, fine.limits) == (STEP, 240, {"b": (3.0, 2.0)})
    first = fine.velocities["b"][:, 0] / 6
    assert [int(np.argmax(first == row)) for row in range(6)] == [0, 5, 10, 14, 19, 24]


def test_rows_of_whole_steps_stay_as_they_are():
    coarse = plan(3 * STEP)
    assert in_steps(coarse, STEP) is coarse


def test_rows_shorter_than_a_step_are_refused():
    with pytest.raises(ValueError, match=r"step of the plan is 0\.001 s, expected at least a step"):
        in_steps(plan(0.001), STEP)


def test_a_scene_takes_a_plan_of_50_hz_in_its_steps():
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("a", em.Sphere(0.1), mass=2.0, role="object")
    push = em.Plan(0.02, wrenches={"a": np.tile([1.0, 0, 0, 0, 0, 0], (50, 1))})
    moved, same = (
        em.World(scene, plan).rollout(scene.pack(), np.zeros(6), 1.0).state
        for plan in (push, in_steps(push, scene.step))
    )
    assert scene.unpack(moved)["a"]["velocity"][0] == pytest.approx(0.5)
    assert np.array_equal(moved, same)
