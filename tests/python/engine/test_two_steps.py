"""Many rollouts with a long step and a few with the scene's too: a multilevel estimate."""

import numpy as np
import pytest
from reacting import on_a_rail

import energymargin as em

STEP = 1 / 240
FORCES = em.disturbances.Uniform(hold=0.1)


def kicked():
    """A ball on a spring that is pushed: with a step of 1/30 s it stays in reach .03 less often."""
    problem = on_a_rail(horizon=0.5, force=(20, 0, 0), spring=True)
    return problem.replace(captured=em.regions.Ball("ball", (0, 0, 0), 0.2))


def asked(problem, **options):
    usual = {"threads": 1, "undisturbed": False}
    return em.capture_probability(problem, disturbance=FORCES, **usual | options)


def test_the_bits_do_not_depend_on_the_threads():
    one, two = (asked(kicked(), step=4 * STEP, rollouts=200, threads=n) for n in (1, 2))
    assert (one.captured, one.repeated, one.steps) == (two.captured, two.repeated, two.steps)
    assert np.array_equal(one.exit_times, two.exit_times)
    assert np.array_equal(one.curve, two.curve)
    assert one.long_step == 4 * STEP and 0 < one.repeated < one.rollouts == 200


def test_its_mean_is_that_of_the_scenes_step_and_its_intervals_hold():
    problem, replicas = kicked(), 200
    truth = asked(problem, rollouts=20000, seed=1).captured
    with_long = asked(problem.with_step(8 * STEP), rollouts=20000, seed=1, drawn_step=STEP).captured
    found = [asked(problem, step=8 * STEP, rollouts=128, seed=s) for s in range(2, 2 + replicas)]
    values = np.array([one.captured for one in found])
    error = values.std() / np.sqrt(replicas)
    assert abs(values.mean() - truth) < 4 * error
    assert abs(with_long - truth) > 6 * error  # which the long step alone is not
    inside = [low <= truth <= high for low, high in (one.interval() for one in found)]
    assert np.mean(inside) >= 0.93


def test_where_steps_agree_a_tolerance_takes_a_fraction_of_the_simulation():
    sure = {"tolerance": 0.03, "seed": 3}
    alone, auto = asked(kicked(), **sure), asked(kicked(), **sure, step="auto")
    low, high = auto.interval()
    assert auto.long_step in (2 * STEP, 4 * STEP, 8 * STEP)
    assert (high - low) / 2 <= 0.03 and auto.steps < 0.6 * alone.steps


def test_where_no_longer_step_helps_auto_takes_none():
    scene = em.Scene()
    scene.add_body("ball", em.Sphere(0.02), mass=0.1, role="object", velocity=(0, 0, 2.0))
    captured = em.regions.HalfSpace("ball", (0.0, 0.0, 1.0), 2.0**2 / (2 * 9.81) - 0.01)
    bounds = {"force": (1e-9,) * 3, "torque": (1e-9,) * 3, "duration": 0.1, "check": 0.025}
    problem = em.Problem(scene, scene.pack(), horizon=0.5, captured=captured, **bounds)
    auto, alone = asked(problem, step="auto"), asked(problem)
    assert auto.long_step is None and auto.repeated == 0
    assert auto.captured == alone.captured and auto.steps > alone.steps  # the trial counts


def test_problems_of_two_steps_meet_the_same_disturbances():
    slow = kicked().with_step(7 * STEP + STEP)
    together = asked(slow, rollouts=400, drawn_step=STEP).exit_times
    apart = asked(slow, rollouts=400).exit_times
    own = asked(kicked(), rollouts=400).exit_times
    differ = [np.sum(np.isinf(one) != np.isinf(own)) for one in (together, apart)]
    assert differ[0] < 0.5 * differ[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"step": STEP / 2}, r"step is 0\.00208\d*, expected a longer one than the scene's"),
        ({"step": 0.007}, "expected whole steps"),
        ({"step": "long"}, "step is 'long'"),
        ({"step": 4 * STEP, "above": 0.5}, "step is given with above"),
        ({"step": "auto", "success": True}, "success"),
        ({"step": "auto", "design": "sobol"}, "step is given with design"),
        ({"step": "auto", "rare": True, "undisturbed": True}, "step is given with rare=True"),
    ],
)
def test_what_does_not_go_together_is_refused_by_name(options, words):
    with pytest.raises((ValueError, TypeError), match=words):
        asked(kicked(), **options)
