"""The guard in front of a policy. A box slides without friction between two edges; an action is the
velocity that its robot gives it."""

import threading
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from sliding import EDGE, diverging, problem

import energymargin as em
from energymargin.act.choosing import choose
from energymargin.actions import Noise
from energymargin.monitor import Alarm

STEP = 0.25  # s
ROLLOUTS = 12
LOW = Alarm(0.7)
WALK = 0.5  # m/s, the policy's
FORCE = 1.0  # N for half a second; moves the box by at most 0.19 m in a second


def moving(state, time, action):
    """The box at a place with a velocity, which it keeps for a second."""
    return problem(state[0], action[0]).replace(force=(FORCE, 0, 0), succeeded=None)


def ahead(state, time):
    """What the monitor asks: the policy goes on."""
    return problem(state[0], WALK).replace(force=(FORCE, 0, 0), succeeded=None)


def walk(observation):
    return np.array([WALK])


def stop(observation):
    return np.array([0.0])


def watching(problem_of=ahead, alarm=LOW, **words):
    return em.Monitor(problem_of, alarm=alarm, rollouts=ROLLOUTS, threads=1, **words)


class Gate:
    """A problem_of that answers while it is open."""

    def __init__(self):
        self._may = threading.Event()
        self.open, self.shut = self._may.set, self._may.clear

    def __call__(self, state, time):
        self._may.wait()
        return ahead(state, time)


def guarded(policy=walk, fallback=stop, monitor=None, **words):
    chosen = {"problem_of": moving, "rollouts": ROLLOUTS, "threads": 1, "confidence": 0.6, **words}
    return em.Guard(policy, watching() if monitor is None else monitor, fallback, **chosen)


def walked(guard, steps=20):
    """Where the box is after each step."""
    places, x = [], 0.0
    for k in range(steps):
        x += STEP * guard(x, time=k * STEP, state=[x])[0]
        places.append(x)
    return places


def test_a_policy_that_walks_off_an_edge_is_held():
    assert 20 * STEP * WALK > 2 * EDGE  # on its own it is far outside
    decisions = []
    with guarded(on_decision=decisions.append) as guard:
        places = walked(guard)
    assert max(places) < EDGE
    assert decisions[0].source == "policy" and guard.last.source == "fallback"
    assert guard.last is decisions[-1] and guard.last.reason == "alarm"
    assert guard.last.probabilities[1] > guard.last.probabilities[0]
    counts = guard.counters
    assert counts.decisions == counts.policy + counts.candidate + counts.fallback == 20
    assert counts.alarm == sum(decision.reason == "alarm" for decision in decisions)
    assert counts.rollouts == sum(decision.rollouts for decision in decisions) > 0


def test_where_the_margin_is_fine_the_policys_own_object_passes_and_nothing_is_asked():
    action = np.array([np.pi])

    def never(_, __=None, ___=None):
        raise AssertionError("asked")

    with guarded(lambda _: action, never, problem_of=never, candidates=never) as guard:
        assert guard(None, time=0.0, state=[0.0]) is action
        assert guard.last.reason == "fine" and guard.counters.rollouts == 0


def test_a_candidate_that_is_better_is_taken():
    with guarded(fallback=None, candidates=lambda *_: [np.array([-0.2])]) as guard:
        assert guard(None, time=0.0, state=[0.95])[0] == -0.2
        assert guard.last.source == "candidate" and guard.last.rollouts == 2 * ROLLOUTS


def test_the_fallback_is_taken_where_nothing_reaches_the_least_probability():
    """Outside by more than any action brings back in a second."""
    with guarded(least=0.5, candidates=Noise(2, 0.1)) as guard:
        assert guard(None, time=0.0, state=[3.0])[0] == 0
        assert guard.last.source == "fallback" and guard.last.reason == "alarm"
        assert (guard.last.probabilities == 0).all()
    with guarded(candidates=Noise(2, 0.1)) as guard:  # no better than the policy
        assert guard(None, time=0.0, state=[3.0])[0] == WALK


def test_an_action_that_reaches_the_least_probability_goes_before_the_fallback():
    """Too few rollouts to show with this confidence that it is better."""
    with guarded(
        least=0.9, confidence=0.9999, rollouts=2, candidates=lambda *_: [np.array([-0.5])]
    ) as guard:
        assert guard(None, time=0.0, state=[0.95])[0] == -0.5
        assert guard.last.source == "candidate"


@pytest.mark.parametrize(
    ("unknown", "action", "source"),
    [(None, 0.0, "fallback"), ("policy", WALK, "policy"), ("ask", WALK, "policy")],
)
def test_without_a_fresh_reading_it_does_what_was_chosen(unknown, action, source):
    """The monitor fails from the second state on; its last reading ages."""

    def failing(state, time):
        if time > 0:
            raise ArithmeticError("no state estimate")
        return ahead(state, time)

    with guarded(monitor=watching(failing), unknown=unknown) as guard:
        assert guard(None, time=0.0, state=[0.0])[0] == WALK and guard.last.reason == "fine"
        assert guard(None, time=0.1, state=[0.0])[0] == action
        assert guard.last.reason == "unknown" and guard.last.source == source
        assert isinstance(guard.last.reading.error, ArithmeticError)


def test_without_a_question_about_actions_the_fallback_is_taken_while_the_alarm_is_on():
    with guarded(problem_of=None) as guard:
        places = walked(guard)
        assert guard.counters.candidate == 0 and guard.counters.rollouts == 0
    assert max(places) < EDGE
    assert guard.last.source == "fallback" and guard.last.reason == "alarm"


def test_a_guard_that_is_closed_takes_no_state():
    guard = guarded()
    guard.close()
    with pytest.raises(RuntimeError, match="closed"):
        guard(None, time=0.0, state=[0.0])


def test_closing_ends_a_call_that_asks_its_actions():
    asked = threading.Event()

    def long(state, time, action):
        asked.set()
        return problem().replace(force=(1e-4, 0, 0), horizon=60.0)  # stays between the edges

    guard = guarded(problem_of=long, rollouts=100_000)
    closer = threading.Thread(target=lambda: (asked.wait(), guard.close()))
    closer.start()
    with pytest.raises(em.Cancelled):
        guard(None, time=0.0, state=[0.95])
    closer.join()


def test_a_loop_does_not_wait_for_its_monitor_and_a_reading_counts_until_it_is_stale():
    gate = Gate()
    with guarded(monitor=watching(gate), max_age=0.25) as guard:
        assert guard(None, time=0.0, state=[0.0])[0] == 0  # no reading yet
        assert guard.last.reading is None and guard.last.reason == "unknown"
        gate.open()
        guard.monitor.wait()
        gate.shut()
        guard(None, time=0.25, state=[0.0])
        assert guard.last.reason == "fine" and guard.last.reading.time == 0
        guard(None, time=0.5, state=[0.0])
        assert guard.last.reason == "unknown"  # older than 0.25 s
        gate.open()


def test_the_same_seed_takes_the_same_actions():
    def played(seed, threads):
        with guarded(candidates=Noise(3, 0.3), seed=seed, threads=threads) as guard:
            first = walked(guard)
            guard.reset()
            assert guard.last is None
            assert walked(guard) == first
        return first

    assert played(0, 1) == played(0, 2)
    assert played(0, 1) != played(1, 1)


def test_a_question_that_fails_is_the_fallback_or_without_one_an_error():
    def broken(state, time, action):
        raise ArithmeticError("no scene")

    with guarded(problem_of=broken) as guard:
        assert guard(None, time=0.0, state=[0.95])[0] == 0
        assert guard.last.source == "fallback"
        assert isinstance(guard.last.error, ArithmeticError)
    with (
        guarded(fallback=None, candidates=Noise(1, 0.1), problem_of=broken) as guard,
        pytest.raises(ArithmeticError, match="no scene"),
    ):
        guard(None, time=0.0, state=[0.95])


def test_actions_that_would_not_meet_the_same_disturbances_are_not_compared():
    def weaker(state, time, action):
        return moving(state, time, action).replace(force=(FORCE * (1 + action[0]), 0, 0))

    said = "the problem of action 1 has the force bounds .* candidates meet the same disturbances"
    with (
        guarded(fallback=None, candidates=Noise(1, 0.1), problem_of=weaker) as guard,
        pytest.raises(ValueError, match=said),
    ):
        guard(None, time=0.0, state=[0.95])


@pytest.mark.parametrize(
    ("candidates", "kind", "message"),
    [
        (lambda *_: 1 / 0, ZeroDivisionError, "division"),
        (lambda *_: None, ValueError, "candidates returned None, expected actions"),
        (lambda *_: [[0.1], np.array([np.nan])], ValueError, "an action of candidates is array"),
        (Noise(2, (1.0, 2.0)), ValueError, "spread has shape"),
    ],
)
def test_candidates_that_fail_are_the_fallback_or_without_one_an_error(candidates, kind, message):
    with guarded(candidates=candidates) as guard:
        assert guard(None, time=0.0, state=[0.95])[0] == 0
        assert guard.last.source == "fallback" and guard.last.reason == "alarm"
        assert isinstance(guard.last.error, kind) and guard.last.rollouts == 0
    with (
        guarded(fallback=None, candidates=candidates) as guard,
        pytest.raises(kind, match=message),
    ):
        guard(None, time=0.0, state=[0.95])


def test_an_error_of_the_fallback_comes_out_of_the_call_that_needs_it():
    def broken(observation):
        raise ArithmeticError("no brakes")

    with guarded(fallback=broken, candidates=Noise(1, 0.1)) as guard:
        assert guard(None, time=0.0, state=[0.0])[0] == WALK
        with pytest.raises(ArithmeticError, match="no brakes"):
            guard(None, time=0.25, state=[0.95])
    with (
        guarded(fallback=lambda _: np.nan) as guard,
        pytest.raises(ValueError, match="an action of fallback is nan, expected finite numbers"),
    ):
        guard(None, time=0.0, state=[0.95])


@pytest.mark.parametrize("action", [np.nan, np.array([0.1, np.inf]), np.float32(-np.inf)])
@pytest.mark.parametrize("unknown", ["fallback", "policy"])
@pytest.mark.parametrize("place", [0.0, 0.95])
def test_a_policys_action_that_is_not_finite_never_passes(action, unknown, place):
    """Neither with the alarm off nor on."""
    with guarded(lambda _: action, unknown=unknown) as guard:
        assert guard(None, time=0.0, state=[place])[0] == 0
        assert guard.last.source == "fallback" and guard.last.reason == "unknown"
        assert "an action of policy is" in str(guard.last.error)
        assert guard.counters.unknown == 1
    with (
        guarded(lambda _: action, fallback=None, candidates=Noise(1, 0.1)) as guard,
        pytest.raises(ValueError, match=r"an action of policy is .* expected finite numbers"),
    ):
        guard(None, time=0.0, state=[place])


@pytest.mark.parametrize("action", [{"speed": np.nan}, "left", np.array([1, 2]), None])
def test_an_action_that_is_no_float_and_no_array_of_floats_passes_as_it_is(action):
    with guarded(lambda _: action) as guard:
        assert guard(None, time=0.0, state=[0.0]) is action


@pytest.mark.parametrize(
    "disturbance",
    [
        em.disturbances.Boltzmann(1.0),
        em.disturbances.Gaussian(0.5, 0.0, 0.1),
        lambda random, times: np.zeros((len(times), 6)),
    ],
)
def test_a_guard_takes_the_disturbances_of_a_probability(disturbance):
    with guarded(disturbance=disturbance) as guard:
        guard(None, time=0.0, state=[0.95])
        assert guard.last.error is None and guard.last.rollouts > 0


@pytest.mark.parametrize("time", ["a", None, np.nan])
def test_a_time_that_is_no_finite_number_is_refused(time):
    with guarded() as guard, pytest.raises(ValueError, match=r"time is .*, expected a finite"):
        guard(None, time=time, state=[0.0])


class Share(NamedTuple):
    """A capture probability as the rule of choosing reads it."""

    captured: float
    effective: float
    rollouts: int = 30
    diverged: int = 0


@pytest.mark.parametrize("others", [1, 3, 10])
def test_the_guides_table_says_from_which_probability_on_no_other_action_is_asked(others):
    guide = (Path(__file__).parents[3] / "docs/guides/policies.md").read_text()
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in guide.splitlines()]
    (head,) = [cells for cells in lines if cells[:1] == ["other actions"]]
    (row,) = [cells for cells in lines if cells[:1] == [str(others)]]
    for rollouts, told in zip(head[1:], row[1:], strict=True):
        n = int(rollouts.split()[0])

        def taken(captured, n=n):
            """With another action that is always captured."""
            shares = [Share(captured / n, n)] + [Share(1.0, n)] * others
            return choose(others + 1, shares.__getitem__, 0.95)[0]

        assert f"{min(k for k in range(n + 1) if not taken(k)) / n:.2f}" == told


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"policy": None}, "policy is None, expected a function"),
        ({"monitor": 3}, "monitor is 3, expected an em.Monitor"),
        ({"problem_of": lambda state: state}, r"problem_of takes .* \(state, time, action\)"),
        ({"fallback": None}, "candidates and fallback are None"),
        ({"confidence": 1.0}, "confidence is 1.0"),
        ({"confidence": "x"}, "confidence is 'x', expected a number from 0.5 to below 1"),
        ({"disturbance": "x"}, "disturbance is 'x', expected a model of em.disturbances, a func"),
        ({"disturbance": em.disturbances.Uniform}, "disturbance is <class"),
        ({"disturbance": lambda random: 1}, r"disturbance takes .* \(random, times\)"),
        ({"problem_of": None, "least": 0.9}, "least is 0.9 without problem_of"),
        (
            {"problem_of": None, "disturbance": em.disturbances.Uniform()},
            r"disturbance is Uniform\(.*\) without problem_of",
        ),
        ({"least": 2.0}, "least is 2.0"),
        ({"least": 0.5, "fallback": None, "candidates": Noise(1, 1.0)}, "without a fallback"),
        ({"max_age": -1.0}, "max_age is -1"),
        ({"unknown": "guess"}, "unknown is 'guess'"),
        ({"problem_of": None, "candidates": Noise(1, 1.0)}, "without problem_of"),
        ({"problem_of": None, "unknown": "ask"}, "unknown is 'ask' without problem_of"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"candidates": 4}, "candidates is 4"),
    ],
)
def test_bad_arguments_are_refused(words, message):
    with pytest.raises(ValueError, match=message):
        guarded(**words)


def test_a_monitor_without_an_alarm_is_refused():
    with watching(alarm=None) as monitor, pytest.raises(ValueError, match="has no alarm"):
        guarded(monitor=monitor)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((0, 1.0), "count is 0"),
        ((1, -1.0), "spread is -1"),
        ((1, 1.0, 2, 1), "low is 2"),
        ((2, 0.0), "spread is 0.0, expected a number above 0, or an array"),
        ((2, (0.0, np.nan)), "spread is .* expected a number above 0, or an array"),
        ((2, "x"), "spread is 'x', expected a number or an array of numbers"),
        ((2, ((1.0,), (1.0, 2.0))), "spread is .* expected a number or an array of numbers"),
        ((2, 1.0, "a"), "low is 'a', expected a number or an array of numbers"),
        ((2, 1.0, 0.0, None), "high is None, expected a number or an array of numbers"),
        ((2, 1.0, (0.0, 0.0), (1.0,) * 3), r"high has shape \(3,\), expected that of low, \(2,\)"),
    ],
)
def test_noise_that_cannot_be_is_refused(words, message):
    with pytest.raises(ValueError, match=message):
        Noise(*words)


@pytest.mark.parametrize(
    ("words", "action", "message"),
    [
        ((3, (1.0, 2.0, 3.0)), 1.0, r"spread has shape \(3,\), .* the action's shape \(\)"),
        ((2, ((1.0,), (100.0,))), [1.0], r"spread has shape \(2, 1\), .* shape \(1,\)"),
        ((2, (1.0, 2.0)), [1.0], r"spread has shape \(2,\), .* shape \(1,\)"),
        ((2, 1.0, (0.0, 0.0)), [1.0], r"low has shape \(2,\), .* shape \(1,\)"),
        ((2, 1.0, 0.0, (2.0,)), 1.0, r"high has shape \(1,\), .* shape \(\)"),
        ((2, 1.0), "left", "action is 'left', expected a number or an array of numbers"),
    ],
)
def test_noise_of_another_shape_than_the_action_is_refused(words, action, message):
    with pytest.raises(ValueError, match=message):
        Noise(*words)("o", action, np.random.default_rng(0))


def test_noise_of_the_actions_shape_moves_each_of_its_numbers_by_its_own_spread():
    noise = Noise(50, (0.0, 2.0), (-9.0, -1.0))
    drawn = np.array(noise(None, np.array([3, 0]), np.random.default_rng(0)))
    assert drawn.shape == (50, 2)
    assert (drawn[:, 0] == 3).all() and drawn[:, 1].min() == -1 and drawn[:, 1].max() > 1


def test_noise_stays_within_its_bounds():
    drawn = np.array(Noise(100, 1.0, -0.5, 0.25)(None, [0.0, 0.0], np.random.default_rng(0)))
    assert drawn.shape == (100, 2) and drawn.min() == -0.5 and drawn.max() == 0.25


def test_a_margin_whose_rollouts_diverge_is_unknown():
    monitor = watching(disturbance=diverging(2))
    with guarded(monitor=monitor) as guard:
        assert guard(0.0, time=0.0, state=[0.0])[0] == 0.0
    assert (guard.last.source, guard.last.reason) == ("fallback", "unknown")
    assert guard.last.reading.diverged == 2 and guard.last.error is None


@pytest.mark.parametrize("least", [0.0, 0.1])
def test_an_action_whose_rollouts_diverge_is_taken_where_nothing_else_is_known(least):
    always = watching(alarm=Alarm(2.0))
    with guarded(monitor=always, disturbance=diverging(2), least=least) as guard:
        assert guard(0.0, time=0.0, state=[0.0])[0] == 0.0
    assert (guard.last.source, guard.last.diverged) == ("fallback", 2)
    assert np.isnan(guard.last.probabilities).tolist() == [True, False]
    all_ = {"disturbance": diverging(1000), "candidates": lambda o, a, r: [np.array([0.1])]}
    with guarded(monitor=watching(alarm=Alarm(2.0)), fallback=None, **all_) as guard:
        assert guard(0.0, time=0.0, state=[0.0])[0] == WALK
    assert np.isnan(guard.last.probabilities).all() and guard.last.diverged == 2 * ROLLOUTS
