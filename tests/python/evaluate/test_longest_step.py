"""The disturbances under which steps are compared."""

import numpy as np
from sliding import problem

import energymargin as em


def test_each_problem_has_draws_of_its_own_and_the_first_those_of_the_seed():
    drawn = {}

    def pushes(random, times):
        first = random.random()
        drawn.setdefault(len(times), []).append(first)
        return np.full((len(times), 6), first)

    asked = {"rollouts": 5, "seed": 3, "threads": 1, "disturbance": pushes}
    em.longest_step([problem()] * 3, **asked)
    assert [len(set(one)) for one in drawn.values()] == [15] * len(drawn)
    assert len({tuple(one) for one in drawn.values()}) == 1  # the same for each step
    several, *_ = drawn.values()
    drawn.clear()
    em.longest_step(problem(), **asked)
    assert several[:5] == next(iter(drawn.values()))
    drawn.clear()
    em.capture_probability(problem(), **asked | {"seed": em.stream(3, 2)}, undisturbed=False)
    assert several[10:] == next(iter(drawn.values()))
