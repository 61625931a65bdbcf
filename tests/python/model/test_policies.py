"""Robots that react: feedback as data, and policies that are asked."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest
from problem_files import EXECUTABLE
from reacting import (
    DAMPING,
    GAINS,
    PUSHED,
    SEEN,
    STIFFNESS,
    along_x,
    asked,
    feedback,
    on_a_rail,
    policy,
    problem,
)
from scipy import stats

import energymargin as em
from energymargin.evaluate.futures import future_rows
from energymargin.monitor import Alarm
from energymargin.store import score_dataset


def test_a_virtual_spring_holds_as_a_spring_does():
    """The closed loop of a spring: x after a push is that of the oscillator."""
    scene = problem(feedback()).scene
    world = em.World(scene, feedback())
    wrench = np.array([5.0, 0, 0, 0, 0, 0])
    state = world.rollout(scene.pack(), wrench, 0.5).state
    rate = DAMPING / 2
    speed = np.sqrt(STIFFNESS - rate**2)
    swing = np.exp(-rate * 0.5) * (np.cos(speed * 0.5) + rate / speed * np.sin(speed * 0.5))
    assert scene.unpack(state)["ball"]["position"][0] == pytest.approx(
        5.0 / STIFFNESS * (1 - swing), rel=0.01
    )


def test_impedance_is_that_spring():
    stiff, damped = [STIFFNESS] * 3 + [0] * 3, [DAMPING] * 3 + [0] * 3
    plan = em.Feedback.impedance("ball", stiffness=stiff, damping=damped, period=1 / 240)
    times = asked(plan).exit_times, asked(feedback()).exit_times
    assert np.array_equal(*times)


def test_a_delay_of_more_commands_than_a_state_may_hold_is_refused():
    with pytest.raises(ValueError, match=r"delay is 300000000 control periods, expected less than"):
        asked(feedback(period=0.05, delay=300_000_000))


def test_a_delay_that_makes_the_loop_unstable_is_found():
    late = [asked(feedback(period=0.05, delay=delay)).captured for delay in (0, 2)]
    assert late[0] > late[1] + 0.1
    still = em.capture_probability(
        problem(feedback(period=0.05, delay=8, states=[0.01, 0, 0, 0, 0, 0]), horizon=10.0),
        rollouts=1,
        disturbance=em.disturbances.Uniform(strength=0.0),
    )
    assert still.captured == 0


@pytest.mark.parametrize("period", [1 / 240, 1 / 50, 1 / 20])
@pytest.mark.parametrize("delay", [0, 1])
def test_a_policy_that_does_what_a_feedback_does_has_its_futures(period, delay):
    one = asked(feedback(period, delay=delay))
    other = asked(policy(period=period, delay=delay))
    assert np.array_equal(one.exit_times, other.exit_times)
    assert one.steps == other.steps


def test_a_policy_has_the_same_bits_on_any_threads_and_in_any_company():
    net = np.random.default_rng(0).normal(size=(6, 64)), np.random.default_rng(1).normal(size=64)
    act = lambda seen, memory, time: -seen @ GAINS.T + (np.tanh(seen @ net[0]) @ net[1])[:, None]  # noqa: E731
    whole = asked(policy(act), rollouts=100).exit_times
    for rollouts in (1, 7, 100):
        for threads in (1, 2, 8):
            some = asked(policy(act), rollouts=rollouts, threads=threads).exit_times
            assert np.array_equal(some, whole[:rollouts])
    later = asked(policy(act), rollouts=40, first=60).exit_times
    assert np.array_equal(later, whole[60:])


def test_memory_belongs_to_its_rollout():
    """A policy that pushes from its third control time on, by a count in its memory."""

    def act(seen, memory, time):
        assert memory.shape == (32, 1)
        push = np.where(memory >= 2, 40.0, 0.0) * [1, 0, 0]
        return push, memory + 1

    scene = problem().scene
    still = em.capture_probability(problem(policy(act, memory=1), horizon=0.25), rollouts=40,
                                   disturbance=em.disturbances.Uniform(strength=0.0))  # fmt: skip
    # 40 N on 1 kg from 0.1 s on: 0.1 m after 0.071 s more, seen at the next check.
    assert np.ptp(still.exit_times) == 0
    assert 0.17 <= still.exit_times[0] <= 0.2
    assert scene.step < 0.01


def test_an_observe_function_gets_whole_states_and_noise_is_each_rollout_s_own():
    shapes = set()

    def observe(states):
        shapes.add(states.shape)
        return states[:, :3]

    drawn = []

    def act(seen, memory, time):
        drawn.append(seen.copy())
        return np.zeros((len(seen), 3))

    asked(policy(act, observe=observe, noise=0.5), rollouts=20, undisturbed=False)
    assert shapes == {(32, 13)}
    first = drawn[0][:20, 0]
    assert len(set(first)) == 20
    assert np.std(first) == pytest.approx(0.5, rel=0.5)
    before = drawn[0].copy()
    drawn.clear()
    asked(policy(act, observe=observe, noise=0.5), rollouts=20, undisturbed=False)
    assert np.array_equal(drawn[0], before)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda seen, memory, time: np.full((32, 3), np.nan), "asked at 0 s: act returned .nan"),
        (lambda seen, memory, time: seen[:5, :3], r"shape \(5, 3\), expected \(32, 3\)"),
        (lambda seen, memory, time: seen[:, :3].astype(str), "dtype <U"),
        (lambda seen, memory, time: {}["u"], "KeyError: 'u'"),
    ],
)
def test_what_a_policy_does_wrong_is_named(act, words):
    with pytest.raises((ValueError, RuntimeError), match=words):
        asked(policy(act))


@pytest.mark.parametrize("delay", [0, 1])
def test_searches_and_splitting_ask_a_policy_at_its_control_times(delay):
    """A policy that does what a Feedback does has its efforts and its rare losses."""
    one, other = problem(feedback(1 / 20, delay=delay)), problem(policy(delay=delay))
    efforts = [em.escape_effort(p, nodes=60, seed=2).effort for p in (one, other)]
    assert efforts[0] == efforts[1] < np.inf
    rare = [em.capture_probability(p, rare=True, rollouts=60, seed=2).lost for p in (one, other)]
    assert rare[0] == rare[1]


def test_memory_goes_with_the_nodes_of_a_search():
    def act(seen, memory, time):
        assert np.allclose(memory[0], round(time * 20))
        return -seen @ GAINS.T, memory + 1

    assert em.escape_effort(problem(policy(act, memory=1)), nodes=40).effort > 0


def test_until_an_answer_acts_joints_keep_their_targets():
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("base", em.Box((0.1, 0.1, 0.1)), mass=0.0)
    scene.add_body("slide", em.Sphere(0.05), mass=1.0, role="object")
    scene.add_joint("rail", parent="base", child="slide", type="prismatic", axis=(1, 0, 0),
                    stiffness=400.0, damping=40.0, target=0.3)  # fmt: skip
    start = scene.pack(joints={"rail": 0.3})
    bounds = {"force": (1, 1, 1), "torque": (0.1, 0.1, 0.1), "duration": 0.1}
    still = em.disturbances.Uniform(strength=0.0)

    def lost(delay):
        away = em.Policy(
            lambda seen, memory, time: np.full((32, 1), 1.0),
            period=0.1,
            observe=["rail", "rail.velocity"],
            command=["rail"],
            delay=delay,
        )
        near = em.regions.Ball("slide", (0.3, 0, 0), 0.05)
        asked = em.Problem(scene, start, captured=near, horizon=1.0, plan=away, **bounds)
        return em.capture_probability(asked, rollouts=2, disturbance=still).exit_times[0]

    assert lost(3) == pytest.approx(lost(0) + 0.3, abs=0.02)


# Files, stores and other processes


def test_a_file_has_the_name_of_a_policy_in_place_of_its_code(tmp_path):
    held = problem(policy(name="net-1", memory=None, delay=1, limits=([-9] * 3, [9] * 3)))
    held.save(tmp_path / "held.json")
    other = policy(name="net-1", delay=1, limits=([-9] * 3, [9] * 3))
    back = em.Problem.load(tmp_path / "held.json", policies={"net-1": other})
    assert back.to_json() == held.to_json()
    assert back.plan.policy is other
    assert em.Plan.from_json(held.plan.to_json(), {"net-1": other}).policy is other
    assert np.array_equal(asked(back.plan).exit_times, asked(held.plan).exit_times)


def test_a_file_without_the_code_of_its_policy_says_so_in_one_line(tmp_path):
    path = tmp_path / "held.json"
    problem(policy(name="net-1")).save(path)
    with pytest.raises(ValueError, match=r"held.json': plan.policy .*\"net-1\".*policies={\"net-1"):
        em.Problem.load(path)
    ran = subprocess.run([EXECUTABLE, path], capture_output=True, text=True, check=False)
    assert ran.returncode and 'the policy "net-1", whose code no file has' in ran.stderr
    assert ran.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (policy(period=0.1), 'policies."net". has period 0.1, expected that of the file, 0.05'),
        (policy(delay=2), "has delay 2, expected that of the file, none"),
        (policy(memory=1), "has memory 1"),
        (policy(noise=0.1), r"has noise \[0.1\], expected that of the file, none"),
        (policy(observe=None), "has observed none"),
        (feedback(), "is Feedback.*, expected an em.Policy"),
    ],
)
def test_another_policy_than_the_file_was_written_of_is_refused(given, words):
    text = problem(policy(name="net")).to_json()
    with pytest.raises((ValueError, TypeError), match=words):
        em.Problem.from_json(text, policies={"net": given})


def test_a_cache_keeps_evaluations_of_a_policy_by_its_name(tmp_path):
    def tuned(name):
        asked = []

        def stiff(values):
            asked.append(1)
            act = lambda seen, memory, time: asked.append(0) or -values["k"] * seen[:, :3]  # noqa: E731
            return policy(act, name=name and f"{name} {values['k']!r}")

        options = {"rollouts": 4, "budget": 2000, "store": tmp_path / "kept.db"}
        found = em.improve(problem(policy(name="first")), {"k": (1.0, 60.0)}, stiff, **options)
        return found.values["k"], asked.count(0)

    with pytest.raises(ValueError, match=r"a Policy without name=, expected em.Policy"):
        tuned(None)
    best, calls = tuned("stiff")
    assert calls > 0
    assert tuned("stiff") == (best, 0)
    assert tuned("other")[1] > 0


def test_a_store_keeps_scores_of_a_policy_by_its_name(tmp_path, monkeypatch):
    task = type(em.tasks.make("push"))
    original, dataset = task.problem, em.datasets.generate("push", trajectories=1, frames=2, seed=1)

    def scored(name):
        calls = []
        still = em.Policy(
            lambda seen, memory, time: calls.append(time) or np.zeros((32, 2)),
            period=0.1,
            command=["effector.fx", "effector.fy"],
            name=name,
        )
        asks = {"plan": still, "horizon": 0.1, "effector": "coast"}
        monkeypatch.setattr(task, "problem", lambda *given: original(*given).replace(**asks))
        score_dataset(dataset, tmp_path / "s.db", ["probability"], rollouts=2)
        return len(calls)

    with pytest.raises(ValueError, match=r"a Policy without name=, expected em.Policy"):
        scored(None)
    assert scored("still") > 0
    assert scored("still") == 0
    assert scored("other") > 0


CONTROLLERS = """
import numpy as np

class Spring:
    def __init__(self, gains):
        self.gains = gains
    def __call__(self, seen, memory, time):
        return -seen @ self.gains.T
"""


def test_a_policy_has_the_same_bits_in_other_processes(tmp_path, monkeypatch):
    (tmp_path / "controllers.py").write_text(CONTROLLERS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    from controllers import Spring

    held = [problem(policy(Spring(GAINS * k))) for k in (0.2, 1, 2)]
    asked = ["probability", "effort"]
    here, there = (
        em.score(held, asked, rollouts=40, nodes=20, seed=3, executor=executor)
        for executor in (em.executors.Threads(2), em.executors.Processes(2))
    )
    for metric in asked:
        assert np.array_equal(here[metric], there[metric])
    assert len(set(here["effort"])) == 3
    begun = pickle.loads(pickle.dumps(held[0].plan.policy.after([9, 0, 0])))
    assert np.array_equal(begun._first, [[9, 0, 0]])


def test_a_policy_that_cannot_go_to_another_process_says_so():
    with pytest.raises(ValueError, match=r"the policy '<lambda>' cannot be pickled.*no lambda"):
        pickle.dumps(problem(policy()))
    with pytest.raises(ValueError, match=r"problem 0: the policy '<lambda>'.*: use threads"):
        em.score([problem(policy())], ["probability"], executor=em.executors.Processes(1))


def test_code_of_a_file_goes_to_another_process():
    held = problem(policy(spring_of_this_file, name="mine"))
    here, there = (
        em.score([held], ["probability"], rollouts=20, executor=executor)["probability"]
        for executor in (em.executors.Threads(1), em.executors.Processes(1))
    )
    assert here == there


def spring_of_this_file(seen, memory, time):
    return -seen @ GAINS.T


def test_code_that_the_other_process_lacks_is_named(monkeypatch):
    there = types.ModuleType("made_in_this_process")
    exec("def spring(seen, memory, time): return -seen @ gains.T", there.__dict__)
    monkeypatch.setitem(sys.modules, there.__name__, there)
    held = problem(policy(there.spring, name="mine"))
    with pytest.raises(ValueError, match="this process has no code of the policy 'mine'"):
        em.score([held], ["probability"], rollouts=2, executor=em.executors.Processes(1))


def test_controllers_are_ranked_and_their_gains_tuned():
    asked = {"prompt": problem(policy()), "late": problem(policy(delay=2))}
    ranking = em.rank(asked, rollouts=60, seed=1)
    assert ranking.best == "prompt"

    def stiff(values):
        gains = np.hstack([values["k"] * np.eye(3), DAMPING * np.eye(3)])
        return policy(lambda seen, memory, time: -seen @ gains.T)

    found = em.improve(asked["prompt"], {"k": (1.0, 60.0)}, stiff, rollouts=16, budget=40000)
    assert 1.0 <= found.values["k"] <= 60.0


def test_a_policy_meets_beliefs_noise_of_the_robot_and_a_tolerance_as_a_feedback_does():
    belief = {"mass": {"ball": stats.norm(1.0, 0.1)}}
    noise = em.disturbances.of_plan(force=(2.0, 2.0, 2.0), torque=(0, 0, 0))
    found = []
    for one in (problem(policy()), problem(feedback(1 / 20))):
        kept = em.score_belief(em.Belief(one, **belief), ["probability"], particles=6)
        noisy = em.capture_probability(one, disturbance=noise, rollouts=40, seed=5)
        narrow = em.capture_probability(one, tolerance=0.1, seed=5)
        alone = em.World(one.scene, one.plan).rollout(one.state, [5.0, 0, 0, 0, 0, 0], 0.3)
        found.append(
            (*kept["probability"].values, *noisy.exit_times, narrow.rollouts, *alone.state)
        )
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("noise", "words"),
    [
        (-1, "noise is -1, expected numbers of at least 0"),
        ([0.1, float("nan")], "noise is .*nan"),
        ("much", "noise is 'much', expected numbers"),
        ([0.1, 0.2], "noise has 2 numbers, expected 6"),
    ],
)
def test_what_is_no_noise_is_refused(noise, words):
    with pytest.raises(ValueError, match=words):
        asked(policy(noise=noise), undisturbed=False)


def test_a_timeout_keeps_nothing_half_done():
    with pytest.raises(TimeoutError):
        asked(policy(), rollouts=10000, timeout=0.001)


def test_a_feedback_goes_where_a_plan_goes(tmp_path):
    held = problem(feedback(1 / 50, delay=1, limits=([-9] * 3, [9, 9, np.inf])))
    held.save(tmp_path / "held.json")
    back = em.Problem.load(tmp_path / "held.json")
    assert back.to_json() == held.to_json() == pickle.loads(pickle.dumps(held)).to_json()
    same = [em.capture_probability(p, rollouts=20).exit_times for p in (held, back)]
    assert np.array_equal(*same)
    copied = pickle.loads(pickle.dumps(feedback()))
    assert isinstance(copied, em.Feedback)
    assert copied.to_json() == feedback().to_json()
    assert em.escape_effort(held, nodes=200).effort > 10 * em.escape_effort(
        problem(), nodes=200
    ).effort  # fmt: skip
    profile = em.margin_profile(held, every=0.25, ahead=0.5, rollouts=20, nodes=10)
    assert np.isfinite(profile.probabilities).all()


def test_the_law_of_a_feedback_goes_on_in_what_is_left_of_it():
    states = np.zeros((5, 6))
    states[3:, 0] = 0.05
    plan = feedback(0.05, states=states)
    scene = problem().scene
    whole = em.World(scene, plan).rollout(scene.pack(), np.zeros(6), 0.4).state
    half = em.World(scene, plan).rollout(scene.pack(), np.zeros(6), 0.2).state
    rest = plan.rest(48, scene.step)
    assert np.array_equal(em.World(scene, rest).rollout(half, np.zeros(6), 0.2).state, whole)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gains": np.eye(2)}, r"gains is of shape \(2, 2\), expected shape \(3, 6\)"),
        ({"observed": [*SEEN[:5], "ball.q"]}, "observed is with 'ball.q'"),
        ({"corrected": ["ball.fx", "ball.fy", "joint"]}, "with 'joint', expected what the plan"),
        ({"delay": -1}, "delay is -1"),
        ({"limits": ([1] * 3, [0] * 3)}, "limits is with a low one above"),
        ({"states": np.zeros(4)}, "states"),
    ],
)
def test_what_no_feedback_has_is_refused(given, words):
    arguments = {"gains": GAINS, "observed": SEEN, "corrected": PUSHED, "period": 0.05, **given}
    with pytest.raises(ValueError, match=words):
        problem(em.Feedback(arguments.pop("gains"), **arguments))


# Known answers


def test_a_feedback_has_the_efforts_and_probabilities_of_a_spring():
    virtual, real = on_a_rail(along_x()), on_a_rail(spring=True)
    for seed in (0, 1):
        one, other = (em.escape_effort(p, nodes=300, seed=seed).effort for p in (virtual, real))
        assert one == pytest.approx(other, rel=0.02)
    one, other = (em.capture_probability(p, rollouts=300, seed=2) for p in (virtual, real))
    assert one.interval()[0] <= other.captured <= one.interval()[1]


def test_the_closed_loop_under_white_noise_is_lost_as_often_as_on_a_grid():
    """Backward recursion of the probability of staying, over position and velocity."""
    from scipy.ndimage import map_coordinates, spline_filter

    noise, steps, half, fastest, h = 40.0, 120, 0.1, 3.0, 1 / 240
    x, v = np.meshgrid(np.linspace(-half, half, 121), np.linspace(-fastest, fastest, 121))
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    later = np.ones_like(x)
    for _ in range(steps):
        now, later = np.zeros_like(x), spline_filter(later)
        for node, weight in zip(nodes, weights / weights.sum(), strict=True):
            faster = v + h * (noise * node - STIFFNESS * x - DAMPING * v)
            farther = x + h * faster
            at = [(faster / fastest + 1) * 60, (farther / half + 1) * 60]
            stays = map_coordinates(later, at, mode="nearest", prefilter=False)
            now += weight * np.where(np.abs(farther) <= half, stays, 0.0)
        later = now
    wanted = later[60, 60]
    asked = on_a_rail(along_x(), horizon=steps * h, check=h)
    white = em.disturbances.Gaussian(force=noise, torque=0.0, correlation_time=1e-9)
    found = em.capture_probability(asked, rollouts=4000, seed=3, disturbance=white)
    assert 0.2 < wanted < 0.8
    low, high = found.interval(0.999)
    assert low - 0.01 <= wanted <= high + 0.01


def test_an_action_in_place_of_the_first_answer_is_what_a_plan_begins_with():
    """What a guard asks: a push for one control time, and then the policy."""
    still = em.disturbances.Uniform(strength=0.0)
    begun = policy(lambda seen, memory, time: np.zeros((32, 3))).after([20.0, 0, 0])
    rows = np.zeros((20, 6))
    rows[0, 0] = 20.0
    pushed = em.Plan(0.05, wrenches={"ball": rows})
    one, other = (
        em.capture_probability(problem(robot), rollouts=1, disturbance=still).exit_times
        for robot in (begun, pushed)
    )
    assert np.array_equal(one, other)
    assert np.isfinite(one).all()
    with pytest.raises(ValueError, match=r"shape \(1, 2\), expected \(1, 3\)"):
        policy().after([1.0, 2.0])
    assert '"name": "net after [1, 0, 0]"' in problem(policy(name="net").after([1, 0, 0])).to_json()


def test_a_robot_that_goes_on_needs_a_horizon():
    for robot in (policy(), feedback()):
        with pytest.raises(ValueError, match=r"horizon is left out .*expected seconds"):
            problem(robot, horizon=None)
    assert problem(feedback(step=0.05, wrenches={"ball": np.zeros((20, 6))}), horizon=None).horizon


def test_a_summary_says_who_reacts():
    rows = dict(future_rows(problem(policy(name="net-1"))))
    assert rows["policy net-1"] == "every 0.05 s"
    assert "plan" not in rows
    assert dict(future_rows(problem(feedback(1 / 50))))["feedback"] == "every 0.02 s"


def test_a_guard_asks_what_the_policy_does_after_an_action():
    """With a held push the ball is lost; the policy brings it back, so the push may pass."""
    held = policy(name="spring")

    def watch(robot):
        monitor = em.Monitor(lambda state, time: problem().with_state(state), alarm=Alarm(1.0),
                             rollouts=4, threads=1)  # fmt: skip
        return em.Guard(
            lambda observation: np.array([8.0, 0, 0]),
            monitor,
            lambda observation: np.zeros(3),
            problem_of=lambda state, time, action: problem(robot(action)).with_state(state),
            disturbance=em.disturbances.Uniform(strength=0.0),
            least=1.0,
            unknown="ask",
        )

    def keep(action):
        return em.Plan(1.0, wrenches={"ball": [[*action, 0, 0, 0]]})

    taken = []
    for robot in (keep, held.after):
        with watch(robot) as guard:
            guard(None, time=0.0, state=problem().state)
            taken.append((guard.last.source, guard.last.probabilities[0]))
    assert taken == [("fallback", 0.0), ("policy", 1.0)]


def test_ctrl_c_ends_act_at_once():
    pressed = []

    def press():
        pressed.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    def act(seen, memory, at):
        if not pressed:
            threading.Timer(0.2, press).start()
        end = time.perf_counter() + 30
        while time.perf_counter() < end:
            pass

    with pytest.raises(KeyboardInterrupt):
        asked(policy(act))
    assert time.perf_counter() - pressed[0] < 0.2


def test_gains_of_a_feedback_are_tuned():
    """A stiffer spring holds better, and none is worst."""
    soft = along_x(stiffness=1.0)
    found = em.improve(
        on_a_rail(soft),
        {"stiffness": (1.0, 200.0)},
        lambda values: along_x(stiffness=values["stiffness"]),
        rollouts=32,
        budget=60000,
        seed=1,
    )
    assert found.values["stiffness"] > 20
    before, after = (em.capture_probability(on_a_rail(along_x(stiffness=k)), rollouts=300, seed=9)
                     for k in (1.0, found.values["stiffness"]))  # fmt: skip
    assert after.captured > before.captured + 0.3
