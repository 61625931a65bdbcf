"""What is left of a plan, and times in whole steps."""

import numpy as np
import pytest

import energymargin as em
from energymargin.plans import rest_of, whole_steps

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
    rest = rest_of(plan(), 1, STEP)
    assert (rest.rows, rest.step) == (3, STEP)
    assert np.array_equal(rest.wrenches["a"], ROWS[1:])
    assert np.array_equal(np.ravel(rest.targets["joint"]), [1, 2, 3])
    assert np.array_equal(rest.velocities["b"], -ROWS[1:])
    assert rest.limits == {"b": (3.0, 2.0)}


def test_a_row_that_has_begun_is_left_for_as_long_as_it_would_last():
    rest = rest_of(plan(3 * STEP), 4, STEP)
    assert rest.step == STEP and rest.duration == pytest.approx(8 * STEP)
    assert np.array_equal(np.ravel(rest.targets["joint"]), [1, 1, 2, 2, 2, 3, 3, 3])


def test_coarse_rows_stay_coarse_where_one_begins():
    rest = rest_of(plan(3 * STEP), 6, STEP)
    assert (rest.rows, rest.step) == (2, 3 * STEP)


@pytest.mark.parametrize("done", [-1, 4])
def test_after_its_end_nothing_is_left(done):
    with pytest.raises(ValueError, match=f"done is {done}, expected 0 to 3"):
        rest_of(plan(), done, STEP)


def test_times_are_whole_steps():
    assert whole_steps("every", 0.1, STEP) == 24
    with pytest.raises(ValueError, match=r"every is 0\.11 s, expected whole steps .* 0\.108333"):
        whole_steps("every", 0.11, STEP)
    with pytest.raises(ValueError, match=r"every is 0\.001 s, expected whole steps"):
        whole_steps("every", 0.001, STEP)
