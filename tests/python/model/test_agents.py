"""Agents of environments are policies: what they see and command, also those of torch."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from reacting import DAMPING, STIFFNESS, asked, on_a_rail

import energymargin as em
import energymargin.gym


class Steady:
    """An agent that always does the same, as one of stable-baselines3 is asked."""

    def predict(self, seen, deterministic=False):
        assert deterministic
        return np.full((len(seen), 2), (0.5, 1e9)), None


@pytest.mark.parametrize("model", [Steady(), lambda seen: np.full((len(seen), 2), (0.5, 1e9))])
def test_an_agent_of_an_environment_does_in_a_problem_what_it_does_there(model):
    env = gymnasium.make("energymargin.gym:EnergyMarginPush-v0")
    env.reset(seed=17)
    inner = env.unwrapped
    now = em.gym.present(inner)
    agent = em.Policy.from_gymnasium(env, model)
    clipped = np.clip((0.5, 1e9), *(inner.action_space.low, inner.action_space.high))
    rows = np.zeros((240, 6))
    rows[:, :2] = clipped + [channel.offset for channel in inner.channels]
    plan = em.Plan(step=now.scene.step, wrenches={"effector": rows})
    one, other = (
        em.capture_probability(
            now.replace(horizon=1.0, plan=robot, effector="coast"), rollouts=20, seed=4
        )
        for robot in (agent, plan)
    )
    assert np.array_equal(one.exit_times, other.exit_times)


class Cart(gymnasium.Env):
    """Another simulator's: a cart on a rail, which sees its place and its speed."""

    dt = 0.05
    observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float32)
    action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)


def on_cart(model, **options):
    return em.Policy.from_gymnasium(
        Cart(),
        model,
        **{
            "observe": lambda states: states[:, [0, 7]],
            "command": ["ball.fx"],
            "convert": lambda actions: 5.0 * actions,
            **options,
        },
    )


def test_an_agent_of_another_environment_is_told_what_it_sees_and_commands():
    """Its clipped actions are those of a Feedback with limits."""
    agent = on_cart(lambda seen: -seen @ [[STIFFNESS / 5], [DAMPING / 5]])
    law = em.Feedback(
        [[STIFFNESS, DAMPING]],
        observed=["ball.x", "ball.vx"],
        corrected=["ball.fx"],
        period=0.05,
        limits=([-5.0], [5.0]),
    )
    one, other = (em.capture_probability(on_a_rail(robot), seed=1) for robot in (agent, law))
    assert np.array_equal(one.exit_times, other.exit_times)
    assert 0 < one.captured < 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"command": None}, "expected command=, names of what the agent commands"),
        ({"observe": None}, r"sees rows of the shape \(13,\), expected \(2,\).*give observe="),
        ({"model": Steady()}, r"returned rows of the shape \(2,\), expected \(1,\)"),
        ({"model": 3}, "model is 3, expected an agent"),
        ({"period": -1.0}, "period of the feedback is -1"),
    ],
)
def test_what_an_agent_of_another_environment_lacks_is_named(options, words):
    options = {"model": lambda seen: seen[:, :1], **options}
    with pytest.raises(ValueError, match=words):
        asked(on_cart(**options))


def test_an_environment_that_says_too_little_has_no_policy():
    with pytest.raises(ValueError, match="drives 'table' too"):
        em.Policy.from_gymnasium(gymnasium.make("EnergyMarginGrasp-v0"), Steady())
    push = gymnasium.make("EnergyMarginPush-v0")
    scaled = gymnasium.wrappers.RescaleAction(push, np.float64(-1), np.float64(1))
    with pytest.raises(
        ValueError, match=r"wrappers change the action_space, expected env.unwrapped"
    ):
        em.Policy.from_gymnasium(scaled, Steady())
    with pytest.raises(ValueError, match="env is 3, expected an environment"):
        em.Policy.from_gymnasium(3, Steady())


class Recurrent(Steady):
    def predict(self, seen, deterministic=False):
        return seen[:, :1], np.zeros(3)


def test_an_agent_with_a_state_of_its_own_is_refused():
    with pytest.raises(ValueError, match=r"agent has a state of its own.*keeps it in memory"):
        asked(on_cart(Recurrent()))


def test_an_agent_of_an_environment_goes_to_other_processes():
    agent = em.Policy.from_gymnasium(gymnasium.make("EnergyMarginPush-v0"), Steady())
    there = pickle.loads(pickle.dumps(agent.after([0.5, 1e9])))
    assert np.array_equal(there._first, agent.after([0.5, 1e9])._first)


# torch and stable-baselines3, where they are installed


def network(torch):
    torch.manual_seed(0)
    return torch.nn.Sequential(torch.nn.Linear(26, 16), torch.nn.Tanh(), torch.nn.Linear(16, 2))


def held_by(env, model):
    agent = em.Policy.from_gymnasium(env, model)
    question = em.gym.present(env.unwrapped).replace(horizon=0.5, plan=agent, effector="coast")
    return em.capture_probability(question, rollouts=40, seed=2)


def test_a_module_of_torch_is_a_policy():
    torch = pytest.importorskip("torch")
    env = gymnasium.make("EnergyMarginPush-v0")
    env.reset(seed=17)
    module = network(torch)
    weights = [p.detach().numpy() for p in module.parameters()]

    def by_hand(seen):
        first, bias, second, last = weights
        return np.tanh(seen.astype(np.float32) @ first.T + bias) @ second.T + last

    one, other = held_by(env, module), held_by(env, by_hand)
    assert one.captured == pytest.approx(other.captured, abs=0.05)
    assert isinstance(pickle.loads(pickle.dumps(em.Policy.from_gymnasium(env, module))), em.Policy)


@pytest.mark.parametrize("kind", ["PPO", "SAC"])
def test_a_model_of_stable_baselines3_does_in_a_problem_what_it_does_in_its_environment(kind):
    models = pytest.importorskip("stable_baselines3")
    env = gymnasium.make("EnergyMarginPush-v0")
    model = getattr(models, kind)("MlpPolicy", env, seed=0, device="cpu")
    seen, _ = env.reset(seed=17)
    agent = em.Policy.from_gymnasium(env, model)
    now = em.gym.present(env.unwrapped).replace(horizon=0.5, plan=agent, effector="coast")
    for _ in range(12):
        seen = env.step(model.predict(seen, deterministic=True)[0])[0]
    moved = em.World(now.scene, now.plan).rollout(now.state, np.zeros(6), 0.5)
    assert np.allclose(moved.state, seen, atol=1e-3)  # blocks of 32 rows round in another way
    sent = pickle.loads(pickle.dumps(now))
    here, there = (em.capture_probability(p, rollouts=40, seed=2).exit_times for p in (now, sent))
    assert np.array_equal(here, there)
