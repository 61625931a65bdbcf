"""Environments of gymnasium as engines, and agents in them: how robust is this policy or state?"""

import pickle

import numpy as np
import pytest

import energymargin as em

gymnasium = pytest.importorskip("gymnasium")
GAINS = np.array([[0.5], [4.0], [0.5], [0.9]])


class Balancer:
    """As an agent of stable-baselines3: it sees observations, and says actions."""

    def predict(self, seen, deterministic):
        assert deterministic
        return (seen @ GAINS).astype(np.float32), None


def pendulum(model=None, **question):
    pytest.importorskip("mujoco")
    env = gymnasium.make("InvertedPendulum-v5")
    env.reset(seed=0)
    engine = em.engines.Gymnasium(env, objects="pole", effector="cart")
    upright = em.regions.Joint("hinge", lower=-0.2, upper=0.2)
    asked = {"force": (10, 0, 0), "duration": 0.1, "horizon": 0.8, "check": engine.step} | question
    plan = None if model is None else engine.policy(model)
    return em.engines.problem(engine, captured=upright, plan=plan, **asked)


def test_an_environment_keeps_the_contract():
    problem = pendulum()
    em.engines.check(problem.scene.engine, problem)


def test_a_rollout_with_an_agent_has_the_numbers_of_a_plain_loop():
    """To the last digit, though the engine saves and restores at each step."""
    problem = pendulum(Balancer())
    states = em.World(problem.scene, problem.plan).simulate(problem.state, 15, record=range(1, 16))
    env = gymnasium.make("InvertedPendulum-v5")
    seen, _ = env.reset(seed=0)
    for state in states.states:
        action, _ = Balancer().predict(seen[None], deterministic=True)
        seen, *_ = env.step(action[0])
        joints = problem.scene.unpack(state)["joints"]
        kinds, names = ("position", "velocity"), ("slider", "hinge")
        told = [joints[name][what] for what in kinds for name in names]
        np.testing.assert_array_equal(told, [*env.unwrapped.data.qpos, *env.unwrapped.data.qvel])


def test_a_policy_in_the_loop_holds_what_falls_alone_and_searches_see_it_too():
    alone, held = pendulum(), pendulum(Balancer())
    without = em.capture_probability(alone, rollouts=30, threads=1)
    p = em.capture_probability(held, rollouts=30, threads=1)
    assert p.captured > 0.9 > without.captured
    assert em.capture_probability(held, rollouts=30, threads=2).captured == p.captured
    pushed = [asked.replace(force=(20, 0, 0)) for asked in (alone, held)]
    efforts = [em.escape_effort(asked, nodes=200, seed=1).effort for asked in pushed]
    assert efforts[0] < 0.1 < efforts[1]
    (push,) = em.critical_values(held, {"push": (0.0, 60.0)}, draws=20, probability=0.5)
    assert push.side == "below" and 10.0 < push.value < 60.0
    (delay,) = em.critical_values(held, {"delay": (0.0, 0.4)}, draws=20, probability=0.5)
    assert delay.outcomes[0, 1] > 0.9 and delay.outcomes[-1, 2] < 0.5


def test_an_environment_goes_to_another_process_with_its_agent():
    problem = pendulum(Balancer())
    again = pickle.loads(pickle.dumps(problem))
    one, other = (em.capture_probability(p, rollouts=8).exit_times for p in (problem, again))
    np.testing.assert_array_equal(one, other)


class Slider(gymnasium.Env):
    """A puck on ice without MuJoCo: an action pushes it along x."""

    dt = 0.05

    def __init__(self, lazy=False):
        limits = {"low": -1.0, "high": 1.0, "dtype": np.float64}
        self.action_space = gymnasium.spaces.Box(shape=(1,), **limits)
        self.observation_space = gymnasium.spaces.Dict(
            {name: gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float64) for name in ("v", "x")}
        )
        self.x = self.v = self.wind = 0.0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x = self.v = self.wind = 0.0
        return self._get_obs(), {}

    def _get_obs(self):
        return {"x": np.array([self.x]), "v": np.array([self.v])}

    def step(self, action):
        self.v += self.dt * (float(action[0]) + self.wind)
        self.x += self.dt * self.v
        self.wind = 0.0
        return self._get_obs(), 0.0, self.x > 9.0, False, {}


def puck(env):
    env = env.unwrapped
    return [env.x, 0, 0, 0, 0, 0, 1, env.v, 0, 0, 0, 0, 0]


def push(env, wrenches):
    env.unwrapped.wind = wrenches[0, 0]


def flat(env):
    return [env.unwrapped.x, env.unwrapped.v]


def handle(env):
    return {"x": env.unwrapped.x, "v": env.unwrapped.v}


def back(env, saved):
    given = saved if isinstance(saved, dict) else dict(zip("xv", saved, strict=True))
    env.unwrapped.x, env.unwrapped.v = given["x"], given["v"]


def slider(save=flat, plan=None, **changes):
    env = Slider()
    env.reset()
    own = {"objects": {"puck": puck}, "save": save, "restore": back, "push": push} | changes
    engine = em.engines.Gymnasium(env, **own)
    asked = {"force": (1, 0, 0), "duration": 0.2, "horizon": 1.0, "check": engine.step}
    inside = em.regions.Ball("puck", (0, 0, 0), 0.1)
    plan = plan(engine) if plan else None
    return em.engines.problem(engine, captured=inside, plan=plan, **asked)


@pytest.mark.parametrize("save", [flat, handle])
def test_an_environment_without_mujoco_has_functions_and_may_save_handles(save):
    problem = slider(save)
    em.engines.check(problem.scene.engine, problem)
    p = em.capture_probability(problem, rollouts=200, seed=4)
    assert p.captured == em.capture_probability(slider(flat), rollouts=200, seed=4).captured
    assert 0.05 < p.captured < 0.95


def test_a_sudden_push_has_the_closed_form_of_a_puck_on_ice():
    """x = F T (T + dt) / 2: what carries it to 10 cm in a second."""

    def pushed(value):
        def draw(random, times):
            return np.tile([value, 0, 0, 0, 0, 0], (len(times), 1))

        p = em.capture_probability(slider(), disturbance=draw, rollouts=1, undisturbed=False)
        return p.captured

    least = 2 * 0.1 / (1.0 * 1.05)
    assert pushed(0.999 * least) == 1.0 and pushed(1.001 * least) == 0.0


class Planner:
    """As a policy of LeRobot: it plans three actions from an observation."""

    class config:
        n_action_steps = 3

    def __init__(self):
        self.asked = []

    def predict_action_chunk(self, batch):
        self.asked.append(sorted(batch))
        state = np.concatenate([batch["observation.x"], batch["observation.v"]], axis=1)
        first = -6.0 * state[:, :1] - 4.0 * state[:, 1:]
        return np.stack([first, 0.5 * first, 0.25 * first, first], axis=1)


def test_an_agent_of_lerobot_plans_several_actions_at_a_time():
    model = Planner()
    problem = slider(plan=lambda engine: engine.policy(model))
    p, alone = (em.capture_probability(asked, rollouts=60) for asked in (problem, slider()))
    assert p.captured > alone.captured
    assert model.asked[0] == ["observation.v", "observation.x"]


def test_a_plan_of_several_actions_is_carried_out_as_in_a_plain_loop():
    model, env, plan = Planner(), Slider(), []
    env.reset()
    env.v = 0.1
    own = {"objects": {"puck": puck}, "save": flat, "restore": back, "push": push}
    engine = em.engines.Gymnasium(env, **own)
    world = em.World(engine.scene.with_engine(engine), engine.policy(model))
    end = world.simulate(engine.state, 4, record=[4]).states[-1]
    env.x, env.v = 0.0, 0.1
    for _ in range(4):
        if not plan:
            seen = {f"observation.{name}": part[None] for name, part in env._get_obs().items()}
            plan = list(model.predict_action_chunk(seen)[0, :3])
        env.step(np.clip(plan.pop(0), -1.0, 1.0))
    assert [end[0], end[7]] == [env.x, env.v]


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"save": None}, "save and restore belong together"),
        ({"save": None, "restore": None}, "read by functions, expected save= and restore="),
        ({"objects": "puck"}, "has no model and data of MuJoCo, expected functions"),
        ({"objects": {"puck": flat}}, r"of the shape \(2,\), expected \(13,\)"),
        ({"step": -1.0}, "step is -1"),
    ],
)
def test_what_an_environment_does_not_tell_is_asked_for(changes, match):
    with pytest.raises(ValueError, match=match):
        slider(**changes)


def test_another_start_than_that_of_the_environment_is_refused_without_mujoco():
    problem = slider()
    moved = problem.with_state(problem.state + np.eye(13)[0] * 0.01)
    with pytest.raises(ValueError, match="another state than its environment's"):
        em.capture_probability(moved, rollouts=2)


def test_fetch_push_is_asked_in_its_own_simulator():
    """How robust is this state, and this policy? 15 lines."""
    robotics = pytest.importorskip("gymnasium_robotics")
    gymnasium.register_envs(robotics)
    env = gymnasium.make("FetchPush-v4")
    env.reset(seed=6)
    engine = em.engines.Gymnasium(env, objects="object0", effector="robot0:gripper_link")
    place = engine.scene.unpack(engine.state)["object0"]["position"]
    inside = em.regions.Ball("object0", place, radius=0.05)
    asked = {"captured": inside, "force": (20, 20, 0), "horizon": 0.4, "check": engine.step}
    state = em.engines.problem(engine, **asked)
    policy = engine.policy(lambda seen: np.tile([1.0, 0, 0, 0], (len(seen["observation"]), 1)))
    for problem in (state, state.replace(plan=policy)):
        p = em.capture_probability(problem, rollouts=10)
        assert 0.0 <= p.captured <= 1.0 and p.complete and p.undisturbed
    em.engines.check(engine, state)


def test_a_lift_of_robosuite_is_asked_in_its_own_simulator():
    """What its gripper remembers is saved besides."""
    robosuite = pytest.importorskip("robosuite")
    wrappers = pytest.importorskip("robosuite.wrappers")
    mujoco = pytest.importorskip("mujoco")
    if not hasattr(mujoco.MjData, "qM"):
        pytest.skip("robosuite needs a MuJoCo whose data have qM")
    quiet = {"has_renderer": False, "has_offscreen_renderer": False, "use_camera_obs": False}
    lift = robosuite.make("Lift", robots="Panda", ignore_done=True, hard_reset=False, **quiet)
    env = wrappers.GymWrapper(lift)
    env.reset()
    hand = env.robots[0].gripper["right"]
    engine = em.engines.Gymnasium(
        env,
        objects="cube_main",
        effector="gripper0_right_eef",
        observe=lambda env: env._flatten_obs(lift._get_observations(force_update=True)),
        save=lambda env: np.broadcast_to(hand.current_action, 2),
        restore=lambda env, saved: setattr(hand, "current_action", saved.copy()),
    )
    place = engine.scene.unpack(engine.state)["cube_main"]["position"]
    inside = em.regions.Ball("cube_main", place, radius=0.05)
    asked = {"captured": inside, "force": (1, 1, 0), "horizon": 0.3, "check": engine.step}
    policy = engine.policy(lambda seen: np.zeros((len(seen), 7)))
    problem = em.engines.problem(engine, **asked, plan=policy)
    em.engines.check(engine, problem)
    assert 0.0 <= em.capture_probability(problem, rollouts=6).captured <= 1.0


class Heavy(Slider):
    """A slider that the wind moves less."""

    def __init__(self, mass: float) -> None:
        super().__init__()
        self.mass = mass


def test_environments_of_other_numbers_or_another_model_are_not_one() -> None:
    def of(mass: float) -> em.engines.Gymnasium:
        env = Heavy(mass)
        env.reset()
        ways = {"save": flat, "restore": back, "push": push}
        return em.engines.Gymnasium(env, objects={"puck": puck}, **ways)

    assert of(1.0).digest() == of(1.0).digest() != of(2.0).digest()
    pytest.importorskip("mujoco")

    def pendulum(gear: float) -> em.engines.Gymnasium:
        env = gymnasium.make("InvertedPendulum-v5")
        env.reset(seed=0)
        env.unwrapped.model.actuator_gear *= gear
        return em.engines.Gymnasium(env, objects="pole")

    assert pendulum(1.0).digest() == pendulum(1.0).digest() != pendulum(0.1).digest()
