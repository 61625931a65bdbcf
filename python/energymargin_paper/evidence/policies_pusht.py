"""gym-pusht: a scripted policy pushes a T, with pushes of random strength, in pymunk.

A question: the agent is behind the T, and its policy pushes it towards the goal while random forces
act on the T. Will the T still be before the agent all along the next 3 s? The answer is the
probability in a scene of ours with the policy in the loop; what happened is the environment's.

A pixel is a millimetre. The environment stops all bodies after each of its steps of 10 ms, as a
strong drag does, and its contacts have no friction.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from energymargin import regions
from energymargin._core import (
    Box,
    Compound,
    Cylinder,
    Inertial,
    Part,
    Plan,
    Problem,
    Scene,
    World,
)
from energymargin.base.aliases import Floats
from energymargin.model.policies import Policy
from energymargin_paper.evidence import policies_told
from energymargin_paper.evidence.policies_told import Question, draw, questions as cases

__all__ = ["TITLE", "cases", "draw", "lacks", "report", "run"]


TITLE = "gym-pusht"
ENVIRONMENT = "gym_pusht/PushT-v0"
PIXEL = 1e-3  # m
SUBSTEP, CONTROL = 0.01, 0.1  # s
STIFFNESS, DAMPING = 100.0, 20.0  # 1/s^2, 1/s: how the agent follows its target, as there
AHEAD = 30  # control steps
RADIUS = 0.015  # m, of the agent
MIDDLE = 0.045  # m, of the T's centre of mass from the outer face of its bar
MASS, INERTIA = 1.0, 3e-3  # kg, kg m^2
PARTS = (((0.12, 0.03), 0.015), ((0.03, 0.09), 0.075))  # bar and stem: sizes, and how far from it
NEAR = 0.085  # m, of the T's centre of mass from the agent's; a T that is pushed is at 0.06
STEP, ACROSS = 12.0, 0.8  # px ahead of the agent, share of what it is off aside
TURNS = (-200.0, 60.0)  # px aside for a radian, even draws: policies from bad to good
GOAL = np.array([256.0, 256.0])  # px
BESIDE, ASKEW = 55.0, 0.8  # px and rad at most, of the agent off the middle, of the T off the goal
AWAY = (120.0, 190.0)  # px, of the T from the goal
HELD = 2  # control steps of one force
STRENGTHS = (0.0, 10.0)  # N, standard deviation of a force along x and y, even draws

lacks = partial(policies_told.missing, "gym-pusht", "gym_pusht", "gym-pusht")


def pushed(turn: float, agent: Floats, middle: Floats, angle: Floats) -> Floats:
    """Targets of the agent at places (n, 2) of agent and T and angles of it (n,), shape (n, 2).

    Ahead along the T's axis, and aside to where the push turns that axis to the goal: `turn` px for
    a radian that it is off. A policy whose turn is too small, or below 0, loses the T by itself.
    """
    along = np.column_stack([-np.sin(angle), np.cos(angle)])
    side = np.column_stack([np.cos(angle), np.sin(angle)])
    way = GOAL - middle
    off = np.arctan2((side * way).sum(axis=1), (along * way).sum(axis=1))  # to the goal, clockwise
    now = ((agent - middle) * side).sum(axis=1)
    wanted = np.clip(-turn * off, -BESIDE, BESIDE)
    aside = ACROSS * (wanted - now)
    return np.asarray(agent + STEP * along + aside[:, None] * side)


def _question(random: np.random.Generator) -> Question:
    """The T before the agent, a policy and the strength of the forces."""
    env, strength, turn = _environment(), random.uniform(*STRENGTHS), random.uniform(*TURNS)
    _placed(env, random)
    scene = scene_of()
    asked = Problem(
        scene,
        _state(env, scene),
        force=(strength, strength, 0.0),
        torque=(0.0, 0.0, 0.0),
        duration=HELD * CONTROL,
        captured=regions.Ball("T", center=(0, 0, 0), radius=NEAR, frame="agent"),
        horizon=AHEAD * CONTROL,
        plan=in_the_loop(scene, turn),
    )
    alone, forces = replayed(asked, turn), partial(_forces, strength)
    return Question(asked, alone, forces, strength, partial(_played, env, turn))


run = partial(policies_told.answered, _question)


def _forces(strength: float, random: np.random.Generator, pieces: int) -> Floats:
    """On the T, shape (pieces, 6)."""
    rows = np.zeros((pieces, 6))
    rows[:, :2] = strength * random.normal(size=(pieces, 2))
    return rows


def _environment() -> Any:
    """A new environment: one that outlives Python's modules would not close."""
    import_module("gym_pusht")
    import gymnasium

    env = gymnasium.make(ENVIRONMENT, max_episode_steps=10_000)
    env.reset(seed=0)
    return env


def _placed(env: Any, random: np.random.Generator) -> None:
    """The T away from the goal and askew, the agent behind its bar and off the middle."""
    bearing = random.uniform(-np.pi, np.pi)
    middle = GOAL + random.uniform(*AWAY) * np.array([np.cos(bearing), np.sin(bearing)])
    angle = bearing + np.pi / 2 + random.uniform(-ASKEW, ASKEW)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    behind = (random.uniform(-BESIDE, BESIDE), -(MIDDLE + RADIUS) / PIXEL - 1.0)
    agent = middle + turned @ behind
    corner = middle - turned @ (0.0, MIDDLE / PIXEL)
    inner = env.unwrapped
    inner.block.angle = angle
    inner.block.position = tuple(corner)
    inner.agent.position = tuple(agent)
    inner.space.reindex_shapes_for_body(inner.block)
    inner.space.reindex_shapes_for_body(inner.agent)


def _places(env: Any) -> tuple[Floats, Floats, float]:
    """Agent, and centre of mass and angle of the T [px, rad]."""
    inner = env.unwrapped
    middle = inner.block.local_to_world(inner.block.center_of_gravity)
    return np.array(inner.agent.position), np.array(middle), float(inner.block.angle)


def scene_of() -> Scene:
    """The T and the agent. The drag slows as fast as the environment stops."""
    scene = Scene(gravity=(0, 0, 0), step=SUBSTEP / 2)
    parts = [Part(Box((*size, 0.02)), position=(0.0, at - MIDDLE, 0.0)) for size, at in PARTS]
    scene.add_body(
        "T",
        Compound(parts),
        mass=MASS,
        inertial=Inertial((0, 0, 0), inertia=INERTIA * np.eye(3)),
        friction=0.0,
        role="object",
        linear_factor=(1, 1, 0),
        angular_factor=(0, 0, 1),
        linear_damping=MASS / SUBSTEP,
        angular_damping=INERTIA / SUBSTEP,
    )
    scene.add_body(
        "agent",
        Cylinder(RADIUS, 0.02),
        mass=1.0,
        position=(0.0, -0.1, 0.0),
        friction=0.0,
        role="effector",
        kinematic=True,
    )
    return scene


def _state(env: Any, scene: Scene) -> Floats:
    agent, middle, angle = _places(env)
    velocity = np.array(env.unwrapped.agent.velocity)
    return np.asarray(
        scene.pack(
            T={"position": (*PIXEL * middle, 0.0), "yaw": angle},
            agent={"position": (*PIXEL * agent, 0.0), "velocity": (*PIXEL * velocity, 0.0)},
        )
    )


def _played(env: Any, turn: float, forces: Floats) -> bool:
    """Whether the T stays before the agent there, looked at in each control step."""
    inner = env.unwrapped
    for step in range(AHEAD):
        agent, middle, angle = _places(env)
        inner.space.gravity = tuple(forces[step // HELD, :2] / MASS / PIXEL)
        env.step(pushed(turn, agent[None], middle[None], np.array([angle]))[0])
        agent, middle, _ = _places(env)
        if PIXEL * np.linalg.norm(agent - middle) > NEAR:
            return False
    return True


def in_the_loop(scene: Scene, turn: float) -> Policy:
    """Agent and policy: a new target every 0.1 s, which the agent follows at 100 Hz. Its memory is
    the target [px] and the agent's velocity [px/s]."""
    periods = round(CONTROL / SUBSTEP)

    def act(states: Floats, memory: Floats | None, time: float) -> tuple[Floats, Floats]:
        assert memory is not None
        agent, middle, angle = _seen(scene, states)
        target, velocity = memory[:, :2], memory[:, 2:]
        if round(time / SUBSTEP) % periods == 0:
            target = pushed(turn, agent, middle, angle)
        velocity = velocity + SUBSTEP * (STIFFNESS * (target - agent) - DAMPING * velocity)
        return PIXEL * velocity, np.hstack([target, velocity])

    command = ["agent.vx", "agent.vy"]
    return Policy(act, period=SUBSTEP, command=command, memory=4, name="PushT")


def _seen(scene: Scene, states: Floats) -> tuple[Floats, Floats, Floats]:
    """Places of agent and T [px], (n, 2) each, and the T's angle (n,), in states (n, s)."""
    block, agent = states[:, scene.slice("T")], states[:, scene.slice("agent")]
    return agent[:, :2] / PIXEL, block[:, :2] / PIXEL, 2 * np.arctan2(block[:, 5], block[:, 6])


def replayed(asked: Problem, turn: float) -> Plan:
    """What the agent does if nothing disturbs the T, as a plan."""
    steps, periods = round(SUBSTEP / asked.scene.step), round(AHEAD * CONTROL / SUBSTEP)
    record = [steps * k for k in range(1, periods + 1)]
    world = World(asked.scene, in_the_loop(asked.scene, turn))
    states = np.asarray(world.simulate(asked.state, record[-1], record=record).states)
    rows = np.zeros((periods, 6))
    places = np.vstack([asked.state, states])[:, asked.scene.slice("agent")][:, :3]
    rows[:, :3] = np.diff(places, axis=0) / SUBSTEP
    return Plan(SUBSTEP, velocities={"agent": rows})


report = partial(
    policies_told.report,
    f"{ENVIRONMENT}: a scripted policy pushes the T towards the goal, from off its middle and "
    "askew, while forces act on the T that change every 0.2 s. Policies are good and bad: how "
    "far one goes aside for an error is drawn anew for each question, and so is the standard "
    f"deviation of the forces, up to {STRENGTHS[1]:g} N (a pixel is a millimetre). Both are "
    "told. Does the T stay before the agent for 3 s? *Happened*: in pymunk, once.",
)
