"""Priors of velocities: what they and a measurement with errors say together."""

import numpy as np
import pytest
from boxes import problem, scene
from scipy import stats

import energymargin as em
from energymargin_paper.paper.prior import ContradictionError, informed, velocities

MEASURED = np.array([0.1, 0.6, 0.0, 0.0, 0.0, 0.2])  # of the effector
DEVIATIONS = np.array([0.2, 0.1, 0.0, 0.0, 0.0, 0.3])
THERE = DEVIATIONS > 0
MEAN = np.array([0.0, 0.3, 0.5, 0.0, 0.0, -0.1])
ROOT = np.array([[0.10, 0.05, 0.0], [0.0, 0.20, 0.05], [0.0, 0.0, 0.30]])


def prior_covariance():
    covariance = np.zeros((6, 6))
    covariance[np.ix_(THERE, THERE)] = ROOT @ ROOT.T
    return covariance


def belief(prior, errors=DEVIATIONS):
    state = scene().pack(effector={"velocity": MEASURED[:3], "angular_velocity": MEASURED[3:]})
    measured = em.Belief(problem(state=state), velocity={"effector": errors})
    return informed(measured, {"effector": prior})


def twists(problems):
    """Of the effector in each, (N, 6)."""
    place = problems[0].scene.slice("effector").start
    return np.array([np.asarray(one.state)[place + 7 : place + 13] for one in problems])


def product(deviations=DEVIATIONS):
    """Mean and covariance of the two normal distributions' product, by their precisions."""
    errors = np.linalg.inv(np.diag(deviations[THERE] ** 2))
    prior = np.linalg.inv(ROOT @ ROOT.T)
    covariance = np.linalg.inv(errors + prior)
    return covariance @ (errors @ MEASURED[THERE] + prior @ MEAN[THERE]), covariance


@pytest.mark.parametrize("errors", [DEVIATIONS.tolist(), np.diag(DEVIATIONS**2)])
def test_a_normal_prior_and_normal_errors_multiply_in_closed_form(errors):
    prior = stats.multivariate_normal(MEAN, prior_covariance(), allow_singular=True)
    own = belief(prior, errors)
    found = twists(own.particles(2048).problems)
    mean, covariance = product()
    assert found[:, THERE].mean(axis=0) == pytest.approx(mean, abs=2e-4)
    assert np.cov(found[:, THERE].T) == pytest.approx(covariance, abs=2e-4)
    assert np.array_equal(found[:, ~THERE], np.tile(MEASURED[~THERE], (2048, 1)))
    assert twists([own.estimate])[0, THERE] == pytest.approx(mean, abs=2e-3)


def test_samples_of_a_normal_prior_say_what_it_says():
    samples = np.random.default_rng(0).multivariate_normal(MEAN, prior_covariance(), 40_000)
    own = belief(samples, DEVIATIONS.tolist())
    found = twists(own.particles(1024).problems)
    mean, covariance = product()
    assert found[:, THERE].mean(axis=0) == pytest.approx(mean, abs=0.01)
    assert np.cov(found[:, THERE].T) == pytest.approx(covariance, abs=0.003)
    (source,) = own.sources
    assert 1000 < source.effective < 40_000 and source.widened == 1


def test_a_normal_prior_with_uniform_errors_is_cut_at_their_ends():
    half = 0.15
    errors = [stats.uniform(-half, 2 * half), 0, 0, 0, 0, 0]
    prior = stats.multivariate_normal(np.zeros(6), np.eye(6) * 0.1**2)
    found = twists(belief(prior, errors).particles(1024).problems)[:, 0]
    low, high = (MEASURED[0] - half) / 0.1, (MEASURED[0] + half) / 0.1
    expected = stats.truncnorm(low, high, scale=0.1)
    assert found.mean() == pytest.approx(expected.mean(), abs=2e-3)
    assert found.std() == pytest.approx(expected.std(), abs=2e-3)
    assert MEASURED[0] - half <= found.min() and found.max() <= MEASURED[0] + half


def test_particles_are_velocities_of_the_prior_that_the_measurement_allows():
    half = 0.3
    errors = [stats.uniform(-half, 2 * half)] * 2 + [0] * 4
    samples = np.random.default_rng(1).uniform(-1, 1, (2000, 6))
    own = belief(samples, errors)
    found = twists(own.particles(64).problems)
    allowed = samples[(np.abs(samples - MEASURED)[:, :2] <= half).all(axis=1)]
    assert {tuple(row) for row in found[:, :2].round(9)} <= {
        tuple(row) for row in allowed[:, :2].round(9)
    }
    assert np.allclose(found[:, 2:], MEASURED[2:])
    (source,) = own.sources
    assert source.effective == pytest.approx(len(allowed)) and len(source.inputs) == 1


def test_errors_count_as_larger_until_ten_samples_fit():
    """Samples in steps of 1 cm/s, the nearest 1.5 times the error away."""
    errors = [stats.uniform(-0.1, 0.2)] + [0] * 5
    samples = np.zeros((100, 6))
    samples[:, 0] = MEASURED[0] + 0.15 + 0.01 * np.arange(100)
    (source,) = belief(samples, errors).sources
    assert source.effective >= 10
    assert 2.4 <= source.widened <= 2.4 * 1.1


def test_a_measurement_that_contradicts_its_prior_is_refused():
    away = [
        np.full((50, 6), 9.0),
        stats.multivariate_normal(np.full(6, 9.0), np.eye(6) * 0.01),
    ]
    uniform = [stats.uniform(-0.1, 0.2)] * 2 + [0] * 4
    for prior in away:
        for errors in (DEVIATIONS.tolist(), uniform):
            with pytest.raises(
                ContradictionError, match=r"prior\['effector'\].* contradict each other"
            ):
                belief(prior, errors)


@pytest.mark.parametrize(
    ("prior", "message"),
    [
        ([0.1], "expected velocities by the names of bodies"),
        ({}, "expected velocities by the names of bodies"),
        ({"arm": np.zeros((5, 6))}, "prior names 'arm', expected one of floor, object, effector"),
        ({"object": np.zeros((5, 6))}, "expected a body whose velocity has errors"),
        ({"effector": np.zeros((5, 3))}, r"expected velocities of shape \(N, 6\)"),
        ({"effector": np.zeros((1, 6))}, "has 1 velocities, expected two at least"),
        ({"effector": np.full((5, 6), np.nan)}, r"expected velocities of shape \(N, 6\)"),
        ({"effector": stats.multivariate_normal(np.zeros(3), np.eye(3))}, r"expected \(6,\)"),
    ],
)
def test_other_priors_are_refused(prior, message):
    with pytest.raises(ValueError, match=message):
        informed(em.Belief(problem(), velocity={"effector": (0.1,) * 6}), prior)


def test_velocities_are_read_from_states_of_other_motions():
    own = scene(wall=1)
    states = [own.pack(effector={"velocity": (k, 0, 0)}) for k in range(4)]
    found = velocities(own, states)
    assert sorted(found) == ["effector", "object"]
    assert found["effector"].tolist() == [[k, 0, 0, 0, 0, 0] for k in range(4)]
    for wrong in (states[0], np.full((2, len(states[0])), np.nan)):
        with pytest.raises(ValueError, match="states has shape"):
            velocities(own, wrong)


def test_a_prior_of_one_body_leaves_the_errors_of_another_as_they_are():
    errors = {"object": (0.1,) * 6, "effector": (0.1,) * 6}
    still = np.random.default_rng(0).normal(0, 0.01, (500, 6))
    own = informed(em.Belief(problem(), velocity=errors), {"object": still})
    names = [one.inputs[0] for one in own.sources]
    assert names == ["place among the prior's samples", "vx"]
    assert np.abs(own.particles(64).values(own.sources[0])).max() < 0.05
