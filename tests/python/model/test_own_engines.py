import pickle
import time
import types
from dataclasses import replace

import numpy as np
import pytest
from known_losses import STRONG, Well
from own_engines import NumpyWell, PointMass, floating, pushed_evenly

import energymargin as em

STEP = 1 / 240


class Forgetful(PointMass):
    """It goes on from the velocity of its last call."""

    def play(self, batch):
        answer = super().play(batch)
        self.mass *= 1.01
        return answer


class Neighbourly(PointMass):
    """A row depends on how many there are."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        return states + 1e-9 * len(states), memory, work


class Lazy(PointMass):
    """It tells half the work."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        return states, memory, work / 2


class Broad(PointMass):
    """Its work has a column too many."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        return states, memory, np.repeat(work, 2, axis=2)


class Positive(PointMass):
    """It tells the size of the work alone."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        return states, memory, np.abs(work)


class Frugal(PointMass):
    """It has one array for all answers."""

    room = np.empty((9, 99, 13))

    def play(self, batch):
        states, memory, work = super().play(batch)
        self.room[: len(states), : states.shape[1]] = states
        return self.room[: len(states), : states.shape[1]], memory, work


class Single(PointMass):
    """It has the numbers of a graphics card."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        return states.astype(np.float32), memory, work


class Bent(PointMass):
    """Its quaternions are not of length 1."""

    def play(self, batch):
        states, memory, work = super().play(batch)
        states[..., 3:7] *= 1.5
        return states, memory, work


class Windy(PointMass):
    """A wind that is drawn where a rollout starts."""

    memory = 1

    def start(self, states):
        return np.random.default_rng().normal(size=(len(states), 1))

    def play(self, batch):
        wind = {"wind": np.repeat(batch.memory, batch.steps, axis=1)}
        return super().play(replace(batch, commands=wind))


class Rooted(PointMass):
    """It starts where it first did."""

    memory, home = 13, None

    def start(self, states):
        self.home = states[:1].copy() if self.home is None else self.home
        return np.repeat(self.home, len(states), axis=0)

    def play(self, batch):
        states, _, work = super().play(replace(batch, states=batch.memory))
        return states, states[:, -1], work


class Crowded(PointMass):
    """Two threads at once mix its batches."""

    concurrent = True

    def play(self, batch):
        self.batch = batch
        time.sleep(1e-3)
        return super().play(self.batch)


class Rounding(PointMass):
    """What goes on has been rounded."""

    memory = 1

    def start(self, states):
        return np.zeros((len(states), 1))

    def play(self, batch):
        begun = batch.memory[:, :1] > 0
        batch = replace(batch, states=np.where(begun, batch.states.round(9), batch.states))
        states, _, work = super().play(batch)
        return states, batch.memory + 1, work


class Stubborn(PointMass):
    """It varies a mass, and stays as it is."""

    varies = types.MappingProxyType({"mass.ball": 1.0})

    def varied(self, changes):
        return self


class Nameless(PointMass):
    """Each time it is asked it is another one."""

    def digest(self):
        return repr(time.perf_counter_ns())


def test_point_mass_keeps_the_contract():
    em.engines.check(PointMass(), floating(PointMass()))


@pytest.mark.parametrize(
    ("engine", "broken"),
    [
        (Forgetful(), "asked again"),
        (Positive(), "works"),
        (Frugal(), "wrote over the states"),
        (Single(), "states of dtype float32"),
        (Bent(), "what is no state: .* unit quaternion"),
        (Windy(), "start asked again has other memory"),
        (Rooted(), r"'ball' is faster by 0.01 m/s have the same states"),
        (Crowded(), "beside other threads .*concurrent = False"),
        (Rounding(), "saved and goes on"),
        (Stubborn(), r"varied\({'mass.ball': 1.25}\) has 1.0"),
        (Nameless(), "expected one text for one engine"),
        (Neighbourly(), "row 0 alone"),
        (Lazy(), "works"),
        (Broad(), "work of the engine 'point mass' has the shape"),
    ],
)
def test_check_names_the_promise_that_is_broken(engine, broken):
    with pytest.raises(ValueError, match=broken):
        em.engines.check(engine, floating(PointMass()))


def test_probability_is_that_of_the_closed_form():
    # x = T (T + step) / 2 F / m, with F even within +-0.5 N: lost where it is beyond 2 cm.
    problem = floating(PointMass())
    draws = pushed_evenly(problem, 0.5)
    way = 0.5 * problem.horizon * (problem.horizon + STEP) * 0.5
    p = em.capture_probability(problem, disturbance=draws, rollouts=2000)
    low, high = p.interval(0.999)
    assert low < 0.02 / way < high
    native = em.capture_probability(problem.with_engine("native"), disturbance=draws, rollouts=2000)
    np.testing.assert_array_equal(p.exit_times, native.exit_times)


def test_effort_is_that_of_the_closed_form():
    # The least work is that of a push at the start, and a drift of 2 cm in half a second.
    problem = floating(PointMass(), force=5.0)
    found = em.escape_effort(problem, nodes=3000)
    least = 0.5 * (0.02 / 0.5) ** 2
    assert least < found.effort < 1.2 * least


@pytest.mark.parametrize("threads", [1, 3])
def test_bits_are_those_of_any_number_of_rollouts_and_threads(threads):
    problem = floating(PointMass())
    many = em.capture_probability(problem, rollouts=150, threads=threads, seed=3)
    few = em.capture_probability(problem, rollouts=7, threads=1, seed=3)
    np.testing.assert_array_equal(many.exit_times[:7], few.exit_times)
    one = em.capture_probability(problem, rollouts=1, first=100, seed=3)
    assert one.exit_times[0] == many.exit_times[100]


def test_rare_loss_is_that_of_the_backward_equation():
    well = Well(damping=STRONG, temperature=0.03)
    loss = well.loss()
    problem = well.problem.with_engine(NumpyWell(well))
    p = em.capture_probability(
        problem, disturbance=well.disturbance, rare=True, rollouts=400, seed=1
    )
    low, high = p.interval(0.99, "lost")
    assert low < loss < high
    assert loss < 1e-2


def test_engine_with_a_policy_is_asked_at_its_control_times():
    asked = []

    def act(seen, memory, time):
        asked.append(time)
        return np.full((len(seen), 1), 0.3)

    policy = em.Policy(act, period=0.1, command=["wind"], name="wind")
    problem = floating(PointMass(), force=1e-6).replace(plan=policy)
    p = em.capture_probability(problem, rollouts=3)
    assert p.captured == 0.0  # 0.3 N over half a second are 3.8 cm
    assert sorted(set(np.round(asked, 3))) == [0.0, 0.1, 0.2, 0.3]  # then all are lost
    escape = em.escape_effort(problem, nodes=20)
    assert escape.effort == 0.0


def test_plan_commands_the_engine():
    problem = floating(PointMass(), force=1e-6)
    plan = em.Plan(step=0.25, targets={"wind": [0.3, 0.0]})
    p = em.capture_probability(problem.replace(plan=plan), rollouts=2)
    way = 0.3 * 0.25 * (0.25 + STEP) / 2
    time = 0.25 + (0.02 - way) / (0.3 * 0.25)  # seen at the next look
    assert p.exit_times[0] == pytest.approx(time, abs=1 / 50)


def test_world_and_guard_and_ranking_know_it():
    problem = floating(PointMass(), force=0.5)
    world = em.World(problem.scene)
    rollout = world.rollout(problem.state, [0.5, 0, 0, 0, 0, 0], 0.5)
    speed = 0.25
    assert rollout.effort == pytest.approx(speed**2 / 2)
    assert rollout.state[7] == pytest.approx(speed)
    plans = [em.Plan(step=0.5, targets={"wind": [wind]}) for wind in (0.0, 0.2)]
    ranking = em.rank([problem.replace(plan=plan) for plan in plans])
    assert ranking.best == "0"


def test_what_it_cannot_do_is_refused_by_name(tmp_path):
    problem = floating(PointMass())
    world = em.World(problem.scene)
    wrench = np.zeros(6)
    for ask in (
        lambda: world.rollout(problem.state, wrench, 0.1, audit=True),
        lambda: world.contacts(problem.state),
        lambda: problem.replace(plan=em.Plan(step=0.5, wrenches={"ball": [wrench]})),
        lambda: problem.replace(plan=em.Plan(step=0.5, targets={"sun": [1.0]})),
        lambda: problem.with_step(1 / 480),
        lambda: problem.save(tmp_path / "problem.json"),
        lambda: em.Problem.from_json(problem.to_json()),
    ):
        with pytest.raises(ValueError, match=r"point mass|engine"):
            ask()


def test_problem_goes_with_its_engine_to_another_process():
    plan = em.Plan(step=0.5, targets={"wind": [0.1]})
    problem = floating(PointMass()).replace(plan=plan)
    again = pickle.loads(pickle.dumps(problem))
    assert isinstance(again.scene.engine, PointMass)
    one, other = (em.capture_probability(p, rollouts=20) for p in (problem, again))
    np.testing.assert_array_equal(one.exit_times, other.exit_times)


def test_store_knows_an_engine_by_its_digest():
    texts = {floating(PointMass(mass)).to_json() for mass in (1.0, 2.0)}
    assert len(texts) == 2
    assert floating(PointMass()).to_json() != floating("native").to_json()


def test_error_of_an_engine_goes_on():
    class Broken(PointMass):
        def play(self, batch):
            raise RuntimeError("no fuel")

    with pytest.raises(RuntimeError, match="no fuel"):
        em.capture_probability(floating(Broken()), rollouts=2)


def test_engine_that_diverges_is_counted():
    class Wild(PointMass):
        def play(self, batch):
            states, memory, work = super().play(batch)
            states[batch.pushes[:, 0, 0, 0] > 0] = np.nan
            return states, memory, work

    p = em.capture_probability(floating(Wild()), rollouts=40, most_diverged=1.0)
    assert 5 < p.diverged < 35
    assert p.diverged == np.isnan(p.exit_times).sum()


def test_timeout_ends_it_between_calls():
    class Slow(PointMass):
        def play(self, batch):
            time.sleep(0.05)
            return super().play(batch)

    p = em.capture_probability(floating(Slow()), rollouts=5000, timeout=0.5)
    assert 0 < p.rollouts < 5000


def test_a_timeout_that_is_shorter_than_all_rollouts_keeps_those_that_were_done():
    class Slow(PointMass):
        def play(self, batch):
            time.sleep(0.01 * len(batch.pushes))
            return super().play(batch)

    p = em.capture_probability(floating(Slow()), rollouts=200, timeout=1.0)
    assert 16 <= p.rollouts < 200
    whole = em.capture_probability(floating(PointMass()), rollouts=200)
    np.testing.assert_array_equal(p.exit_times, whole.exit_times[: p.rollouts])
