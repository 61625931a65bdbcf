"""Scores of an environment's states in `info` and the reward, and actions that are filtered."""

from dataclasses import dataclass, replace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from sliding import diverging

import energymargin as em
from energymargin import gym
from energymargin.act.choosing import choose
from energymargin.evaluate.searches import SearchSettings

FEW = SearchSettings(rollouts=8, nodes=8)
SOON = gym.ScriptedFuture(horizon=0.1)
SHELF = 0.1  # m, half of its length


def ledge():
    """A block on a shelf, with 2 N of friction; beyond the shelf's ends it is lost."""
    scene = em.Scene()
    scene.add_plane("shelf", friction=1.0)
    scene.add_body(
        "block",
        em.Box((0.04, 0.04, 0.04)),
        mass=0.2,
        position=(0.0, 0.0, 0.02),
        friction=1.0,
        role="object",
        linear_factor=(1, 0, 1),
        angular_factor=(0, 0, 0),
    )
    return scene


class Ledge(gymnasium.Env):
    """Another simulator's environment: an agent gives a block its velocity along a shelf."""

    action_space = spaces.Box(-1.0, 1.0, (1,), np.float64)
    observation_space = spaces.Box(-np.inf, np.inf, (1,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x, self.speed = self.np_random.uniform(-0.02, 0.02), 0.0
        return np.array([self.x]), {"mine": 1}

    def step(self, action):
        self.speed = float(action[0])
        self.x += 0.04 * self.speed
        return np.array([self.x]), 1.0, abs(self.x) > SHELF, False, {"mine": 2}


SCENE = ledge()
ON_SHELF = em.regions.Box("block", (0, 0, 0), (2 * SHELF, 1, 1))


def question(env, action=None):
    """Does the block stay on the shelf for a fifth of a second after the action?"""
    speed = env.unwrapped.speed if action is None else float(action[0])
    state = SCENE.pack(block={"position": (env.unwrapped.x, 0, 0.02), "velocity": (speed, 0, 0)})
    return em.Problem(
        SCENE,
        state,
        force=(2.1, 0, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured=ON_SHELF,
        horizon=0.2,
        start_outside=True,
    )


def push(**words):
    env = gymnasium.make("energymargin.gym:EnergyMarginPush-v0").unwrapped
    return gym.CaptureWrapper(env, words.pop("problem_of", SOON), settings=FEW, **words)


def test_each_state_has_its_score_and_interval_in_info():
    env = push()
    _, info = env.reset(seed=0)
    _, _, _, _, after = env.step(env.unwrapped.nominal_action())
    for told in (info["capture"], after["capture"]):
        assert 0 <= told["low"] <= told["score"] <= told["high"] <= 1
        assert told["low"] < told["high"]
    assert {"time", "captured"} <= set(after)


def test_the_score_is_the_capture_probability_of_the_problem():
    env = gym.CaptureWrapper(Ledge(), question, settings=SearchSettings(rollouts=400))
    env.reset(seed=0)
    env.unwrapped.x = 0.07
    told = env.step(np.array([0.47]))[4]["capture"]
    expected = em.capture_probability(question(env), rollouts=4000, seed=1).captured
    assert 0.2 < expected < 0.8
    assert told["score"] == pytest.approx(expected, abs=0.08)  # three standard errors


BRAKE = em.Policy(
    lambda seen, memory, time: -4.0 * seen, period=0.04, observe=["block.vx"], command=["block.fx"]
)


def test_with_a_policy_the_score_is_that_of_the_policy_in_the_loop():
    told = []
    for policy in (None, BRAKE):
        many = SearchSettings(rollouts=400)
        env = gym.CaptureWrapper(Ledge(), question, policy=policy, settings=many)
        env.reset(seed=0)
        env.unwrapped.x = 0.07
        told.append(env.step(np.array([0.47]))[4]["capture"]["score"])
    held = question(env).replace(plan=BRAKE, horizon=0.2)
    expected = em.capture_probability(held, rollouts=4000, seed=1).captured
    assert told[1] == pytest.approx(expected, abs=0.08)
    assert told[1] > told[0] + 0.15


def test_a_filter_asks_what_the_policy_does_after_each_action():
    """A push to the edge, after which the policy's brake comes too late, and one away from it."""
    back = lambda seen, action, random: [[-1.0]]  # noqa: E731
    asks = {"metric": None, "candidates": back, "settings": SearchSettings(rollouts=50)}
    env = gym.CaptureWrapper(Ledge(), question, policy=BRAKE, **asks)
    env.reset(seed=0)
    env.unwrapped.x, env.unwrapped.speed = 0.09, 0.2
    found = env.step(np.array([6.0]))[4]["filter"]
    assert found["chosen"] == 1
    assert found["probabilities"][0] < 0.3
    assert found["probabilities"][1] > 0.7


def test_an_environment_of_mujoco_is_scored_with_its_agent_in_the_loop():
    """A pole on a cart: it falls alone, and the policy does in the scene what it does in MuJoCo."""
    pytest.importorskip("mujoco")
    env = gymnasium.make("InvertedPendulum-v5")
    seen, _ = env.reset(seed=0)
    with pytest.warns(em.PlausibilityWarning):  # of its motor, which the policy is
        scene = em.scenes.from_mjcf(env.unwrapped.model, object="pole", effector="cart")
    model = lambda seen: seen @ [[0.5], [4.0], [0.5], [0.9]]  # noqa: E731
    names = ["slider", "hinge", "slider.velocity", "hinge.velocity"]
    motor = {"command": ["cart.fx"], "convert": lambda actions: 100.0 * actions}
    agent = em.Policy.from_gymnasium(env, model, observe=names, **motor)

    def upright(env):
        state = em.mujoco.state(scene, env.unwrapped.model, env.unwrapped.data)
        held = em.regions.Joint("hinge", lower=-0.2, upper=0.2)
        bounds = {"force": (20, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
        return em.Problem(scene, state, captured=held, horizon=0.4, **bounds)

    now = upright(env)
    moved = em.World(scene, agent).rollout(now.state, np.zeros(6), 0.4).state
    for _ in range(10):
        seen = env.step(model(seen[None])[0])[0]
    told = {}
    for policy in (None, agent):
        looped = gym.CaptureWrapper(env, upright, policy=policy)
        told[policy] = looped.reset(seed=0)[1]["capture"]["score"]
    assert moved[[0, 2, 1, 3]] == pytest.approx(seen, abs=1e-3)
    assert told[None] < 0.8 < told[agent]


def test_a_model_is_a_policy_of_our_environments():
    env = gymnasium.make("EnergyMarginPush-v0").unwrapped
    model = lambda seen: np.full((len(seen), 2), (0.0, 2.0))  # noqa: E731
    scores = []
    for policy in (model, em.Policy.from_gymnasium(env, model)):
        looped = gym.CaptureWrapper(env, policy=policy, settings=SearchSettings(rollouts=20))
        looped.reset(seed=3)
        scores.append(looped.step(np.array([0.0, 2.0]))[4]["capture"]["score"])
    assert scores[0] == scores[1] > 0
    with pytest.raises(ValueError, match="expected command=, names of what the agent commands"):
        gym.CaptureWrapper(Ledge(), question, policy=model)


def test_an_episode_is_the_same_for_the_same_seed_and_another_for_another():
    def told(env, seed):
        env.reset(seed=seed)
        steps = [env.step(np.array([0.5])) for _ in range(3)]
        return [(s[0].tolist(), s[4]["capture"]["score"], s[4]["filter"]["chosen"]) for s in steps]

    words = {"settings": SearchSettings(rollouts=20), "candidates": 4}
    env = gym.CaptureWrapper(Ledge(), question, **words)
    first = told(env, 7)
    assert told(gym.CaptureWrapper(Ledge(), question, **words), 7) == first
    assert told(env, 7) == first
    assert told(env, 8) != first


def test_the_environment_draws_the_same_with_the_wrapper_and_without():
    plain, wrapped = Ledge(), gym.CaptureWrapper(Ledge(), question, settings=FEW)
    starts = []
    for env in (plain, wrapped):
        seeded = env.reset(seed=5)[0]
        env.step(np.zeros(1))
        starts.append((seeded, env.reset()[0]))
    assert starts[0] == starts[1]


def test_without_a_seed_the_environments_own_one_counts():
    env = gym.CaptureWrapper(Ledge(), question, settings=FEW)
    env.reset()
    env.unwrapped.x = 0.09
    first = env.step(np.zeros(1))[4]["capture"]
    again = gym.CaptureWrapper(Ledge(), question, settings=FEW)
    again.reset(seed=env.np_random_seed)
    again.unwrapped.x = 0.09
    assert again.step(np.zeros(1))[4]["capture"] == first


@pytest.mark.parametrize("metric", ["capture", "success", "effort/est", "force"])
def test_a_metric_without_a_clock_is_that_of_the_present(metric):
    env = push(problem_of=gym.present, metric=metric)
    told = env.reset(seed=0)[1]["capture"]
    assert set(told) == {"score"} and not np.isnan(told["score"])


def test_each_probability_can_be_told():
    env = gymnasium.make("energymargin.gym:EnergyMarginScoop-v0").unwrapped
    scores = {}
    for metric in ("probability", "probability/any", "probability/success"):
        wrapped = gym.CaptureWrapper(env, SOON, metric=metric, settings=FEW)
        scores[metric] = wrapped.reset(seed=0)[1]["capture"]["score"]
    assert scores["probability"] <= scores["probability/any"] == 1.0
    assert scores["probability/success"] == 0.0


def test_nothing_to_ask_is_no_score_and_no_filter():
    env = gym.CaptureWrapper(
        Ledge(), lambda env, action=None: None, candidates=4, reward_weight=1.0
    )
    assert np.isnan(env.reset(seed=0)[1]["capture"]["score"])
    _, reward, _, _, info = env.step(np.array([0.3]))
    assert reward == 1.0 and env.last_action == [0.3]
    assert not info["filter"]["changed"] and np.isnan(info["filter"]["probabilities"]).all()


def test_potential_shaping_adds_nothing_to_an_episode_but_its_start():
    """The sum of discounted bonuses is minus the first potential, whatever the agent does."""
    discount, weight = 0.9, 3.0
    env = gym.CaptureWrapper(
        Ledge(), question, settings=FEW, reward_weight=weight, discount=discount
    )
    for speed in (1.0, 0.7):
        total, factor = 0.0, 1.0
        first = env.reset(seed=0)[1]["capture"]["score"]
        for _ in range(20):
            _, reward, terminated, _, _ = env.step(np.array([speed]))
            total += factor * (reward - 1.0)
            factor *= discount
            if terminated:
                break
        assert terminated and total == pytest.approx(-weight * first)


def test_an_additive_score_is_paid_at_each_step():
    env = gym.CaptureWrapper(Ledge(), question, settings=FEW, reward_weight=0.5, shaping="additive")
    env.reset(seed=0)
    _, reward, _, _, info = env.step(np.zeros(1))
    assert info["capture"]["score"] > 0
    assert reward == 1.0 + 0.5 * info["capture"]["score"]


def test_the_filter_takes_the_action_that_holds_the_block_where_the_policys_loses_it():
    env = gym.CaptureWrapper(
        Ledge(),
        question,
        settings=SearchSettings(rollouts=30),
        candidates=lambda observation, action, random: [np.array([0.9]), np.array([-0.5])],
    )
    env.reset(seed=0)
    env.unwrapped.x = 0.09
    _, _, terminated, _, info = env.step(np.array([1.0]))
    assert info["filter"]["chosen"] == 2 and info["filter"]["changed"] and not terminated
    assert env.last_action == [-0.5]
    assert info["filter"]["probabilities"][2] > 0.9 > info["filter"]["probabilities"][0]


def test_the_policys_action_is_kept_where_it_is_as_good_and_the_others_are_not_asked():
    env = gym.CaptureWrapper(Ledge(), question, settings=FEW, candidates=3)
    env.reset(seed=0)
    _, _, _, _, info = env.step(np.array([0.1]))
    told = info["filter"]
    assert told["chosen"] == 0 and env.last_action == [0.1]
    assert told["probabilities"][0] == 1.0 and np.isnan(told["probabilities"][1:]).all()


@dataclass
class Share:
    """What a filter looks at of a capture probability."""

    captured: float
    effective: float = 30.0
    rollouts: int = 30
    diverged: int = 0


@pytest.mark.parametrize(
    ("shares", "chosen"),
    [((0.5, 0.6, 0.55), 0), ((0.5, 1.0, 0.9), 1), ((0.0, 0.0, 0.0), 0), ((0.5, 0.9, 0.9), 1)],
    ids=["within the error", "the best", "none", "the first of equals"],
)
def test_a_candidate_is_chosen_if_it_is_better_by_more_than_the_error(shares, chosen):
    number, probabilities = choose(len(shares), lambda number: Share(shares[number]), 0.95)
    assert number == chosen
    asked = shares[: shares.index(1.0) + 1] if 1.0 in shares else shares
    np.testing.assert_array_equal(probabilities[: len(asked)], asked)
    assert np.isnan(probabilities[len(asked) :]).all()


def test_the_policys_action_is_seldom_changed_by_chance_alone():
    """Of candidates that are equally good, at most 1 - confidence."""
    random = np.random.default_rng(0)
    changed = [
        choose(5, dict(enumerate(map(Share, draws))).__getitem__, 0.95)[0] > 0
        for draws in random.binomial(30, 0.6, (2000, 5)) / 30
    ]
    assert np.mean(changed) < 0.05


def test_all_candidates_meet_the_same_disturbances():
    """Equal actions have equal probabilities."""
    env = gym.CaptureWrapper(
        Ledge(),
        question,
        settings=SearchSettings(rollouts=20),
        candidates=lambda observation, action, random: [action.copy()] * 4,
    )
    env.reset(seed=0)
    env.unwrapped.x = 0.09
    told = env.step(np.array([0.43]))[4]["filter"]
    assert 0 < told["probabilities"][0] < 0.9
    assert len(set(told["probabilities"])) == 1 and told["chosen"] == 0


def test_a_number_of_candidates_draws_noise_over_the_action_space():
    drawn = gym.CaptureWrapper(Ledge(), question, candidates=500)._candidates(
        None, np.array([1.0]), np.random.default_rng(0)
    )
    assert len(drawn) == 500 and all(Ledge.action_space.contains(action) for action in drawn)
    assert 0.1 < 1.0 - np.mean(drawn) < 0.2  # half of a normal distribution of 0.25


def test_candidates_see_the_last_observation():
    seen = []
    env = gym.CaptureWrapper(
        Ledge(),
        question,
        settings=FEW,
        candidates=lambda observation, action, random: seen.append(observation) or [],
    )
    observations = [env.reset(seed=0)[0], env.step(np.array([0.2]))[0]]
    env.step(np.array([0.2]))
    assert seen == observations


def test_several_environments_run_side_by_side():
    envs = gymnasium.vector.SyncVectorEnv(
        [lambda: gym.CaptureWrapper(Ledge(), question, settings=FEW)] * 2
    )
    _, info = envs.reset(seed=[1, 2])
    assert info["capture"]["score"].shape == (2,)


def test_a_registered_environment_is_made_again_with_its_wrapper():
    env = gymnasium.make("energymargin.gym:EnergyMarginPush-v0")
    wrapped = gym.CaptureWrapper(env, SOON, settings=FEW)
    again = gymnasium.make(wrapped.spec)
    assert again.reset(seed=2)[1]["capture"] == wrapped.reset(seed=2)[1]["capture"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"metric": "margin"}, "metrics is 'margin'"),
        ({"metric": "effort/est", "reward_weight": 1.0}, "an effort may be infinite"),
        ({"metric": None, "reward_weight": 1.0}, "expected a likelihood in the reward"),
        ({"reward_weight": np.nan}, "reward_weight is nan"),
        ({"shaping": "sparse"}, "shaping is 'sparse', expected 'potential' or 'additive'"),
        ({"discount": 1.1}, "discount is 1.1"),
        ({"threads": 0}, "threads is 0"),
        ({"problem_of": 3}, "problem_of is 3, expected a function"),
        ({"problem_of": lambda: None}, r"problem_of takes \(\), expected a function \(env\)"),
        ({"problem_of": lambda env: None, "candidates": 4}, r"a function \(env, action\)"),
        ({"candidates": 0}, "candidates is 0"),
        ({"candidates": lambda action: []}, r"a function \(observation, action, random\)"),
        ({"confidence": 1.0}, "confidence is 1.0"),
    ],
)
def test_a_bad_argument_is_named(words, message):
    with pytest.raises(ValueError, match=message):
        push(**words)


def test_an_action_space_that_has_no_noise_asks_for_a_function():
    def wrapped(space, candidates):
        env = Ledge()
        env.action_space = space
        return gym.CaptureWrapper(env, question, candidates=candidates)

    for space in (spaces.Discrete(3), spaces.Box(-np.inf, np.inf, (1,))):
        with pytest.raises(ValueError, match="noise needs a Box with bounds"):
            wrapped(space, 4)
    wrapped(spaces.Discrete(3), lambda observation, action, random: [0, 1, 2])


def test_a_problem_without_a_horizon_is_refused_and_says_what_to_do():
    env = push(problem_of=gym.present)
    with pytest.raises(ValueError, match=r"problem\.replace\(horizon=\.\.\.\)"):
        env.reset(seed=0)


def test_the_questions_of_our_environments_are_refused_to_others():
    with pytest.raises(ValueError, match=r"for another write problem_of\(env\)"):
        gym.CaptureWrapper(Ledge(), SOON).reset(seed=0)


def test_a_step_comes_after_a_reset():
    with pytest.raises(ValueError, match=r"expected reset\(\) before step\(\)"):
        gym.CaptureWrapper(Ledge(), question).step(np.zeros(1))


def test_too_many_rollouts_that_diverge_are_nan_with_their_number():
    def stepped(count, **words):
        env = gym.CaptureWrapper(
            Ledge(), question, settings=SearchSettings(rollouts=30), reward_weight=1.0, **words
        )
        env.reset(seed=0)
        env._disturbance = diverging(count)
        env._safest = replace(env._safest, disturbance=env._disturbance)
        return env.step(np.array([0.0]))

    _, _, _, _, info = stepped(1)
    assert info["capture"]["diverged"] == 1 and 0 <= info["capture"]["score"] <= 1
    _, reward, _, _, info = stepped(2)
    assert info["capture"]["diverged"] == 2 and np.isnan(info["capture"]["score"])
    assert np.isnan(info["capture"]["low"]) and np.isfinite(reward)
    _, _, _, _, info = stepped(2, candidates=1)
    assert info["filter"]["diverged"] == 2 and info["filter"]["chosen"] == 0
    assert np.isnan(info["filter"]["probabilities"]).all()
