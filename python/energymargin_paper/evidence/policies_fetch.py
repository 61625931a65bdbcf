"""FetchPush of gymnasium-robotics: a scripted policy, and pushes of random strength in MuJoCo.

A question: the gripper has the box before it, and the policy goes on towards the goal while random
forces act on the box. Will the box still be at the gripper all along the next second? The answer is
the probability in a scene of ours with the policy in the loop; what happened is MuJoCo's.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from threading import local
from typing import Any

import numpy as np

from energymargin import mujoco, regions, scenes
from energymargin._core import Plan, Problem, Scene, World
from energymargin.base.aliases import Floats
from energymargin.model.plans import nearest_steps
from energymargin.model.policies import Policy
from energymargin_paper.evidence import policies_told
from energymargin_paper.evidence.policies_told import Question, draw, questions as cases

__all__ = ["TITLE", "cases", "draw", "lacks", "report", "run"]


TITLE = "FetchPush"
ENVIRONMENT = "FetchPush-v4"
GRIPPER, BOX = "robot0:gripper_link", "object0"
CONTROL = 0.04  # s
AHEAD = 25  # control steps
NEAR = 0.06  # m, of the box's centre from the gripper's; a box that is pushed is at 0.04
GAIN, BEHIND, ARRIVED = 6.0, 0.08, 0.02  # as in examples/05_fetch_push.py
SPEED = 0.83  # m/s of the gripper for an action of 1, of 137 steps of episodes before
GRIP = np.array([0.0, 0.0, -0.02])  # m, from the gripper's frame to where the environment sees it
PYRAMID = 0.79  # of a cone's friction, what MuJoCo's pyramid has in the mean over directions
HELD = 3  # control steps of one force
STRENGTHS = (0.0, 20.0)  # N, standard deviation of a force along x and y, even draws
LEVER = 0.01  # m, of a torque about z
BESIDE = 0.06  # m, that the policy pushes off the middle, to both sides at most
WAITED = 8  # control steps at most from the first touch to the question
TOUCHED = regions.Ball(BOX, center=(0, 0, 0), radius=NEAR, frame=GRIPPER)

_own = local()

lacks = partial(
    policies_told.missing, "gymnasium-robotics", "gymnasium_robotics", "'energymargin[fetch]'"
)


class Push:
    """The scripted policy of an episode: over the box to its far side, down, and on to the goal."""

    def __init__(self, beside: float) -> None:
        """`beside`: how far from the middle of the box it pushes [m]."""
        self.phase, self.beside = "over", beside

    def __call__(self, observation: dict[str, Floats]) -> Floats:
        """The action after an observation, shape (4,); a phase ends for good."""
        gripper, box = observation["observation"][:3], observation["achieved_goal"]
        goal = observation["desired_goal"]
        aim, ahead = self.aim(box[None], goal)
        behind = aim[0] - BEHIND * ahead[0]
        if self.phase == "over" and np.linalg.norm((gripper - behind)[:2]) < 0.02:
            self.phase = "down"
        if self.phase == "down" and gripper[2] < box[2] + 0.015:
            self.phase = "push"
        if self.phase == "push":
            return np.array([*self.push(gripper[None], box[None], goal)[0], 0.0])
        target = behind + 0.08 * np.array([0, 0, self.phase == "over"])
        step = np.clip(GAIN * (target - gripper), -1.0, 1.0)
        if self.phase == "over" and gripper[2] < box[2] + 0.06:
            step[:2] = 0.0  # up first
        return np.array([*step, 0.0])

    def aim(self, box: Floats, goal: Floats) -> tuple[Floats, Floats]:
        """Where it pushes, and in which direction, of boxes (n, 3); (n, 3) each."""
        way = (goal - box)[:, :2]
        ahead = np.zeros_like(box)
        ahead[:, :2] = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-6)
        across = np.column_stack([-ahead[:, 1], ahead[:, 0], ahead[:, 2]])
        return np.asarray(box + self.beside * across), ahead

    def push(self, gripper: Floats, box: Floats, goal: Floats) -> Floats:
        """Actions of the last phase, for places (n, 3) of gripper and box, shape (n, 3)."""
        aim, _ = self.aim(box, goal)
        arrived = np.linalg.norm((goal - box)[:, :2], axis=1) < ARRIVED
        wanted = np.clip(GAIN * (aim - gripper), -1.0, 1.0)
        return np.asarray(np.where(arrived[:, None], 0.0, wanted))


def _question(random: np.random.Generator) -> Question:
    """The box at the gripper, a policy and the strength of the forces."""
    env, scene = _environment()
    policy, strength = Push(random.uniform(-BESIDE, BESIDE)), random.uniform(*STRENGTHS)
    wait = int(random.integers(WAITED + 1))
    state = None
    while state is None:
        env.reset(seed=int(random.integers(2**31)))
        policy.phase = "over"
        state = _reached(env, scene, policy, wait)
    goal = env.unwrapped.goal.copy()
    asked = Problem(
        scene,
        state,
        force=(strength, strength, 0.0),
        torque=(0.0, 0.0, LEVER * strength),
        duration=HELD * CONTROL,
        captured=TOUCHED,
        horizon=AHEAD * CONTROL,
        plan=in_the_loop(policy, goal),
    )
    alone, forces = replayed(asked, policy, goal), partial(_forces, strength)
    return Question(asked, alone, forces, strength, partial(_played, env, scene, policy))


run = partial(policies_told.answered, _question)


def _environment() -> tuple[Any, Scene]:
    """The environment of a thread, and its scene."""
    if not hasattr(_own, "made"):
        import gymnasium

        gymnasium.register_envs(import_module("gymnasium_robotics"))
        env = gymnasium.make(ENVIRONMENT, max_episode_steps=1000)
        env.reset(seed=0)
        _own.made = env, scene_of(env)
    env, scene = _own.made
    return env, scene


def scene_of(env: Any) -> Scene:
    """Table, box and gripper of the environment's model, as in examples/05_fetch_push.py."""
    inner = env.unwrapped
    shut = {f"robot0:{side}_gripper_finger_joint": {"held": True} for side in "lr"}
    parts: dict[str, dict[str, Any]] = {
        "table0": {},
        BOX: {"base": "free", "object": BOX},
        GRIPPER: {"base": "kinematic", "effector": GRIPPER, "joints": shut},
    }
    scene: Any = None
    for name, options in parts.items():
        options |= {"subtree": name, "data": inner.data, "ignore": ("geom.margin",)}
        scene = scenes.from_mjcf(inner.model, scene, **options)
    for side in "lr":  # the fingers graze the table
        scene.disable_collisions(f"robot0:{side}_gripper_finger_link", "table0")
    scene.set_friction(BOX, "table0", PYRAMID * scene.contact_friction(BOX, "table0"))
    made: Scene = scene
    return made


def _state(env: Any, scene: Scene) -> Floats:
    inner = env.unwrapped
    return np.asarray(mujoco.state(scene, inner.model, inner.data))


def _reached(env: Any, scene: Scene, policy: Push, wait: int) -> Floats | None:
    """The state so many control steps after the box is at the gripper; None if it never is."""
    observation = env.unwrapped._get_obs()
    for _ in range(60):
        observation, *_ = env.step(policy(observation))
        state = _state(env, scene)
        if policy.phase == "push" and TOUCHED.contains(scene, state):
            for _ in range(wait):
                observation, *_ = env.step(policy(observation))
            state = _state(env, scene)
            return state if TOUCHED.contains(scene, state) else None
    return None


def _played(env: Any, scene: Scene, policy: Push, forces: Floats) -> bool:
    """Whether the box stays in MuJoCo, looked at in each control step."""
    inner = env.unwrapped
    number = inner.model.body(BOX).id
    for step in range(AHEAD):
        inner.data.xfrc_applied[number] = forces[step // HELD]
        observation = inner._get_obs()
        env.step(policy(observation))
        if not TOUCHED.contains(scene, _state(env, scene)):
            inner.data.xfrc_applied[number] = 0.0
            return False
    inner.data.xfrc_applied[number] = 0.0
    return True


def _forces(strength: float, random: np.random.Generator, pieces: int) -> Floats:
    """On the box, shape (pieces, 6)."""
    drawn = random.normal(size=(pieces, 6))
    return np.asarray(drawn * strength * np.array([1, 1, 0, 0, 0, LEVER]))


def in_the_loop(policy: Push, goal: Floats) -> Policy:
    """The last phase in our scene: an action is a velocity of the gripper."""
    return Policy(
        lambda states, memory, time: _speeds(policy, goal, states),
        period=CONTROL,
        command=[f"{GRIPPER}.v{axis}" for axis in "xyz"],
        name=ENVIRONMENT,
    )


def replayed(asked: Problem, policy: Push, goal: Floats) -> Plan:
    """What the policy does if nothing disturbs it, as a plan."""
    steps = nearest_steps(CONTROL * np.arange(AHEAD + 1), asked.scene.step)
    world = World(asked.scene, in_the_loop(policy, goal))
    states = world.simulate(asked.state, int(steps[-1]), record=steps[:-1].tolist()).states
    rows = np.zeros((AHEAD, 6))
    rows[:, :3] = _speeds(policy, goal, np.asarray(states))
    return Plan(CONTROL, velocities={GRIPPER: rows})


def _speeds(policy: Push, goal: Floats, states: Floats) -> Floats:
    """Of the gripper in states (n, s), shape (n, 3)."""
    _, scene = _environment()
    box, gripper = (states[:, scene.slice(name)][:, :3] for name in (BOX, GRIPPER))
    return np.asarray(SPEED * policy.push(gripper + GRIP, box, goal))


report = partial(
    policies_told.report,
    f"{ENVIRONMENT}: a scripted policy pushes the box, off its middle by up to "
    f"{100 * BESIDE:g} cm, while forces act on it that change every 0.12 s. That place and the "
    f"standard deviation of forces, up to {STRENGTHS[1]:g} N, are drawn for each question, and "
    "told. Does the box stay at the gripper for a second? *Happened*: in MuJoCo, once.",
)
