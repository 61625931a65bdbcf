"""Is the probability above a threshold? Rollouts stop once that is told."""

import numpy as np
import pytest
from reacting import on_a_rail

import energymargin as em

FORCES = em.disturbances.Gaussian(force=12.0, torque=0.0, correlation_time=0.05)


def asked(half, seed=0, **options):
    captured = em.regions.Ball("ball", (0, 0, 0), half)
    problem = on_a_rail(horizon=0.5).replace(captured=captured)
    return em.capture_probability(problem, disturbance=FORCES, seed=seed, **options)


def test_what_is_clear_takes_few_rollouts():
    yes, no = asked(10.0, above=0.9), asked(0.01, above=0.9)
    assert (yes.above, no.above) == (True, False)
    assert yes.rollouts < 60 and no.rollouts <= 12
    assert asked(10.0).above is None


def test_near_the_threshold_it_is_not_told_and_all_rollouts_are_made():
    truth = asked(0.1, rollouts=4000, undisturbed=False).captured
    near = [asked(0.1, seed, above=truth, rollouts=100) for seed in range(1, 101)]
    told = [p.above for p in near]
    assert told.count(None) > 80
    assert told.count(True) <= 12 and told.count(False) <= 12
    assert max(p.rollouts for p in near) == 100
    inside = [p.interval()[0] <= truth <= p.interval()[1] for p in near]
    assert np.mean(inside) > 0.93


def test_it_is_a_part_of_the_same_rollouts_on_any_threads():
    whole = asked(0.1, rollouts=300)
    for threads in (1, 2):
        part = asked(0.1, above=0.2, threads=threads)
        assert np.array_equal(part.exit_times, whole.exit_times[: len(part.exit_times)])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"above": 1.0}, "above is 1, expected a probability between 0 and 1"),
        ({"above": 0.9, "tolerance": 0.05}, "tolerance is given with above"),
        ({"above": 0.9, "rare": True}, "above is given with rare=True"),
        ({"above": "0.9"}, "above"),
    ],
)
def test_what_cannot_be_asked_is_refused(options, words):
    with pytest.raises((ValueError, TypeError), match=words):
        asked(0.1, **options)
