"""Engines of simulators that have one state at a time, saved as numbers or under handles."""

import time

import numpy as np
import pytest
from own_engines import PointMass, floating, pushed_evenly

import energymargin as em

STEP = 1 / 240


class Ball:
    """A simulator with one state."""

    def __init__(self):
        self.position, self.velocity = np.zeros(3), np.zeros(3)

    def step(self, force):
        self.velocity = self.velocity + STEP * force
        self.position = self.position + STEP * self.velocity


class Snapshot:
    """What it goes on from, which is no number."""

    def __init__(self, ball):
        self.parts = ball.position, ball.velocity


class OneBall(em.engines.Serial):
    """That of the example, one ball after the other."""

    name, step, commands = "one ball", STEP, {"wind": 0.0}

    def __init__(self, saved=None, most=1000):
        self.ball, self.saved, self.most, self.released = Ball(), saved, most, 0

    def digest(self):
        return "one ball"

    def put(self, state):
        self.ball.position, self.ball.velocity = state[:3].copy(), state[7:10].copy()

    def save(self):
        ball = self.ball
        return Snapshot(ball) if self.saved is None else [*ball.position, *ball.velocity]

    def restore(self, saved):
        parts = saved.parts if self.saved is None else np.split(saved, 2)
        self.ball.position, self.ball.velocity = parts

    def release(self, saved):
        self.released += 1

    def advance(self, pushes, commands):
        self.ball.step(pushes[0, :3] + [commands["wind"], 0, 0])

    def read(self):
        return np.array([*self.ball.position, 0, 0, 0, 1, *self.ball.velocity, 0, 0, 0])

    def bodies(self):
        return self.read()[None]


class OneThread(OneBall):
    """It says if two threads are in it at once."""

    def __init__(self):
        super().__init__(6)
        self.inside, self.met = 0, 0

    def start(self, states):
        return self._alone_in(super().start, states)

    def play(self, batch):
        return self._alone_in(super().play, batch)

    def _alone_in(self, ask, given):
        self.inside += 1
        self.met += self.inside > 1
        time.sleep(1e-3)  # the other thread goes on meanwhile
        answer = ask(given)
        self.inside -= 1
        return answer


def test_one_thread_at_a_time_starts_and_plays():
    engine = OneThread()
    problems = [floating(engine) for _ in range(40)]
    em.score(problems, ["probability"], rollouts=4, threads=4)
    assert engine.met == 0


@pytest.mark.parametrize("saved", [None, 6])
def test_one_after_the_other_has_the_bits_of_all_together(saved):
    engine = OneBall(saved)
    problem = floating(engine)
    em.engines.check(engine, problem)
    draws = pushed_evenly(problem, 0.5)
    plan = em.Plan(step=0.25, targets={"wind": [0.05, 0.0]})
    one, all_ = (
        em.capture_probability(asked.replace(plan=plan), disturbance=draws, rollouts=60)
        for asked in (problem, floating(PointMass()))
    )
    np.testing.assert_array_equal(one.exit_times, all_.exit_times)
    efforts = [em.escape_effort(floating(of), nodes=400).effort for of in (engine, PointMass())]
    assert efforts[0] == pytest.approx(efforts[1], rel=1e-12)


def test_handles_are_released_by_count_and_made_again_where_they_are_asked_for():
    few, many = OneBall(most=20), OneBall(most=100_000)
    found = [em.escape_effort(floating(of, force=5.0), nodes=150) for of in (few, many)]
    np.testing.assert_array_equal(found[0].tree.states, found[1].tree.states)
    assert found[0].effort == found[1].effort
    assert len(few.handles) <= 20 and few.released > 100 and len(many.handles) > 20


def test_a_state_whose_way_is_forgotten_is_named():
    engine = OneBall(most=1)
    with pytest.raises(RuntimeError, match=r"more than 100: expected handles of a larger `most`"):
        em.escape_effort(floating(engine, force=5.0), nodes=200)


class Shared(OneBall):
    """Its snapshots are one and the same."""

    def restore(self, saved):
        pass


class Hidden(OneBall):
    """It goes on from how often it was asked, too."""

    count = 0

    def advance(self, pushes, commands):
        self.count += 1
        super().advance(pushes * (1 + 1e-6 * self.count), commands)


@pytest.mark.parametrize("engine", [Shared(), Hidden()])
def test_what_is_not_restored_is_found(engine):
    with pytest.raises(ValueError, match=r"expected the same bits|works .* from f \. v"):
        em.engines.check(engine, floating(PointMass()))


def test_a_ball_that_diverges_is_counted():
    class Wild(OneBall):
        def advance(self, pushes, commands):
            super().advance(pushes if pushes[0, 0] < 0.4 else pushes * np.nan, commands)

    p = em.capture_probability(floating(Wild()), rollouts=20, most_diverged=1.0)
    assert 0 < p.diverged < 20
