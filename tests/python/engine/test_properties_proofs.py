"""No proof is false: a bound of the effort is never above an escape."""

from itertools import count

import pytest
from hypothesis import given, strategies as st
from random_proofs import random_problem

import energymargin as em

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")

ENOUGH = 100  # problems of which something is proved


def proof(seed):
    """The bound of a random problem and, where that is above 0, the effort of an escape."""
    problem = random_problem(seed)
    bound = em.effort_lower_bound(problem, cells=2000).effort
    if bound == 0.0:
        return bound, float("inf")
    return bound, em.escape_effort(problem, nodes=300, seed=seed, warn=False).effort


@given(st.integers(0, 2**32))
def test_a_bound_of_the_effort_is_never_above_an_escape(seed):
    bound, effort = proof(seed)
    assert bound <= effort


def test_a_hundred_proofs_hold_and_some_of_them_against_a_way_out():
    proved, escaped = 0, 0
    for seed in count():
        bound, effort = proof(seed)
        assert bound <= effort, seed
        proved += bound > 0.0
        escaped += effort < float("inf")
        if proved == ENOUGH:
            break
    assert escaped > ENOUGH / 20
