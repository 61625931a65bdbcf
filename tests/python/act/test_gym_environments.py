"""Tasks as environments of gymnasium."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import energymargin as em
from energymargin import gym
from energymargin.tasks.scripted import ScriptedTask

IDS = {
    "push": "EnergyMarginPush-v0",
    "balance": "EnergyMarginBalance-v0",
    "topple": "EnergyMarginTopple-v0",
    "grasp": "EnergyMarginGrasp-v0",
    "scoop": "EnergyMarginScoop-v0",
    "push-multi": "EnergyMarginPushMulti-v0",
}


SOME_DISCS = 7  # a seed with which the script brings some of the discs into the goal region


def made(task="push", **parameters):
    return gymnasium.make(f"energymargin.gym:{IDS[task]}", **parameters).unwrapped


def played(env, policy, seed):
    """The last reward and info of an episode, and its steps."""
    env.reset(seed=seed)
    for steps in range(1, 1000):
        _, reward, terminated, truncated, info = env.step(policy(env))
        if terminated or truncated:
            return reward, info, steps
    raise AssertionError("the episode does not end")


def follow(env):
    return env.nominal_action()


@pytest.mark.filterwarnings("ignore:.*(symmetric and normalized|infinit)")
@pytest.mark.parametrize("task", IDS)
def test_gymnasium_finds_nothing_wrong_with_an_environment(task):
    check_env(made(task), skip_render_check=True)


def test_a_picture_is_bytes_and_shows_that_something_moved():
    env = made(render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    env.step(env.nominal_action())
    assert first.ndim == 3 and first.shape[2] == 3 and first.dtype == np.uint8
    assert (env.render() != first).any()
    assert made().render() is None


@pytest.mark.parametrize("task", IDS)
def test_an_episode_starts_as_the_trajectory_of_its_seed(task):
    env = made(task)
    observation, info = env.reset(seed=3)
    trajectory = em.tasks.make(task).rollout(3, frames=2)
    np.testing.assert_array_equal(observation, trajectory.states[0])
    assert env.params == trajectory.params
    assert info["captured"] == (
        trajectory.captured[0] if trajectory.captured_any is None else trajectory.captured_any[0]
    )


@pytest.mark.parametrize("task", IDS)
def test_the_nominal_action_does_what_the_script_does(task):
    env = made(task)
    env.reset(seed=5)
    world, script = em.World(env.task.scene(env.params)), env.task.script(env.params)
    assert env.action_space.contains(env.nominal_action())
    first = script.between(0, 10)
    expected = world.simulate(env.state, 10, drives=first.wrenches, targets=first.targets)
    observation, *_ = env.step(env.nominal_action())
    np.testing.assert_allclose(observation, expected.states[-1], rtol=0, atol=1e-9)


def test_an_episode_is_rewarded_and_ends_where_the_box_arrives():
    outcomes = [played(made(), follow, seed) for seed in range(12)]
    assert {reward for reward, *_ in outcomes} == {0.0, 1.0}
    for reward, info, steps in outcomes:
        assert info["success"] == (reward == 1.0)
        assert info["success"] or info["lost"] or steps == 60


def test_an_episode_is_lost_once_nothing_was_captured_for_the_patience():
    env = made(patience=0.1)
    reward, info, steps = played(env, follow, seed=next(lost_pushes(env)))
    assert reward == 0.0 and info["lost"] and not info["captured"] and steps < 60
    patient, _, later = played(made(patience=0.5), follow, seed=next(lost_pushes(env)))
    assert patient == 0.0 and later > steps


def lost_pushes(env):
    return (seed for seed in range(50) if played(env, follow, seed)[1]["lost"])


def test_an_episode_is_truncated_at_the_length_of_the_task():
    env = made(patience=10.0)
    env.reset(seed=0)
    still = np.zeros(2)
    results = [env.step(still) for _ in range(60)]
    assert not any(terminated for _, _, terminated, *_ in results)
    assert [truncated for *_, truncated, _ in results] == [False] * 59 + [True]
    assert env.time == pytest.approx(env.task.length)
    with pytest.raises(ValueError, match="the episode is over"):
        env.step(still)


def test_of_several_objects_the_reward_is_the_share_that_arrives():
    reward, info, _ = played(made("push-multi"), follow, seed=SOME_DISCS)
    assert reward in np.arange(1, 10) / 10 and not info["success"]


def test_an_action_is_held_within_its_bounds():
    one, other = made(), made()
    one.reset(seed=1), other.reset(seed=1)
    far, _, *_ = one.step(np.array([1e6, 1e6]))
    most, _, *_ = other.step(other.action_space.high)
    np.testing.assert_array_equal(far, most)


def test_parameters_of_the_task_are_keywords():
    env = made(friction=0.25)
    env.reset(seed=0)
    assert env.params == {"friction": 0.25}


def test_a_future_follows_the_action_first_and_the_script_then():
    env = made()
    env.reset(seed=0)
    problem = env.future(0.5, np.array([2.0, 9.0]), hold=0.25)
    rows = problem.plan.wrenches["effector"]
    script = env.task.script(env.params).wrenches["effector"]
    assert rows.shape == (120, 6) and problem.horizon == 0.5
    assert (rows[:60, :2] == [2.0, 9.0]).all()
    np.testing.assert_array_equal(rows[60:], script[60:120])
    assert env.future(0.5).plan.wrenches["effector"][:60, 0].any() == script[:60, 0].any()


def test_the_question_of_an_environment_is_that_of_its_task():
    env = made()
    env.reset(seed=4)
    for _ in range(5):
        env.step(env.nominal_action())
    ours = gym.ScriptedFuture(horizon=0.5)(env)
    theirs = env.task.future(env.state, env.time, env.params, horizon=0.5)
    assert ours.to_json() == theirs.to_json()
    assert gym.present(env).to_json() == env.task.problem(env.state, env.params).to_json()


def test_actions_at_50_hz_are_50_a_second():
    env = gym.TaskEnv("push", control_step=0.02)
    env.reset(seed=3)
    ends = [round(env.step(env.nominal_action())[4]["time"] * 240) for _ in range(50)]
    assert ends[:6] == [5, 10, 14, 19, 24, 29] and ends[-1] == 240
    assert env.control_step == 0.02


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            {"control_step": 0.001},
            "control_step is 0.001 s, expected at least a step of 0.00416667",
        ),
        ({"patience": 0.0}, "patience is 0.0, expected a positive number"),
        ({"render_mode": "human"}, "render_mode is 'human', expected 'rgb_array'"),
        ({"friction": -1.0}, "friction is -1.0"),
    ],
)
def test_a_bad_argument_is_named(words, message):
    with pytest.raises(ValueError, match=message):
        gym.TaskEnv("push", **words)


def test_a_task_without_script_or_channels_is_refused():
    class Other(type(em.tasks.make("push"))):
        name = "other"

    with pytest.raises(ValueError, match="task is 3, expected one with a script"):
        gym.TaskEnv(3)
    with pytest.raises(ValueError, match="task 'other' has none"):
        gym.TaskEnv(Other())
    own = gym.TaskEnv(Other(), channels=gym.CHANNELS["push"])
    assert isinstance(own.task, ScriptedTask)
    with pytest.raises(ValueError, match="expected none with a task that is made"):
        gym.TaskEnv(Other(), channels=gym.CHANNELS["push"], friction=0.3)


@pytest.mark.parametrize(
    "action", [np.zeros(3), np.array([np.nan, 0.0])], ids=["too many", "not finite"]
)
def test_a_bad_action_is_refused(action):
    env = made()
    env.reset(seed=0)
    with pytest.raises(ValueError, match="expected 2 finite numbers"):
        env.step(action)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"low": 1.0, "high": 0.0, "body": "effector"}, "low is 1.0 and high 0.0"),
        ({"low": 0.0, "high": np.inf, "body": "effector"}, "expected finite low < high"),
        ({"low": 0.0, "high": 1.0}, "a body and a joint, or of none"),
        ({"low": 0.0, "high": 1.0, "body": "effector", "axis": 6}, "axis is 6"),
    ],
)
def test_a_bad_channel_is_refused(words, message):
    with pytest.raises(ValueError, match=message):
        gym.Channel(**words)


def test_no_environment_is_registered_before_the_package_is_imported():
    code = (
        "import sys, energymargin as em\n"
        "print('gymnasium' in sys.modules)\n"
        "import gymnasium\n"
        "print([name for name in gymnasium.registry if name.startswith('EnergyMargin')])\n"
        "em.gym\n"
        "print(len([name for name in gymnasium.registry if name.startswith('EnergyMargin')]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "[]", str(len(IDS))]
