"""How much it can take: critical values against closed forms, and what is said of the others."""

import json

import numpy as np
import pytest
from command_line import invoke

import energymargin as em

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
    with pytest.raises(TimeoutError, match="before the first values were tried"):
        em.critical_value(of_push, "push", (0.05, 20), timeout=1e-9)


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


def test_the_command_prints_a_table_and_writes_a_card(tmp_path):
    file, card = tmp_path / "block.json", tmp_path / "card.json"
    on_slope(0.6, push=0.5).save(str(file))
    words = ["limits", str(file), "--vary", "friction.floor=0.1:1", "--vary", "push=0.1:20"]
    told = invoke([*words, "-o", str(card)])
    assert told.exit_code == 0 and "| push | 0.5 N | below" in told.output
    assert len(json.loads(card.read_text())["quantities"]) == 2
    told = invoke(["limits", str(file), "--vary", "push=3"])
    assert told.exit_code == 2 and "--vary is 'push=3', expected NAME=LOW:HIGH" in told.output
