"""The monitor of a stream of states, its alarm, and the alarm's threshold from data."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from sliding import diverging

import energymargin as em
from energymargin import monitor
from energymargin.act.monitor.stream import SHARE, Pace
from energymargin.monitor import Alarm, Conditions, alarms, first_loss, threshold

BENCH = Path(__file__).parents[3] / "python" / "bench" / "monitor.py"
LONG = 60.0  # s; so long a test waits for what has to come

Question = Callable[[np.ndarray, float], em.Problem]


@pytest.fixture(scope="module")
def problem() -> em.Problem:
    """A block that a random force pushes out of a ball, or not."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("block", em.Box((0.1, 0.1, 0.1)), mass=1.0, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        force=(0.5, 0.5, 0),
        torque=(0, 0, 0),
        duration=0.1,
        horizon=0.5,
        captured=em.regions.Ball("block", (0, 0, 0), 0.05),
    )


@pytest.fixture
def question(problem: em.Problem) -> Question:
    return lambda state, time: problem.with_state(state)


class Gate:
    """A problem_of that says which states it was asked about, and waits until it may answer."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self.asked: list[float] = []
        self.came = threading.Semaphore(0)
        self.may = threading.Semaphore(0)

    def __call__(self, state: np.ndarray, time: float) -> em.Problem:
        self.asked.append(time)
        self.came.release()
        assert self.may.acquire(timeout=LONG)
        return self._question(state, time)

    def wait(self) -> None:
        """Until one more state is asked about."""
        assert self.came.acquire(timeout=LONG)

    def open(self, count: int = 1000) -> None:
        self.may.release(count)


@pytest.fixture
def gate(question: Question) -> Iterator[Gate]:
    one = Gate(question)
    yield one
    one.open()


def at(problem: em.Problem, x: float) -> np.ndarray:
    """The block at rest beside the middle of its ball [m]."""
    state = np.array(problem.state)
    state[0] = x
    return state


def test_a_reading_has_the_bits_of_the_score_of_its_state(problem, question):
    with em.Monitor(question, rollouts=20, seed=3, threads=2) as live:
        live.push(0.5, at(problem, 0.03))
        assert live.wait(LONG)
        reading = live.latest
    again = em.capture_probability(problem.with_state(at(problem, 0.03)), rollouts=20, seed=3)
    assert reading.value == again.captured and 0 < reading.value < 1
    assert reading.interval == again.interval()
    assert np.array_equal(reading.probability.curve, again.curve)
    assert (reading.time, reading.rollouts, reading.error) == (0.5, 20, None)
    assert np.isnan(reading.trend) and reading.lateness > 0


def test_the_newest_waiting_state_is_scored_first_and_the_oldest_is_dropped(problem, gate):
    with em.Monitor(gate, waiting=2, rollouts=2) as live:
        live.push(0, problem.state)
        gate.wait()  # the worker has it
        for number in (1, 2, 3, 4):  # of which two may wait
            live.push(number, problem.state)
        gate.open()
        assert live.wait(LONG)
        assert gate.asked == [0, 4, 3]
        assert [reading.time for reading in live.history] == [0, 3, 4]
        assert live.latest.time == 4
        assert live.counters[:3] == (5, 3, 2)


def test_push_returns_while_every_worker_is_busy(problem, gate):
    with em.Monitor(gate, workers=2, rollouts=2) as live:
        for number in (0, 1):
            live.push(number, problem.state)
            gate.wait()
        assert sorted(gate.asked) == [0, 1]  # both wait in problem_of
        for number in range(2, 100):
            live.push(number, problem.state)
        assert live.counters[:5] == (100, 0, 97, 0, 0) and live.latest is None
        gate.open()
        assert live.wait(LONG)
        assert live.latest.time == 99


def test_the_state_is_copied(problem, gate):
    state = at(problem, 0.0)
    with em.Monitor(gate, rollouts=2) as live:
        live.push(0, state)
        gate.wait()
        state[:] = at(problem, 10.0)
        gate.open()
        assert live.wait(LONG)
        assert live.latest.value == 1


def test_errors_of_a_problem_are_readings_and_the_next_state_is_scored(problem, question, caplog):
    def fragile(state: np.ndarray, time: float) -> em.Problem:
        if state[0] > 1:
            raise LookupError(f"no object at {state[0]:g}")
        return question(state, time)

    heard: list[monitor.Reading] = []
    with (
        caplog.at_level(logging.WARNING, "energymargin.monitor"),
        em.Monitor(fragile, alarm=0.5, rollouts=4, on_reading=heard.append) as live,
    ):
        for moment, x in ((0, 0.0), (1, 2.0), (2, 2.0), (3, np.nan), (4, 0.0)):
            live.push(moment, at(problem, x))
            assert live.wait(LONG)
        history, counters = live.history, live.counters
    assert [type(reading.error) for reading in history] == [
        *(type(None), LookupError, LookupError, ValueError, type(None))
    ]
    assert np.isnan(history[1].value) and history[1].probability is None
    assert (counters.scored, counters.failed) == (2, 3)
    assert heard == list(history)
    assert caplog.text.count("no object at 2") == 1  # the same one is logged once


def test_an_error_of_the_callback_does_not_end_the_readings(problem, question, caplog):
    def stumble(reading: monitor.Reading) -> None:
        raise OSError("the disk is full")

    with em.Monitor(question, rollouts=2, on_reading=stumble) as live:
        for moment in range(3):
            live.push(moment, problem.state)
            assert live.wait(LONG)
        assert live.counters.scored == 3
    assert "on_reading failed: OSError: the disk is full" in caplog.text


def test_the_alarm_goes_on_below_its_threshold_and_off_above_a_higher_one(problem, question):
    with em.Monitor(question, alarm=Alarm(0.4, 0.99), rollouts=40) as live:
        for moment, x in enumerate((0.0, 0.06, 0.03, 0.0)):
            live.push(moment, at(problem, x))
            assert live.wait(LONG)
        values = [reading.value for reading in live.history]
        assert values[0] == values[3] == 1 and values[1] == 0 and 0.4 < values[2] < 0.99
        assert [reading.alarm for reading in live.history] == [False, True, True, False]
        assert not live.alarm


def test_the_trend_is_the_slope_of_the_values_in_its_window(problem, question):
    with em.Monitor(question, rollouts=4, trend_window=1.0) as live:
        for moment, x in ((0.0, 0.06), (2.0, 0.0), (2.5, 0.0), (3.0, 0.06)):
            live.push(moment, at(problem, x))
            assert live.wait(LONG)
        trends = [reading.trend for reading in live.history]
    assert np.isnan(trends[:2]).all()  # the one before is too old
    assert trends[2] == 0
    assert trends[3] == pytest.approx(-1.0)  # of 1, 1, 0 at 2, 2.5 and 3 s


def test_a_reading_is_late_that_comes_a_period_after_its_push(problem, gate):
    with em.Monitor(gate, period=1e-3, rollouts=2) as live:
        live.push(0, problem.state)
        gate.wait()
        time.sleep(2e-3)
        gate.open()
        assert live.wait(LONG)
        assert live.latest.late and live.latest.lateness > 1e-3
        assert live.counters.late == 1
    with em.Monitor(gate, period=LONG, rollouts=2) as live:
        live.push(0, problem.state)
        assert live.wait(LONG)
        assert not live.latest.late and live.counters.late == 0


def test_an_older_state_that_is_scored_later_takes_its_place_and_changes_no_alarm(problem, gate):
    with em.Monitor(gate, alarm=0.5, waiting=2, rollouts=2) as live:
        live.push(0, at(problem, 0.0))
        gate.wait()
        live.push(1, at(problem, 0.06))  # it would raise the alarm
        live.push(2, at(problem, 0.0))
        gate.open()
        assert live.wait(LONG)
        assert [reading.value for reading in live.history] == [1, 0, 1]
        assert [reading.alarm for reading in live.history] == [False] * 3


def test_the_history_is_bounded(problem, question):
    with em.Monitor(question, rollouts=1, kept=3) as live:
        for moment in range(6):
            live.push(moment, problem.state)
            assert live.wait(LONG)
        assert [reading.time for reading in live.history] == [3, 4, 5]


def test_reset_begins_a_new_trajectory(problem, gate):
    with em.Monitor(gate, alarm=0.5, rollouts=2) as live:
        live.push(5, at(problem, 0.06))
        gate.wait()
        gate.open(1)
        assert live.wait(LONG) and live.alarm
        live.push(6, at(problem, 0.06))
        gate.wait()
        live.push(7, at(problem, 0.06))  # it waits
        live.reset()  # while one is scored
        assert not live.alarm and live.latest is None
        live.push(0, at(problem, 0.0))
        gate.open()
        assert live.wait(LONG)
        assert [reading.time for reading in live.history] == [0]
        assert live.counters[:5] == (4, 2, 2, live.counters.late, 0)


def test_close_does_not_wait_for_a_problem_and_no_reading_comes_after_it(problem, gate):
    heard: list[monitor.Reading] = []
    live = em.Monitor(gate, rollouts=2, on_reading=heard.append)
    live.push(0, problem.state)
    gate.wait()
    live.push(1, problem.state)
    live.close()  # the gate is shut: it would wait for ever
    gate.open()
    assert live.wait(LONG)
    assert heard == [] and live.latest is None
    assert live.counters[:5] == (2, 0, 2, 0, 0)
    with pytest.raises(RuntimeError, match="the monitor is closed"):
        live.push(2, problem.state)
    live.close()  # again: nothing happens


def test_close_ends_a_score_that_would_take_for_ever(problem):
    begun = threading.Event()

    def endless(state: np.ndarray, time: float) -> em.Problem:
        begun.set()
        return problem.replace(horizon=1000.0, captured=em.regions.Speed("block", 1e9))

    with em.Monitor(endless, rollouts=10**6, threads=1) as live:
        live.push(0, problem.state)
        assert begun.wait(LONG)
    assert live.wait(LONG)  # the worker has come back
    assert live.counters.scored == 0


def test_a_callback_may_close_the_monitor(problem, question):
    closed = threading.Event()

    def stop(reading: monitor.Reading) -> None:
        live.close()
        closed.set()

    live = em.Monitor(question, rollouts=2, on_reading=stop)
    live.push(0, problem.state)
    assert closed.wait(LONG)


def test_a_task_s_own_plan_is_the_question_of_a_state_and_its_time():
    task = em.tasks.make("push", friction=0.3)
    push = task.rollout(seed=17)
    with em.Monitor(lambda s, t: task.future(s, t, push.params, 0.5), rollouts=4) as live:
        live.push(push.times[2], push.states[2])
        assert live.wait(LONG)
        value = live.latest.value
    ahead = task.future(push.states[2], push.times[2], push.params, 0.5)
    assert value == em.capture_probability(ahead, rollouts=4).captured


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"problem_of": 3}, r"problem_of is 3, expected a function \(state, time\)"),
        (
            {"problem_of": lambda a, b, c: None},
            r"problem_of takes \(a, b, c\), expected a function \(state, time\)",
        ),
        ({"period": 0}, "period is 0, expected a positive number"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"rollouts": (9, 8)}, "rollouts is 8, expected a whole number of at least 9"),
        ({"rollouts": (1, 2, 3)}, r"rollouts is \(1, 2, 3\), expected a number, or"),
        ({"seed": -1}, "seed is -1"),
        ({"disturbance": "x"}, "disturbance is 'x', expected a model of em.disturbances"),
        ({"disturbance": em.disturbances.Uniform}, "disturbance is .*, expected a model"),
        ({"workers": 0}, "workers is 0"),
        ({"threads": 0}, "threads is 0"),
        ({"waiting": 0}, "waiting is 0"),
        ({"kept": 0}, "kept is 0"),
        ({"trend_window": -1}, "trend_window is -1"),
        ({"on_reading": "print"}, "on_reading is 'print', expected a function"),
        ({"alarm": float("nan")}, "on is nan, expected a number"),
    ],
)
def test_bad_arguments_are_named(question, changes, message):
    before = threading.active_count()
    with pytest.raises(ValueError, match=message):
        em.Monitor(**{"problem_of": question, **changes})
    assert threading.active_count() == before  # no worker was left behind


def test_a_state_that_is_no_vector_and_a_time_that_does_not_rise_are_refused(problem, question):
    with em.Monitor(question, rollouts=1) as live:
        live.push(1.0, problem.state)
        with pytest.raises(ValueError, match=r"state has shape \(1, 13\), expected \(n,\)"):
            live.push(2.0, [problem.state])
        with pytest.raises(ValueError, match="time is nan, expected a finite number"):
            live.push(float("nan"), problem.state)
        with pytest.raises(ValueError, match="time is 1 s after 1 s, expected it to rise; reset"):
            live.push(1.0, problem.state)
        assert live.counters.pushed == 1


def test_as_many_rollouts_are_taken_as_fit_into_a_period():
    period = 4 / SHARE  # so that a score may take 4 s
    pace = Pace((5, 200), period)
    assert pace.rollouts == 5
    for expected in (10, 20, 40, 48, 48):  # at most twice as many as before
        pace.note(pace.rollouts, 1.0, pace.rollouts / 16)
        assert pace.rollouts == expected
    pace.note(48, 1.0, 48 / 2)  # the machine has other work: at once
    assert pace.rollouts == 6
    pace.note(6, 10.0, 6 / 16)  # a problem that takes all the time
    assert pace.rollouts == 5
    fixed = Pace(30, period)
    fixed.note(30, 0.0, 100.0)
    assert fixed.rollouts == 30


def test_values_with_a_number_of_rollouts_that_adapts_are_those_of_that_number(problem, question):
    with em.Monitor(question, rollouts=(3, 60), period=LONG, seed=1) as live:
        for moment in range(4):
            live.push(moment, at(problem, 0.03))
            assert live.wait(LONG)
        readings = live.history
    assert [reading.rollouts for reading in readings] == [3, 6, 12, 24]
    for reading in readings:
        again = em.capture_probability(
            problem.with_state(at(problem, 0.03)), rollouts=reading.rollouts, seed=1
        )
        assert reading.value == again.captured


def test_the_benchmark_plays_states_in_real_time_and_counts_them(tmp_path):
    words = ("--seconds", "0.5", "--rate", "20", "--rollouts", "1,4", "--out", "table.md")
    command = [sys.executable, BENCH, *words]
    done = subprocess.run(command, check=False, cwd=tmp_path, capture_output=True)
    assert done.returncode == 0, done.stderr
    (row,) = re.findall(r"pushed, scored.* \| (.*) \|", (tmp_path / "table.md").read_text())
    pushed, scored, dropped, failed = map(int, row.split(","))
    assert pushed == 10 == scored + dropped and scored > 0 and failed == 0


def test_an_alarm_of_n_of_m_waits_for_n_and_goes_off_after_n():
    alarm = Alarm(0.5, 0.7, count=2, window=3)
    values = [0.9, 0.4, 0.9, 0.4, 0.6, 0.8, 0.6, 0.8, np.nan, 0.8]
    assert np.flatnonzero(alarm.follow(values)).tolist() == [3, 4, 5, 6]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"on": "low"}, "on is 'low', expected a number"),
        ({"off": 0.4}, "off is 0.4, expected at least on = 0.5"),
        ({"window": 0}, "window is 0"),
        ({"count": 2}, "count is 2, expected a whole number from 1 to 1"),
    ],
)
def test_an_alarm_that_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Alarm(**{"on": 0.5, **changes})


def test_the_threshold_is_the_kth_smallest_minimum_before_a_loss():
    values = [[0.9, number / 100] for number in range(1, 40)]  # 39 that hold
    values += [[0.9, 0.8, 0.7, 0.005, 0.0], [0.0, 0.0]]  # and two that are lost
    lost = [None] * 39 + [3, 0]
    found = threshold(values, lost, false_alarms=0.05)
    assert found.value == 0.02 and found.rank == 2  # 0.05 * 40 is 2
    assert found.level == pytest.approx(2 / 40) and len(found.statistics) == 39
    assert found.announced.false_alarms == (1, 39)  # 0.01 alone is below
    assert found.announced.announced() == (0, 1)
    strict = threshold(values, lost, false_alarms=0.05, ahead=1)
    assert len(strict.statistics) == 40  # 0.9 and 0.8 of the one lost at frame 3 count too
    assert 0.9 < threshold([[0.95]] * 19, [None] * 19).value < 1.0
    low, high = found.coverage(0.9)
    assert 0 < low < 0.05 < high < 0.2


def test_a_threshold_that_too_few_trajectories_cannot_guarantee_is_refused():
    with pytest.raises(ValueError, match=r"values has 18 trajectories .* at least 19 for"):
        threshold([[1.0]] * 18, [None] * 18)
    assert threshold([[1.0]] * 19, [None] * 19).level == pytest.approx(0.05)
    with pytest.raises(ValueError, match="false_alarms is 1"):
        threshold([[1.0]] * 18, [None] * 18, false_alarms=1)
    with pytest.raises(ValueError, match=r"lost has 1 frames, expected 2, one a trajectory"):
        threshold([[1.0]] * 2, [None])
    with pytest.raises(ValueError, match=r"lost\[0\] is 3, expected a whole number from 0 to 1"):
        threshold([[1.0]], [3])
    with pytest.raises(ValueError, match=r"values\[0\] has shape \(1, 1\)"):
        threshold([[[1.0]]], [None])


@pytest.mark.parametrize(("count", "window"), [(1, 1), (2, 3)])
def test_new_trajectories_have_no_more_false_alarms_than_were_asked_for(count, window):
    """Over 400 calibrations: the mean share is at most the level, and near it."""
    random = np.random.default_rng(0)
    shares = []
    for _ in range(400):
        values = random.random((60, 5)) ** random.random((60, 1))
        found = threshold(
            list(values[:39]), [None] * 39, false_alarms=0.1, count=count, window=window
        )
        assert found.level == pytest.approx(0.1)
        new = alarms(list(values[39:]), [None] * 21, found.alarm())
        shares.append(new.false.mean())
    assert np.mean(shares) == pytest.approx(0.1, abs=0.012)  # 2.5 standard errors or more


def test_the_lead_is_counted_from_the_first_right_alarm_to_the_loss():
    values = [[0.9, 0.1, 0.1, 0.1, 0.0], [0.9, 0.1, 0.9, 0.9, 0.9], [0.9, 0.9, 0.0]]
    lost = [4, 4, 2]
    seen = alarms(values, lost, Alarm(0.5))
    assert seen.leads.tolist() == [3, 3, 0] and not seen.false.any()
    assert not seen.possible.any()
    assert seen.announced(3) == (2, 2) and seen.announced(1) == (2, 3)
    strict = alarms(values, lost, Alarm(0.5), ahead=2)
    assert strict.leads.tolist() == [2, 0, 0]
    assert strict.false.tolist() == [True, True, False]
    assert strict.false_alarms == (2, 2)
    held = alarms([[0.1, 0.9]], [None], Alarm(0.5))
    assert held.false.all() and np.isnan(held.leads).all() and held.announced() == (0, 0)


def test_the_first_loss_is_the_first_frame_outside():
    assert first_loss(np.array([True, True, False, True])) == 2
    assert first_loss(np.array([True, True])) is None
    with pytest.raises(ValueError, match=r"captured has shape \(2,\) of int64, expected"):
        first_loss([1, 0])


def test_what_leaves_where_the_task_is_done_is_not_lost():
    captured, succeeded = np.array([True, True, False, False]), np.array([False, False, True, True])
    assert first_loss(captured, succeeded) is None
    assert first_loss(captured, ~succeeded) == 2
    with pytest.raises(ValueError, match=r"succeeded has shape \(2,\) of bool, expected \(4,\)"):
        first_loss(captured, [True, False])


@pytest.mark.parametrize("name", ["push", "topple"])
def test_a_success_raises_no_alarm(name):
    """A box at the wall is no longer swept, and one that topples has left its edge."""
    task, plain, told = em.tasks.make(name), [], []
    done = [one for one in (task.rollout(seed=seed) for seed in range(8)) if one.success]
    for trajectory in done:
        inside = task.succeeded(trajectory.params).contains(task.layout, trajectory.states)
        for frame in np.flatnonzero(inside):
            state, time = trajectory.states[frame], float(trajectory.times[frame])
            question = task.future(state, time, trajectory.params, 0.5)
            plain.append(em.capture_probability(question, rollouts=5).captured)
            with em.Monitor(lambda state, time, asked=question: asked, rollouts=5) as monitor:
                monitor.push(time, state)
                assert monitor.wait()
                told.append(monitor.latest.value)
    assert np.mean(plain) < 0.8
    assert np.mean(told) > 0.9


@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=12),
    st.integers(1, 4),
    st.integers(0, 3),
    st.floats(0, 1),
)
def test_an_alarm_goes_on_exactly_above_the_statistic_of_its_values(values, count, more, on):
    window = count + more
    several = [values, *[[1.0] * window] * 19]
    found = threshold(several, [None] * 20, count=count, window=window)
    lowest = found.statistics[0]
    raised = Alarm(on, count=count, window=window).follow(values).any()
    if len(values) < count:  # too few for an alarm
        assert not raised and lowest == 1.0
        return
    one = threshold([values] * 19, [None] * 19, count=count, window=window).statistics[0]
    assert raised == (on > one) and lowest <= one


def test_too_many_rollouts_that_diverge_are_nan_with_their_number(question, problem):
    def seen(count):
        words = {"alarm": 2.0, "rollouts": 30, "disturbance": diverging(count)}
        with em.Monitor(question, threads=1, **words) as live:
            live.push(0.0, problem.state)
            assert live.wait(LONG)
            return live.latest, live.counters, live.alarm

    reading, counters, is_on = seen(1)
    assert (reading.diverged, reading.rollouts) == (1, 29) and 0 <= reading.value <= 1
    assert counters.scored == 1 and is_on
    reading, counters, is_on = seen(2)
    assert (reading.diverged, reading.rollouts, reading.error) == (2, 0, None)
    assert np.isnan([reading.value, *reading.interval]).all()
    assert counters.failed == 1 and not is_on  # an alarm stays as it was without a value


CONDITIONS = Conditions(rollouts=4, horizon=0.5, period=0.1)


def found(conditions=CONDITIONS):
    """A threshold of 0.9."""
    return threshold([[0.9]] * 19, [None] * 19, conditions=conditions)


@pytest.mark.parametrize("alarm", [found(), found().alarm(off=0.95)])
def test_a_monitor_takes_a_threshold_that_holds_for_it(problem, question, alarm):
    with em.Monitor(question, alarm=alarm, rollouts=4, period=0.1) as live:
        live.push(0.0, at(problem, 0.1))  # outside
        assert live.wait(LONG)
        assert live.alarm and live.rule.conditions == CONDITIONS


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rollouts": 5}, "rollouts is 5, but the alarm's threshold holds for 4: take that, or"),
        ({"rollouts": (4, 8)}, r"rollouts is \(4, 8\), but"),
        ({"period": 0.2}, r"period is 0.2, but the alarm's threshold holds for 0.1"),
        ({"disturbance": em.disturbances.Uniform(2.0)}, r"disturbance is Uniform\(strength=2.0"),
        ({"alarm": found(None)}, "threshold of 0.9 that does not say what it holds for"),
        ({"alarm": found(None).alarm()}, "threshold of 0.9 that does not say what it holds for"),
    ],
)
def test_a_monitor_refuses_a_threshold_of_other_scores(question, changes, message):
    with pytest.raises(ValueError, match=message):
        em.Monitor(question, **{"alarm": found(), "rollouts": 4, "period": 0.1, **changes})


def test_a_question_with_another_horizon_than_the_thresholds_has_no_score(problem):
    def longer(state, time):
        return problem.with_state(state).replace(horizon=0.6)

    with em.Monitor(longer, alarm=found(), rollouts=4, period=0.1) as live:
        live.push(0.0, problem.state)
        assert live.wait(LONG)
        text = str(live.latest.error)
    assert text.startswith("the problem's horizon is 0.6, but the alarm's threshold holds for 0.5")
    assert np.isnan(live.latest.value) and not live.alarm


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rollouts": 0}, "rollouts is 0"),
        ({"horizon": 0.0}, "horizon is 0.0, expected a positive number"),
        ({"period": -1.0}, "period is -1.0, expected a positive number"),
    ],
)
def test_conditions_that_cannot_be_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(CONDITIONS, **changes)


@pytest.mark.parametrize("endless", [[np.inf, np.inf], [0.5]])
def test_trajectories_on_which_no_alarm_can_be_false_do_not_count(endless):
    values = [[0.3, 0.3], *[endless] * 19]
    with pytest.raises(ValueError, match="values has 1 trajectories in which an alarm can be fal"):
        threshold(values, [None] * 20, count=2, window=2)
    held = [[0.1 + number / 100] * 2 for number in range(19)]
    one = threshold([*held, *[endless] * 19], [None] * 38, count=2, window=2)
    assert (one.rank, len(one.statistics)) == (1, 19) and one.value == 0.1
    assert one.announced.false_alarms == (0, 19)


def test_a_new_trajectory_on_which_an_alarm_can_be_false_has_one_as_seldom_as_was_asked():
    """Although most trajectories have no finite value."""
    random, shares = np.random.default_rng(1), []
    for _ in range(200):
        values = random.random((300, 3))
        values[random.random(300) < 0.8] = np.inf
        one = threshold(list(values[:150]), [None] * 150, false_alarms=0.1)
        new = alarms(list(values[150:]), [None] * 150, one.alarm())
        false, possible = new.false_alarms
        shares.append(false / possible)
    assert np.mean(shares) <= 0.1


def test_models_of_disturbances_are_the_same_that_say_the_same(question):
    def noise(torque):
        return em.disturbances.of_plan((0.1, 0, 0), (0, 0, torque))

    own = found(replace(CONDITIONS, disturbance=noise(0.123456789)))
    words = {"alarm": own, "rollouts": 4, "period": 0.1}
    em.Monitor(question, disturbance=noise(0.123456789), **words).close()
    for other in (noise(0.123456788), None, lambda random, times: None):
        with pytest.raises(ValueError, match=r"disturbance is .*but the alarm's threshold holds"):
            em.Monitor(question, disturbance=other, **words)
