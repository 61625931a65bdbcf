"""How much it can take: critical values against closed forms, and what is said of the others."""

import json
from functools import partial

import numpy as np
import pytest
from command_line import invoke
from scipy import stats

import energymargin as em
from energymargin.act.quantities import Quantity

G = 9.81
NOTHING = em.disturbances.Uniform(0.0)  # all draws are alike
RADIUS, HORIZON = 0.02, 1.0


def on_slope(
    friction=0.4, angle=20.0, *, push=1.0, size=(0.1, 0.1, 0.04), x=0.0, down=(1, 0), **changes
):
    """A block on a slope, which slides or topples down, along x or where it is said."""
    turn = np.deg2rad(angle)
    scene = em.Scene(gravity=(*(G * np.sin(turn) * np.array(down)), -G * np.cos(turn)))
    scene.add_plane("floor", friction=friction)
    at = (x, 0, size[2] / 2)
    scene.add_body("object", em.Box(size), mass=0.5, position=at, friction=1.0, role="object")
    changes = {"force": (push, push, 0), "horizon": HORIZON, **changes}
    return em.Problem(
        scene,
        scene.pack(),
        torque=(0, 0, 0),
        duration=0.2,
        captured=em.regions.Ball("object", (0, 0, size[2] / 2), RADIUS),
        start_outside=True,
        **changes,
    )


def test_the_least_friction_on_a_slope():
    """It may slide by RADIUS within the horizon: a = 2 r / t^2, mu = tan(angle) - a / g cos."""
    turn = np.deg2rad(20.0)
    mu = np.tan(turn) - 2 * RADIUS / HORIZON**2 / (G * np.cos(turn))
    found = em.critical_value(on_slope, "friction", (0.05, 1.0), disturbance=NOTHING, seed=3)
    assert found.side == "above" and found.monotone and found.complete
    low, high = found.interval()
    assert low <= mu <= high and high - low <= 0.011 * mu
    assert found.rollouts <= 400


def test_the_largest_angle_of_a_tall_block():
    """It topples beyond atan(w / h)."""
    angle = np.rad2deg(np.arctan(0.05 / 0.2))

    def of_angle(value):
        return on_slope(1.0, value, size=(0.05, 0.05, 0.2), horizon=3.0)

    found = em.critical_value(of_angle, "angle", (5, 25), unit="deg", disturbance=NOTHING)
    assert found.side == "below"
    assert found.low - 0.01 * angle <= angle <= found.high + 0.01 * angle


def test_both_ends_of_a_place_are_found():
    def of_offset(value):
        return on_slope(angle=0.0, x=value)

    found = em.critical_value(of_offset, "offset", (-0.1, 0.1), unit="m", disturbance=NOTHING)
    assert not found.monotone and len(found.crossings) == 2
    for (value, low, high, side), edge, holds in zip(
        found.crossings, (-RADIUS, RADIUS), ("above", "below"), strict=True
    ):
        assert low <= edge <= high and value == pytest.approx(edge, rel=0.05) and side == holds


def trial(probability, seed=0, count=20_000):
    """Draws that hold where a number of their own, even in 0..1, is below the probability."""
    own = np.random.default_rng(seed).random(count)
    return lambda value, numbers: own[np.asarray(numbers)] < probability(value)


def bell(value, middle, width):
    return np.exp(-(((value - middle) / width) ** 2))


@pytest.mark.parametrize(
    ("probability", "crossings", "sides"),
    [
        (lambda v: 1 - 0.4 * bell(v, 5, 1), [5 - 1.442, 5 + 1.442], ["below", "above"]),
        (lambda v: 1 - bell(v, 3.3, 0.3), [3.3 - 0.519, 3.3 + 0.519], ["below", "above"]),
        (lambda v: 0.6 + 0.4 * bell(v, 5, 1), [5 - 0.365, 5 + 0.365], ["above", "below"]),
        (lambda v: 3.0 < v < 3.7, [3.0, 3.7], ["above", "below"]),
        (lambda v: v < 2 or v > 7, [2.0, 7.0], ["below", "above"]),
        (
            lambda v: 0.5 + 0.5 * np.cos(2 * np.pi * v / 5),
            [0.359, 4.641, 5.359, 9.641],
            ["below", "above"] * 2,
        ),
        (lambda v: v % 4.2 < 2.1, [2.1, 4.2, 6.3, 8.4], ["below", "above"] * 2),
        (
            lambda v: v % 2.9 < 1.45,
            [1.45, 2.9, 4.35, 5.8, 7.25, 8.7],
            ["below", "above"] * 3,
        ),
    ],
)
def test_dips_and_bumps_have_all_their_crossings_and_warn(probability, crossings, sides):
    with pytest.warns(em.PlausibilityWarning, match="load is not monotone"):
        found = em.critical_value_of(trial(probability), "load", (0.0, 10.0))
    assert found.monotone is False and [side for *_, side in found.crossings] == sides
    for (value, low, high, _), right in zip(found.crossings, crossings, strict=True):
        assert low - 0.03 <= right <= high + 0.03 and low <= value <= high


def test_a_bump_that_is_hardly_enough_ends_and_claims_no_more_than_is_known():
    """Outcomes that differ at each value, about the probability that is asked for."""

    def noise(value, numbers):
        return np.random.default_rng([int(value * 1e6), *numbers]).random(len(numbers)) < 0.95

    with pytest.warns(em.PlausibilityWarning):
        found = em.critical_value_of(noise, "nothing", (0.0, 10.0))
    assert found.side == "unknown" and np.isnan(found.value)


def test_a_range_of_many_decades_is_searched_by_ratios_at_its_low_end_too():
    found = em.critical_value_of(trial(lambda v: v < 3.3e-7), "load", (1e-9, 1.0))
    assert found.low <= 3.3e-7 <= found.high <= 1.02 * found.low
    ends = (1e-300, 1e300)
    found = em.critical_value_of(trial(lambda v: v < 1e200), "load", ends, tolerance=0.1)
    assert found.low <= 1e200 <= found.high <= 1.3 * found.low


@pytest.mark.parametrize("probability", [0.99, 0.01, 0.999])
def test_a_probability_near_the_ends_has_as_many_draws_as_its_interval_needs(probability):
    found = em.critical_value_of(trial(lambda v: v < 3.7), "load", (0, 10), probability=probability)
    assert found.low <= 3.7 <= found.high <= 1.02 * found.low


def test_nineteen_of_twenty_intervals_hold_and_none_claims_what_is_not():
    """At least 93 % of 200, for four laws; and no side of what does nothing."""

    def falls(v):
        return 1 / (1 + np.exp(2 * (v - 5)))

    for asked, of, right in [
        (0.95, falls, 5 - np.log(19) / 2),
        (0.5, falls, 5.0),
        (0.8, lambda v: falls(10 - v), 5 + np.log(4) / 2),
        (0.9, lambda v: np.clip((9 - v) / 8, 0, 1), 1.8),
    ]:
        held = 0
        for seed in range(200):
            found = em.critical_value_of(trial(of, seed), "load", (0, 10), probability=asked)
            held += found.low <= right <= found.high
        assert held >= 186
    for seed in range(200):
        found = em.critical_value_of(trial(lambda _: 0.95, seed), "nothing", (0, 10))
        assert found.side not in ("below", "above") and np.isnan(found.value)


def test_what_is_not_known_moves_the_value_by_its_quantile():
    """The mean friction that holds with 95 % is 1.645 deviations above the one that holds."""
    turn, deviation = np.deg2rad(20.0), 0.03
    least = np.tan(turn) - 2 * RADIUS / HORIZON**2 / (G * np.cos(turn))
    asked = {"disturbance": NOTHING, "draws": 240}
    known = em.beliefs.Uncertainty(friction={"floor": deviation})
    found = em.critical_value(on_slope, "friction", (0.2, 0.8), uncertainty=known, **asked)
    assert found.low <= least + stats.norm.ppf(0.95) * deviation <= found.high
    assert found.high - found.low <= 2 * deviation and found.monotone


def test_a_quantity_whose_own_distribution_is_given_is_refused():
    problem, vary = on_slope(0.5), {"friction.floor": (0.2, 0.8)}
    about = em.beliefs.Uncertainty(friction={"floor": 0.03})
    assert em.critical_values(problem, vary, uncertainty=about, disturbance=NOTHING).complete
    fixed = em.beliefs.Uncertainty(friction={"floor": stats.uniform(0.2, 0.2)})
    with pytest.raises(ValueError, match=r"vary is 'friction.floor', whose distribution"):
        em.critical_values(problem, vary, uncertainty=fixed, disturbance=NOTHING)


def test_any_trial_has_a_critical_value():
    """Draw j is lost above a number of its own; some draws do not count."""

    def outcomes(value, numbers):
        own = [np.random.default_rng(j).normal(5.0, 1.0) for j in numbers]
        return np.where(np.array(numbers) % 200 == 7, np.nan, np.array(own) > value)

    found = em.critical_value_of(outcomes, "load", (0.0, 10.0), unit="kg", draws=400)
    assert found.low <= stats.norm.ppf(0.05, 5.0, 1.0) <= found.high and found.side == "below"
    assert found.diverged == 2 and found.steps == 0
    with pytest.raises(ValueError, match=r"outcomes_of returned .* for 16 draws, expected as many"):
        em.critical_value_of(lambda value, numbers: [value], "load", (0.0, 10.0))


def test_the_line_between_held_and_lost():
    """A force F pulls a block on a floor: it slides by RADIUS if mu < F / m g - 2 r / t^2 g."""

    def pulled(mass, friction):
        problem = on_slope(friction, 0.0)
        scene = em.Scene()
        scene.add_plane("floor", friction=friction)
        block = {"mass": mass, "position": (0, 0, 0.02), "friction": 1.0, "role": "object"}
        scene.add_body("object", em.Box((0.1, 0.1, 0.04)), force=(2.0, 0, 0), **block)
        return problem.replace(scene=scene)

    axes = ("mass", (0.3, 6.0), "kg"), ("friction", (0.02, 1.0))
    curve = em.critical_curve(pulled, *axes, points=5, disturbance=NOTHING)
    expected = 2.0 / curve.values / G - 2 * RADIUS / HORIZON**2 / G
    low, high = curve.band.T
    inside = (expected > 0.02) & (expected < 1.0)
    assert inside.sum() >= 3 and curve.complete and curve.confidence == 0.95
    assert ((0.99 * low <= expected) & (expected <= 1.01 * high))[inside].all()
    assert np.allclose(curve.curve[inside], expected[inside], rtol=0.01)
    assert "| mass | friction | interval |" in curve.to_markdown()


def on_tray(acceleration=2.0, friction=0.3):
    scene = em.Scene()
    tray = {"mass": 1.0, "kinematic": True, "position": (0, 0, -0.01), "role": "effector"}
    scene.add_body("tray", em.Box((1.0, 1.0, 0.02)), friction=1.0, **tray)
    cup = {"mass": 0.2, "position": (0, 0, 0.02), "friction": friction, "role": "object"}
    scene.add_body("cup", em.Box((0.08, 0.08, 0.04)), **cup)
    speeds = np.zeros((60, 6))
    speeds[:, 0] = acceleration * (np.arange(60) + 0.5) / 60
    plan = em.Plan(1 / 60, velocities={"tray": speeds})
    place = em.regions.Ball("cup", (0, 0, 0.03), RADIUS, "tray")
    none = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    return em.Problem(scene, scene.pack(), captured=place, horizon=1.0, plan=plan, **none)


def test_a_tray_may_go_so_much_faster():
    """Its acceleration grows with the square of the speed; the cup slides above mu g."""
    found = em.critical_values(on_tray(), {"speed": (0.5, 4.0)}, disturbance=NOTHING)
    speed = np.sqrt(0.3 * G / (2.0 - 2 * RADIUS))
    assert found[0].side == "below" and found.nominals == (1.0,)
    assert found[0].value == pytest.approx(speed, rel=0.02)


@pytest.mark.parametrize("name", ["speed", "horizon"])
def test_a_range_that_holds_no_time_is_refused_by_the_quantity(name):
    with pytest.raises(ValueError, match=f"no problem has {name} 0: .*change the range"):
        em.critical_values(on_tray(), {name: (0.0, 4.0)})


def damped(delay=2, gain=10.0):
    """A free body that a feedback slows down: v' = -gain v, some periods later."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("object", em.Sphere(0.05), mass=1.0, velocity=(0.2, 0, 0), role="object")
    law = {"observed": ["object.vx"], "corrected": ["object.fx"], "period": 1 / 120}
    plan = em.Feedback([[gain]], delay=delay, **law)
    still = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 8.0}
    place = em.regions.Ball("object", (0, 0, 0), 0.2)
    return em.Problem(scene, scene.pack(), captured=place, plan=plan, **still)


def test_the_delay_and_the_gain_of_a_feedback_have_stability_limits():
    """v' = -k v(t - tau) is stable up to k tau = pi / 2; a command is held for half a period in the
    mean."""
    ranges = {"delay": (0.0, 0.5), "gain": (0.5, 30.0)}
    delay, gain = em.critical_values(damped(), ranges, disturbance=NOTHING)
    assert delay.side == gain.side == "below"
    half = 0.5 / 120
    assert delay.value == pytest.approx(np.pi / 20 - half, abs=1.5 / 120)
    assert gain.value == pytest.approx(np.pi / 2 / 10 / (2.5 / 120), rel=0.1)


def test_a_policy_without_a_name_has_the_same_limit_of_its_delay():
    law = {"observe": ["object.vx"], "command": ["object.fx"], "period": 1 / 120, "delay": 2}
    policy = em.Policy(lambda seen, memory, time: -10.0 * seen, **law)
    (found,) = em.critical_values(
        damped().replace(plan=policy), {"delay": (0.0, 0.5)}, disturbance=NOTHING
    )
    assert found.side == "below"
    assert found.value == pytest.approx(np.pi / 20 - 0.5 / 120, abs=1.5 / 120)


def test_the_largest_impulse_that_a_block_takes_before_it_leaves_a_circle():
    """J = m v with v^2 = 2 mu g r: friction takes what the impulse gave."""
    friction, mass, radius = 0.4, 0.5, 0.05
    resting = on_slope(friction, 0.0, horizon=0.5)
    place = em.regions.Ball("object", (0, 0, 0.02), radius)

    def kicked(impulse):
        state = resting.state.copy()
        state[resting.scene.slice("object")][7] = impulse / mass
        return resting.replace(captured=place).with_state(state)

    found = em.critical_value(kicked, "impulse", (0.05, 2.0), unit="N s", disturbance=NOTHING)
    impulse = mass * np.sqrt(2 * friction * G * radius)
    assert found.side == "below" and found.monotone
    slack = mass * friction * G / 480  # half of what friction takes in a step
    low, high = found.low - slack, found.high + slack
    assert low <= impulse <= high and high - low < 0.05 * impulse


def test_the_largest_push_that_a_spring_latch_takes():
    """A sudden push F moves a mass on a spring by 2 F / k, a latch that opens at r by k r / 2."""
    stiffness, way = 200.0, 0.02

    def pushed(force):
        scene = em.Scene(gravity=(0, 0, 0), step=1 / 2000)  # a longer step dampens a spring
        scene.add_body("wall", em.Box((0.02,) * 3), mass=0)
        bolt = {"mass": 0.5, "position": (0.1, 0, 0), "force": (force, 0, 0), "role": "object"}
        scene.add_body("bolt", em.Box((0.02,) * 3), **bolt)
        drive = {"stiffness": stiffness, "damping": 0.0, "target": 0.0, "origin": (0.1, 0, 0)}
        scene.add_joint(
            *("latch",), type="prismatic", parent="wall", child="bolt", axis=(1, 0, 0), **drive
        )
        shut = em.regions.Joint("latch", upper=way)
        none = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 1.0}
        return em.Problem(scene, scene.pack(), captured=shut, check=1 / 500, **none)

    found = em.critical_value(pushed, "push", (0.1, 20.0), unit="N", disturbance=NOTHING)
    assert found.side == "below"
    assert found.low * 0.98 <= stiffness * way / 2 <= found.high * 1.02


def test_the_least_force_of_a_grip_that_is_accelerated():
    """F = m (g + a) / 2 mu, less what it may slip within the horizon, 2 r / t^2."""
    friction, mass, acceleration, radius, horizon = 0.5, 0.3, 4.0, 0.01, 0.5

    def gripped(force):
        scene = em.Scene(step=1 / 960)
        scene.add_body("hand", em.Box((0.02,) * 3), mass=1, kinematic=True, position=(0, 0, 0.5))
        block = {"mass": mass, "friction": 1.0, "role": "object"}
        scene.add_body("block", em.Box((0.04, 0.04, 0.06)), **block)
        for side in (-1.0, 1.0):
            scene.add_body(f"pad{side}", em.Box((0.01, 0.03, 0.03)), mass=0.05, friction=friction)
            drive = {"target": 0.01, "stiffness": 2e4, "damping": 60.0, "torque_limit": force}
            rail = {"axis": (-side, 0, 0), "origin": (side * 0.025, 0, -0.5)}
            ends = {"type": "prismatic", "parent": "hand", "child": f"pad{side}"}
            scene.add_joint(f"pad{side}", **ends, **rail, **drive)
        scene.disable_collisions("pad-1.0", "pad1.0")
        speeds = np.zeros((480, 6))
        speeds[:, 2] = acceleration * (np.arange(480) + 0.5) / 960
        plan = em.Plan(1 / 960, velocities={"hand": speeds})
        place = em.regions.Ball("block", (0, 0, -0.5), radius, "hand")
        none = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": horizon}
        return em.Problem(scene, scene.pack(), captured=place, plan=plan, **none)

    found = em.critical_value(gripped, "force", (1.0, 20.0), unit="N", disturbance=NOTHING)
    force = mass * (G + acceleration - 2 * radius / horizon**2) / 2 / friction
    assert found.side == "above"
    assert found.low * 0.98 <= force <= found.high * 1.02


def test_the_force_of_a_drive_and_a_turn_are_quantities():
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("wall", em.Box((0.1, 0.1, 0.1)), mass=0, position=(0, 0, 1))
    arm = {"mass": 1.0, "force": (0, 0, -5.0), "role": "object"}
    scene.add_body("arm", em.Box((0.1, 0.1, 0.1)), position=(0.3, 0, 1), **arm)
    drive = {"stiffness": 1e5, "damping": 1e3, "torque_limit": 8.0, "target": 0.0}
    ends = {"parent": "wall", "child": "arm", "axis": (0, 0, 1), "type": "prismatic"}
    scene.add_joint("lift", origin=(0.3, 0, 0), **ends, **drive)
    none = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 1.0}
    place = em.regions.Ball("arm", (0.3, 0, 1), RADIUS)
    problem = em.Problem(scene, scene.pack(), captured=place, **none)
    found = em.critical_values(problem, {"force.lift": (1.0, 10.0)}, disturbance=NOTHING)
    assert found[0].value == pytest.approx(5.0 - 2 * RADIUS, rel=0.01) and found[0].unit == "N"
    tilted = on_slope(0.9, 0.0, size=(0.04, 0.04, 0.2), horizon=2.0)
    turned = em.critical_values(tilted, {"rx.object": (-0.5, 0.5)}, disturbance=NOTHING)
    assert turned[0].unit == "rad" and len(turned[0].crossings) == 2


@pytest.mark.parametrize(("push", "side"), [(0.001, "everywhere"), (5.0, "nowhere")])
def test_what_does_not_cross_is_said_to_be_on_one_side(push, side):
    found = em.critical_value(lambda _: on_slope(push=push), "nothing", (0, 1))
    assert found.side == side and np.isnan([found.value, *found.interval()]).all()
    assert found.crossings == ()


def test_a_quantity_that_does_nothing_has_no_critical_value():
    """Its probability is about the one that is asked for, so nothing can be said."""
    for seed in range(20):
        found = em.critical_value(lambda _: on_slope(push=0.3148), "nothing", (0, 1), seed=seed)
        assert found.side not in ("below", "above") and np.isnan(found.value)


def of_push(value):
    return on_slope(push=value)


def test_an_interval_holds_and_is_cheap():
    """The critical value by 5,000 draws lies in 27 of 30 intervals at least, of 95 %."""
    many = em.critical_value(of_push, "push", (0.05, 20), draws=5000, tolerance=1e-3, seed=77)
    found = [em.critical_value(of_push, "push", (0.05, 20), seed=seed) for seed in range(30)]
    assert sum(one.low <= many.value <= one.high for one in found) >= 27
    assert np.mean([one.rollouts for one in found]) <= 400  # a grid of 20 x 200 has 4,000
    assert np.mean([one.high - one.low for one in found]) <= 0.3 * many.value
    assert (many.outcomes[:, 1] <= many.outcomes[:, 2]).all()


def test_the_bits_are_the_same_on_threads_and_in_a_store(tmp_path):
    asked = {"unit": "N", "seed": 5}
    first = em.critical_value(of_push, "push", (0.05, 20), threads=1, **asked)
    calls = []

    def progress(done, total):
        calls.append((done, total))

    store = tmp_path / "answers.db"
    kept = em.critical_value(of_push, "push", (0.05, 20), threads=2, store=store, **asked)
    again = em.critical_value(of_push, "push", (0.05, 20), store=store, progress=progress, **asked)
    for one in (kept, again):
        assert one.interval() == first.interval() and one.value == first.value
        assert (one.outcomes == first.outcomes).all() and one.steps == first.steps
    assert calls[-1][0] == first.rollouts and all(done <= total for done, total in calls)


def test_draws_that_are_not_lost_on_one_side_alone_are_tested_anew():
    """The way down turns by quarters with the value: another one to a draw, the same to all."""

    def turned(value):
        ways = [(1, 0), (0, 1), (-1, 0), (0, -1)]
        return on_slope(push=value, down=ways[round(1e6 * value) % 4])

    found = em.critical_value(turned, "push", (0.05, 20), seed=1)
    assert not found.monotone and len(found.crossings) == 1
    new = [
        em.capture_probability(of_push(value), rollouts=4000, seed=9, warn=False).value
        for value in found.interval()
    ]
    assert new[0] > 0.95 > new[1]


def test_a_limit_keeps_what_is_known():
    cancel = em.Cancel()

    def progress(done, total):
        if done > 150:
            cancel.set()

    found = em.critical_value(of_push, "push", (0.05, 20), progress=progress, cancel=cancel)
    whole = em.critical_value(of_push, "push", (0.05, 20))
    assert not found.complete and found.low <= whole.low <= whole.high <= found.high
    assert found.monotone is None  # it was not tried
    with pytest.raises(TimeoutError, match="before the first values were tried"):
        em.critical_value(of_push, "push", (0.05, 20), timeout=1e-9)


class Calls(list):
    """A progress that is false as long as it is empty."""

    def __call__(self, done, total):
        self.append((done, total))


def test_a_progress_is_called_whatever_its_truth_is():
    several, race = Calls(), Calls()
    em.critical_values(on_slope(0.6), {"push": (0.05, 20)}, progress=several)
    em.rank({"a": on_slope(0.6), "b": on_slope(0.4)}, rollouts=16, progress=race)
    assert several and race


def test_a_limit_among_several_quantities_keeps_those_that_are_done():
    cancel, asked = em.Cancel(), {"push": (0.05, 20), "mass.object": (0.1, 2.0)}
    whole = em.critical_values(on_slope(0.6), asked)

    def progress(done, total):
        if done >= whole[0].rollouts:
            cancel.set()

    found = em.critical_values(on_slope(0.6), asked, progress=progress, cancel=cancel)
    assert found[0].value == whole[0].value and not found.complete
    assert found[1].side == "unknown" and found[1].range == (0.1, 2.0)
    assert np.isnan(found.margins[1]) and found.tightest is found[0]


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"range": (1, 1)}, r"range is \(1, 1\), expected \(low, high\), which rise"),
        ({"range": 3}, "range is 3, expected"),
        ({"probability": 1.0}, "probability is 1.0, expected a number"),
        ({"confidence": 1.5}, "confidence is 1.5"),
        ({"tolerance": 0.0}, "tolerance is 0"),
        ({"draws": 3}, "draws is 3"),
        ({"metric": "effort"}, "metric is 'effort'"),
        ({"problem_of": lambda value: value}, "the problem of push 0.05 is 0.05"),
        ({"problem_of": lambda _: on_slope(horizon=None)}, "without a horizon"),
        ({"problem_of": lambda v: on_slope(-v)}, "no problem has push 0.05: .*change the range"),
    ],
)
def test_bad_arguments_are_named(changes, match):
    asked = {"problem_of": of_push, "quantity": "push", "range": (0.05, 20)} | changes
    with pytest.raises((ValueError, TypeError), match=match):
        em.critical_value(**asked)


def test_several_quantities_have_margins_and_the_tightest_is_named(tmp_path):
    problem = on_slope(0.6, push=0.5)
    asked = {"friction.floor": (0.1, 1.0), "push": (0.1, 20), "y.object": (-0.1, 0.1)}
    found = em.critical_values(problem, asked, seed=2)
    assert [one.unit for one in found] == ["", "N", "m"] and found.complete
    assert found.nominals == pytest.approx((0.6, 0.5, 0.0))
    friction, push, place = found
    assert friction.side == "above" and push.side == "below" and len(place.crossings) == 2
    assert found.margins[0] == pytest.approx((0.6 - friction.value) / 0.6)
    assert found.margins[1] == pytest.approx((push.value - 0.5) / 0.5)
    assert found.tightest is found[int(np.argmin(found.margins))]
    table = found.to_markdown()
    assert "| friction.floor | 0.6 |" in table and f"Tightest: {found.tightest.quantity}" in table
    assert "below" in push.to_markdown()
    assert json.loads(found.to_json())["quantities"][1]["value"] == push.value


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("colour.object", "vary is 'colour.BODY', expected"),
        ("friction.cup", "vary is 'cup', expected"),
        ("x.floor", "vary is 'x.floor', along which that body does not move freely"),
    ],
)
def test_a_quantity_that_a_problem_does_not_have_is_named(name, match):
    with pytest.raises(ValueError, match=match):
        em.critical_values(on_slope(), {name: (0.1, 1.0)})


def test_a_friction_that_a_pair_does_not_follow_is_refused():
    scene = on_slope().scene
    scene.set_friction("floor", "object", 0.8)
    problem = on_slope().replace(scene=scene)
    way = "'floor' was set for the pair and does not follow it, expected 'friction.object,floor'"
    with pytest.raises(ValueError, match=f"'friction.object', whose coefficient with {way}"):
        em.critical_values(problem, {"friction.object": (0.1, 1.0)})
    ranges = {"friction.object,floor": (0.1, 1.0)}
    assert em.critical_values(problem, ranges, disturbance=NOTHING)[0].side == "above"


def test_a_name_that_is_none_is_refused():
    with pytest.raises(TypeError, match="vary has the name 3, expected a str or a Quantity"):
        em.critical_values(on_slope(), {3: (0, 1)})


def test_what_was_asked_is_said_as_it_was():
    own, until = on_slope(0.8, horizon=None), em.regions.Ball("object", (0, 0, 0.02), 0.01)
    lasting = Quantity("load", "N", 1.0, lambda v: own.replace(force=(v, v, 0), horizon=0.1))
    done, ranges = on_slope(0.8, succeeded=until), {"push": (0.1, 1.0)}
    found = [
        em.critical_values(own, {lasting: (0.1, 1.0)}, disturbance=NOTHING),
        em.critical_values(done, ranges, disturbance=NOTHING, metric="probability/success"),
        em.critical_values(done, {"horizon": (0.1, 0.2)}, disturbance=NOTHING),
    ]
    said = [one.question.partition(" with probability")[0].removeprefix("Asked: ") for one in found]
    assert said == ["captured for its horizon", "success within 1 s", "captured for its horizon"]


def test_an_end_is_moved_until_it_holds_with_as_many_draws_as_that_needs():
    """Draws with other luck at each value; of one in five both ends were not found within 120."""

    def luck(value, numbers, seed):
        own = np.random.default_rng([seed, int(value * 1e9)]).random(20_000)
        return own[np.array(numbers)] < 1 / (1 + np.exp(2 * (value - 5)))

    with pytest.warns(em.PlausibilityWarning):
        found = [
            em.critical_value_of(partial(luck, seed=seed), "load", (0.0, 10.0))
            for seed in range(30)
        ]
    assert sum(one.side == "unknown" for one in found) <= 1


def test_a_link_has_no_place_of_its_own():
    scene = em.Scene()
    scene.add_body("post", em.Box((0.1, 0.1, 0.1)), mass=0.0)
    scene.add_body("door", em.Box((0.1, 0.02, 0.1)), mass=1.0, role="object")
    scene.add_joint("hinge", parent="post", child="door", origin=(0.1, 0, 0))
    inside = em.regions.Ball("door", (0.1, 0, 0), 0.1)
    none = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 0.1}
    problem = em.Problem(scene, scene.pack(), captured=inside, **none)
    with pytest.raises(ValueError, match=r"vary is 'x\.door', along which that body does not move"):
        em.critical_values(problem, {"x.door": (-0.1, 0.1)})


def test_the_command_prints_a_table_and_writes_a_card(tmp_path):
    file, card = tmp_path / "block.json", tmp_path / "card.json"
    on_slope(0.6, push=0.5).save(str(file))
    words = ["limits", str(file), "--vary", "friction.floor=0.1:1", "--vary", "push=0.1:20"]
    told = invoke([*words, "-o", str(card)])
    assert told.exit_code == 0 and "| push | 0.5 N | below" in told.output
    assert len(json.loads(card.read_text())["quantities"]) == 2
    page = tmp_path / "card.html"
    assert invoke([*words, "-o", str(page)]).exit_code == 0
    assert "How much it can take: block.json</title>" in page.read_text()
    assert "data:image/png" in page.read_text() and "<td" in page.read_text()
    told = invoke([*words, "--vary", "push=0:30"])
    assert told.exit_code == 2 and "expected each quantity once" in told.output
    told = invoke(["limits", str(file), "--vary", "push=3"])
    assert told.exit_code == 2 and "--vary is 'push=3', expected NAME=LOW:HIGH" in told.output


def test_a_subject_warns_once_for_all_values_and_few_draws_say_that_an_end_is_open():
    def light(push):  # lighter than air, at each value another scene
        scene = em.Scene()
        scene.add_plane("floor", friction=0.4)
        box, mass = em.Box((0.1, 0.1, 0.04)), 1e-5 + 1e-9 * push
        scene.add_body("object", box, mass=mass, position=(0, 0, 0.02), role="object")
        place = em.regions.Ball("object", (0, 0, 0.02), RADIUS)
        asked = {"force": (push, push, 0), "torque": (0, 0, 0), "duration": 0.2, "horizon": 0.5}
        return em.Problem(scene, scene.pack(), captured=place, **asked)

    with pytest.warns(em.PlausibilityWarning) as told:
        em.critical_value(light, "push", (1e-6, 2e-5), draws=40)
    texts = [str(one.message) for one in told]
    assert sum("lighter than air" in text for text in texts) == 1
    assert sum("draws is 40" in text and "Take 72 or more" in text for text in texts) == 1
