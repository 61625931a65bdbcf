"""First-order shares of a score's variance."""

import numpy as np
import pytest
from scipy.stats import qmc

from energymargin.evaluate.belief_scores import PARTICLES_A_TERM, shares


def points(dimension, count, seed=0):
    engine = qmc.Sobol(dimension, seed=np.random.default_rng(seed))
    return engine.random_base2((count - 1).bit_length())[:count]


def test_shares_of_a_sum_are_those_of_its_variances():
    u = points(3, 256)
    found = shares(u, [1, 1, 1], 2 * u[:, 0] + u[:, 1])
    assert [one.value for one in found] == pytest.approx([0.8, 0.2, 0.0], abs=0.01)


def test_a_source_of_several_inputs_has_the_share_of_all_of_them():
    u = points(3, 256)
    together, rest = shares(u, [2, 1], u[:, 0] + u[:, 1] + 2 * u[:, 2])
    assert (together.value, rest.value) == pytest.approx((1 / 3, 2 / 3), abs=0.02)


def test_a_parabola_counts_and_an_interaction_does_not():
    u = points(2, 1024)
    bowl, _ = shares(u, [1, 1], (u[:, 0] - 0.5) ** 2)
    assert bowl.value == pytest.approx(1.0)
    product = shares(u, [1, 1], (u[:, 0] - 0.5) * (u[:, 1] - 0.5))
    assert [one.value for one in product] == pytest.approx([0, 0], abs=0.01)


def test_noise_of_the_searches_is_of_no_source():
    u = points(1, 1024)
    noise = np.random.default_rng(0).normal(size=1024) * np.sqrt(1 / 12)
    (one,) = shares(u, [1], u[:, 0] + noise)
    assert one.value == pytest.approx(0.5, abs=0.05)


def test_the_error_is_about_how_far_the_share_is_off():
    """Of 100 draws of 48 particles with as much noise as signal."""
    held = []
    for seed in range(100):
        u = points(2, 48, seed)
        noise = np.random.default_rng(seed).normal(size=48) * np.sqrt(1 / 12)
        one, _ = shares(u, [1, 1], u[:, 0] + noise)
        held.append(abs(one.value - 0.5) <= 2 * one.stderr)
    assert np.mean(held) >= 0.9


@pytest.mark.parametrize("scores", [np.ones(64), np.full(64, np.inf), np.full(64, np.nan)])
def test_scores_that_do_not_differ_or_are_not_finite_have_no_shares(scores):
    (one,) = shares(points(1, 64), [1], scores)
    assert np.isnan([one.value, one.stderr]).all()


def test_few_particles_have_no_shares():
    enough = PARTICLES_A_TERM * 3
    u = points(1, 16)
    for count, there in ((enough, True), (enough - 1, False)):
        (one,) = shares(u[:count], [1], u[:count, 0])
        assert np.isfinite(one.value) == there
