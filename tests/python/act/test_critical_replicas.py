"""Intervals of critical values hold as often as they say, at a tenth of a grid's rollouts."""

import pytest

from critical import CASES, GRID_ROLLOUTS, grid_width, nulls, replicas


@pytest.mark.parametrize("case", CASES[:3], ids=lambda case: case.name)
def test_intervals_hold_and_are_narrower_than_a_grids_at_a_tenth_of_its_rollouts(case):
    found = replicas(case, 100, draws=90)
    assert found.held >= 93
    assert found.width < grid_width(case, 10)
    assert found.rollouts < GRID_ROLLOUTS / 10


def test_a_quantity_that_does_nothing_is_never_said_to_cross():
    """Nor to hold everywhere where it holds less often than is asked."""
    for probability, claim in ((0.90, "everywhere"), (0.98, "nowhere")):
        sides = nulls(probability, 100)
        assert not {"below", "above", claim} & set(sides)
