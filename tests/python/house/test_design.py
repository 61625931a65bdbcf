"""Rollouts that are evenly spread: unbiased, and with a smaller variance."""

import numpy as np
import pytest
from reacting import on_a_rail

import energymargin as em

PUSHES = em.disturbances.Uniform(hold=0.5)


def asked(seed=0, half=0.2, **options):
    captured = em.regions.Ball("ball", (0, 0, 0), half)
    held = on_a_rail(horizon=0.5, duration=0.5).replace(captured=captured)
    return em.capture_probability(held, **{"disturbance": PUSHES, "seed": seed,
                                           "undisturbed": False, **options})  # fmt: skip


def test_it_is_unbiased_with_a_smaller_variance_and_an_interval_that_holds():
    truth = asked(rollouts=10000).captured
    assert 0.2 < truth < 0.8
    spread = [asked(seed, rollouts=64, design="sobol") for seed in range(1, 201)]
    values = np.array([p.captured for p in spread])
    alone = truth * (1 - truth) / 64
    assert values.var() < 0.8 * alone
    assert abs(values.mean() - truth) < 4 * np.sqrt(alone / 200)
    assert np.mean([p.interval()[0] <= truth <= p.interval()[1] for p in spread]) >= 0.92
    width = np.mean([np.ptp(p.interval()) for p in spread])
    assert width < 0.95 * np.ptp(asked(rollouts=64).interval())
    assert all(64 <= p.effective <= 3 * 64 for p in spread)


@pytest.mark.parametrize(("rollouts", "first"), [(64, 0), (256, 0), (128, 5)])
def test_its_interval_holds_where_pushes_are_short(rollouts, first):
    short = {"half": 0.1, "disturbance": em.disturbances.Uniform(hold=0.1), "design": "sobol"}
    truth = asked(**short | {"rollouts": 20000, "design": "independent"}).captured
    found = [asked(seed, rollouts=rollouts, first=first, **short).interval() for seed in range(200)]
    assert np.mean([low <= truth <= high for low, high in found]) >= 0.92


def test_numbers_far_out_are_rollouts_of_their_own():
    near, far = (asked(rollouts=6, first=n, design="sobol").exit_times for n in (0, 2**56))
    assert not np.array_equal(near, far)


def test_a_part_has_the_bits_of_the_whole_on_any_threads():
    whole = asked(rollouts=50, design="sobol").exit_times
    for first, count, threads in ((0, 7, 2), (13, 30, 1)):
        part = asked(rollouts=count, first=first, threads=threads, design="sobol").exit_times
        assert np.array_equal(part, whole[first : first + count], equal_nan=True)
    assert not np.array_equal(whole, asked(rollouts=50).exit_times)


def test_a_tolerance_takes_fewer_rollouts():
    alone, spread = (
        [asked(seed, tolerance=0.05, design=design).rollouts for seed in range(8)]
        for design in ("independent", "sobol")
    )
    assert np.mean(spread) < 0.75 * np.mean(alone)


def test_what_always_holds_has_the_interval_of_its_rollouts():
    one, other = (asked(rollouts=40, half=9.0, design=d) for d in ("independent", "sobol"))
    assert one.captured == other.captured == 1
    assert one.interval() == other.interval()


@pytest.mark.parametrize(
    "disturbance",
    [
        em.disturbances.Gaussian(force=3.0, torque=0.0, correlation_time=0.5),
        em.disturbances.Uniform(hold=0.1),
    ],
)
def test_other_disturbances_stay_unbiased(disturbance):
    truth = asked(half=0.1, rollouts=10000, disturbance=disturbance).captured
    assert 0.05 < truth < 0.98
    values = [
        asked(s, half=0.1, rollouts=64, disturbance=disturbance, design="sobol").captured
        for s in range(100)
    ]
    assert abs(np.mean(values) - truth) < 4 * np.sqrt(truth * (1 - truth) / 64 / 100)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"above": 0.9}, r"design is \"sobol\", expected \"independent\""),
        ({"disturbance": em.disturbances.Boltzmann(rate=1.0)}, "Boltzmann"),
        ({"disturbance": lambda random, times: np.zeros((len(times), 6))}, "given numbers"),
        ({"rare": True, "undisturbed": True}, "design is given with rare=True"),
        ({"design": "halton"}, "design is 'halton', expected"),
    ],
)
def test_what_takes_independent_rollouts_says_so(options, words):
    with pytest.raises(ValueError, match=words):
        asked(rollouts=8, **{"design": "sobol", **options})
