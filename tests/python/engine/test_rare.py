"""Rare losses by splitting: against known probabilities, counting, and a second opinion."""

from __future__ import annotations

import known_losses
import numpy as np
import pytest

import energymargin as em

WEAK = known_losses.Well(known_losses.WEAK, 0.04)
PUSHED_OUT = 0.00931  # of a block in space: from a million rollouts of its equation of motion


def block(way: float = 0.2, **keywords: object) -> em.Problem:
    """A block of 1 kg in space under forces of at most 1 N, lost beyond `way` within a second."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(
        "block",
        em.Sphere(0.05),
        mass=1.0,
        role="object",
        linear_factor=(1.0, 0.0, 0.0),
        angular_factor=(0.0, 0.0, 0.0),
    )
    settings = {"captured": em.regions.HalfSpace("block", (1.0, 0.0, 0.0), way), **keywords}
    return em.Problem(
        scene,
        scene.pack(),
        force=(1.0, 0.0, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=0.1,
        horizon=1.0,
        **settings,
    )


def rare(problem: em.Problem, **keywords: object) -> em.CaptureProbability:
    return em.capture_probability(problem, rare=True, **{"rollouts": 400, **keywords})


def holds(p: em.CaptureProbability, truth: float) -> bool:
    low, high = p.interval(which="lost")
    return low <= truth <= high


def overlap(a: em.CaptureProbability, b: em.CaptureProbability) -> bool:
    (low_a, high_a), (low_b, high_b) = a.interval(which="lost"), b.interval(which="lost")
    return max(low_a, low_b) <= min(high_a, high_b)


# -- what it finds


def test_the_backward_equation_agrees_with_counting():
    well = known_losses.Well(known_losses.STRONG, 0.1)
    counted = em.capture_probability(well.problem, rollouts=3000, disturbance=well.disturbance)
    assert holds(counted, well.loss())
    assert well.loss(cells=2) == pytest.approx(well.loss(), rel=0.02)


def test_a_step_of_the_well_is_that_of_the_equation():
    a, b, g = WEAK.step(0, 1, 0)[1], WEAK.step(1e-2, 0, 0)[1] / 1e-2, WEAK.step(0, 0, 1)[1]
    x, v = WEAK.step(0.02, -0.3, 2.0)
    assert v == pytest.approx(-0.3 * a + 0.02 * b + 2.0 * g, rel=1e-9)
    assert x == pytest.approx(0.02 + known_losses.STEP * v, rel=1e-9)


@pytest.mark.parametrize("damping", [known_losses.WEAK, known_losses.STRONG])
def test_a_loss_of_once_in_a_million_is_found(damping):
    well = known_losses.Well(damping, 0.0225)
    p = rare(well.problem, disturbance=well.disturbance, seed=1, rollouts=800)
    low, high = p.interval(which="lost")
    assert low <= well.loss(cells=2) <= high
    assert high < 1e-4
    assert p.levels > 100


@pytest.mark.long
@pytest.mark.parametrize(("ratio", "replicas"), [(7.5, 200), (20.8, 100), (20.8, 200), (20.8, 500)])
def test_19_of_20_intervals_hold_down_to_one_in_a_billion_or_are_warned_of(ratio, replicas):
    well = known_losses.Well(known_losses.WEAK, 0.32 / ratio)
    truth = well.loss(cells=2)
    assert truth == pytest.approx({7.5: 1.02e-3, 20.8: 1.47e-9}[ratio], rel=0.01)
    answers = [
        rare(well.problem, disturbance=well.disturbance, seed=s, rollouts=replicas, warn=False)
        for s in range(20)
    ]
    sure = [p for p in answers if not p.warnings]
    assert sum(holds(p, truth) for p in sure) >= 0.95 * len(sure) - 1
    assert sure or replicas < 12 * -np.log(truth)


@pytest.mark.parametrize("seed", [0, 52])
def test_too_few_replicas_for_a_loss_of_one_in_a_billion_are_warned_of(seed):
    well = known_losses.Well(known_losses.WEAK, 0.32 / 20.8)
    p = rare(well.problem, disturbance=well.disturbance, seed=seed, rollouts=100, warn=False)
    assert "ends far below the loss; take at least 3" in p.warnings[-1]


def test_an_estimate_that_is_worth_more_than_one_loss_does_not_warn():
    p = rare(WEAK.problem, disturbance=WEAK.disturbance)
    assert p.effective * p.lost > 1.0 and not p.warnings


def test_forces_that_are_held_split_without_a_bias():
    found = [rare(block(), seed=seed).lost for seed in range(8)]
    error = np.std(found, ddof=1) / np.sqrt(len(found))
    assert abs(np.mean(found) - PUSHED_OUT) < 3 * error
    assert error < 0.2 * PUSHED_OUT


@pytest.mark.parametrize("ahead", [0.0, 0.3])
def test_noise_that_is_correlated_in_time_agrees_with_counting(ahead):
    noise = em.disturbances.Gaussian(force=0.4, torque=0.0, correlation_time=0.1)
    counted = em.capture_probability(block(), rollouts=4000, disturbance=noise)
    assert overlap(rare(block(), disturbance=noise, ahead=ahead), counted)
    assert 0.001 < counted.lost < 0.1


def test_noise_of_the_plan_agrees_with_counting():
    plan = em.Plan(step=1.0, wrenches={"block": np.zeros((1, 6))})
    noise = em.disturbances.of_plan(force=(1.0, 0.0, 0.0), hold=0.1)
    problem = block(0.3, plan=plan)
    counted = em.capture_probability(problem, rollouts=3000, disturbance=noise)
    assert overlap(rare(problem, disturbance=noise), counted)
    assert 0.001 < counted.lost < 0.1


def test_a_second_opinion():
    """Subset simulation over the random forces as one vector, of another library."""
    ot = pytest.importorskip("openturns")
    steps = round(known_losses.HORIZON / known_losses.STEP)
    a, b, g = WEAK.step(0, 1, 0)[1], WEAK.step(1e-2, 0, 0)[1] / 1e-2, WEAK.step(0, 0, 1)[1]

    def farthest(draws):
        x = v = highest = np.zeros(len(draws))
        for force in WEAK.disturbance.force * np.asarray(draws).T:
            v = a * v + b * x + g * force
            x = x + known_losses.STEP * v
            highest = np.maximum(highest, x)
        return highest[:, None]

    ot.RandomGenerator.SetSeed(0)
    function = ot.PythonFunction(steps, 1, func_sample=farthest)
    draws = ot.RandomVector(ot.Normal(steps))
    event = ot.ThresholdEvent(
        ot.CompositeRandomVector(function, draws), ot.Greater(), known_losses.WAY
    )
    subset = ot.SubsetSampling(event)
    subset.setBlockSize(2000)
    subset.setMaximumOuterSampling(2)
    subset.run()
    second = subset.getResult().getProbabilityEstimate()
    off = 0.5 * subset.getResult().getConfidenceLength(0.99)
    low, high = rare(WEAK.problem, disturbance=WEAK.disturbance, rollouts=600).interval(
        which="lost"
    )
    assert off < second and max(low, second - off) <= min(high, second + off)


# -- what the answer has


def test_its_curve_is_that_of_the_loss_in_full_precision():
    p = rare(WEAK.problem, disturbance=WEAK.disturbance)
    assert (np.diff(p.lost_curve) >= 0.0).all()
    assert p.lost_curve[0] == 0.0
    assert p.lost_curve[-1] == p.lost > 0.0
    assert np.allclose(p.curve, 1.0 - p.lost_curve, rtol=0, atol=1e-15)
    low, high = p.band()
    assert (low <= p.curve).all()
    assert (p.curve <= high).all()
    captured, lost = p.interval(), p.interval(which="lost")
    assert captured == (1.0 - lost[1], 1.0 - lost[0])
    assert p.mean_time == pytest.approx(known_losses.HORIZON, abs=p.lost * known_losses.HORIZON)
    assert p.rollouts == 400
    assert f"lost={p.lost}"[:10] in repr(p)


def test_counting_has_a_loss_too():
    p = em.capture_probability(block(), rollouts=200)
    assert p.lost == 1.0 - p.captured
    low, high = p.interval()
    assert p.interval(which="lost") == (1.0 - high, 1.0 - low)
    assert p.levels == 0


def test_what_cannot_be_reached_is_bounded_by_the_replicas():
    """Clopper and Pearson's bound for no loss among 400 independent rollouts."""
    p = rare(block(100.0))
    assert p.lost == 0.0
    low, high = p.interval(which="lost")
    assert low == 0.0
    assert high == pytest.approx(1 - 0.025 ** (1 / 400))


def test_what_is_outside_at_the_start_is_lost():
    p = rare(block(-0.1, start_outside=True))
    assert p.lost == 1.0
    assert p.curve[0] == 0.0
    assert not p.undisturbed
    assert p.undisturbed_time == 0.0
    assert p.interval(which="lost")[1] == 1.0


def test_an_object_that_comes_back_in_time_is_not_lost():
    """A tenth of a second outside: fewer are lost, and as many as counting says."""
    short = rare(block(), seed=2)
    long = rare(block(dwell=0.1), seed=2)
    counted = em.capture_probability(block(dwell=0.1), rollouts=4000)
    assert overlap(long, counted)
    assert long.lost < 1.5 * short.lost


def test_a_level_of_a_users_own_finds_the_same():
    """Place and a while of its velocity, also of a capture set that has no distance."""
    inside = em.regions.Predicate(lambda states: states[:, 0] <= 0.2)
    p = rare(
        block(captured=inside),
        level=lambda state: state[0] + 0.3 * state[7],
        ahead=0.0,
        rollouts=60,
    )
    assert holds(p, PUSHED_OUT)


# -- how it is called


def test_threads_and_repetitions_change_no_bit():
    one, two = (rare(WEAK.problem, disturbance=WEAK.disturbance, threads=n) for n in (1, 2))
    assert np.array_equal(one.lost_curve, two.lost_curve)
    assert (one.steps, one.effective) == (two.steps, two.effective)
    other = rare(WEAK.problem, disturbance=WEAK.disturbance, seed=1)
    assert other.lost != one.lost


def test_progress_counts_rollouts_and_cancel_ends_the_call():
    counts: list[tuple[int, int]] = []
    rare(WEAK.problem, disturbance=WEAK.disturbance, progress=lambda *told: counts.append(told))
    assert counts[-1][0] > 400
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled):
        rare(block(), cancel=cancel)


def test_complete_batches_count_after_a_cancel():
    """They are a prefix of those of the whole call."""
    calls, cancel = [0], em.Cancel()

    def level(state: np.ndarray) -> float:
        calls[0] += 1
        if calls[0] == last:
            cancel.set()
        return float(state[0])

    last = 0
    whole = rare(block(), level=level, rollouts=100)
    last, calls[0] = calls[0] // 2, 0
    part = rare(block(), level=level, rollouts=100, cancel=cancel, threads=1)
    assert whole.complete
    assert not part.complete
    assert 20 <= part.rollouts < 100
    assert part.rollouts % 5 == 0
    assert part.steps < whole.steps


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"disturbance": em.disturbances.Boltzmann(1.0)}, "disturbance is Boltzmann"),
        ({"disturbance": lambda random, times: np.zeros((len(times), 6))}, "disturbance is a func"),
        ({"tolerance": 0.1}, "tolerance is given with rare=True"),
        ({"success": True}, "success is given with rare=True"),
        ({"by_object": True}, "by_object is given with rare=True"),
        ({"rollouts": 39}, "rollouts is 39, expected a whole number of at least 40"),
        ({"ahead": -1.0}, "ahead is -1"),
        ({"level": lambda state: np.nan}, "level is not a number"),
    ],
)
def test_what_it_cannot_do_is_refused_by_name(keywords, words):
    with pytest.raises(ValueError, match=words):
        rare(block(), **keywords)


def test_a_level_needs_rare():
    for keywords in ({"level": lambda state: 0.0}, {"ahead": 0.1}):
        with pytest.raises(ValueError, match="expected rare=True"):
            em.capture_probability(block(), **keywords)


def test_a_predicate_needs_a_level():
    inside = em.regions.Predicate(lambda states: states[:, 0] <= 0.2)
    with pytest.raises(ValueError, match=r"Predicate, which has no distance.*level="):
        rare(block(captured=inside))


def test_an_error_of_the_level_ends_the_call():
    def fail(state):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        rare(block(), level=fail)
