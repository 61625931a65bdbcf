"""FetchPush of gymnasium-robotics: how likely is the box to stay before the gripper?

The physics of the environment are MuJoCo's. At each step its state becomes a problem: the gripper
goes on as it moves for 0.6 s, and the box is pushed about at random. Needs the extra `fetch`:
pip install 'energymargin[fetch]'; python examples/05_fetch_push.py
"""

import gymnasium
import gymnasium_robotics
import numpy as np

import energymargin as em

HORIZON = 0.6  # s
GRIPPER, BOX = "robot0:gripper_link", "object0"
GAIN = 6.0  # of the policy: actions for each metre
BEHIND = 0.08  # m, from the box's centre to where the gripper comes down
ARRIVED = 0.02  # m, of the box from the goal
NEAR = 0.06  # m, of the box's centre from the gripper's; a box that is pushed is at 0.04


def scene() -> em.Scene:
    """Table, box and the two fingers, from the numbers of the model's file."""
    made = em.Scene()
    made.add_body(
        "table0", em.Box((0.5, 0.7, 0.4)), mass=0, position=(1.3, 0.75, 0.2), friction=1.0
    )
    made.add_body(
        BOX,
        em.Box((0.05, 0.05, 0.05)),
        mass=2.0,
        position=(1.3, 0.75, 0.425),
        friction=1.0,
        role="object",
    )
    finger = em.Box((0.077, 0.014, 0.027))
    fingers = [em.Part(finger, position=(0, y, 0)) for y in (-0.0079, 0.0079)]
    made.add_body(
        GRIPPER,
        em.Compound(fingers),
        mass=8.0,
        kinematic=True,  # the arm moves it, whatever it meets
        position=(1.3, 0.75, 0.6),
        friction=1.0,
        role="effector",
    )
    made.disable_collisions(GRIPPER, "table0")  # the fingers graze it
    return made


SCENE = scene()
PUSHED = em.regions.Ball(BOX, center=(0, 0, 0), radius=NEAR, frame=GRIPPER)


def problem_of(env: gymnasium.Env) -> em.Problem | None:
    """Will the box stay at the gripper? Nothing to ask before it is there."""
    inner = env.unwrapped
    state = em.mujoco.state(SCENE, inner.model, inner.data)
    if not PUSHED.contains(SCENE, state):
        return None
    return em.Problem(
        SCENE,
        state,
        force=(25.0, 25.0, 0.0),  # a quarter more than the friction of the box at rest
        torque=(0.0, 0.0, 0.4),
        duration=0.1,
        captured=PUSHED,
        plan=em.Plan.hold(SCENE, state, HORIZON),
    )


class Policy:
    """Over the box to its far side, down, and on towards the goal; a phase ends for good."""

    def __init__(self, beside: float) -> None:
        """`beside`: how far from the middle of the box it pushes [m]."""
        self.phase, self.beside = "over", beside

    def __call__(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        """The action after an observation."""
        gripper, box = observation["observation"][:3], observation["achieved_goal"]
        way = (observation["desired_goal"] - box)[:2]
        ahead = np.array([*way / max(np.linalg.norm(way), 1e-6), 0.0])
        aim = box + self.beside * np.array([-ahead[1], ahead[0], 0.0])
        behind = aim - BEHIND * ahead
        if self.phase == "over" and np.linalg.norm((gripper - behind)[:2]) < 0.02:
            self.phase = "down"
        if self.phase == "down" and gripper[2] < box[2] + 0.015:
            self.phase = "push"
        above = np.array([0.0, 0.0, 0.08])
        targets = {"over": behind + above, "down": behind, "push": aim}
        step = np.clip(GAIN * (targets[self.phase] - gripper), -1.0, 1.0)
        if self.phase == "over" and gripper[2] < box[2] + 0.06:
            step[:2] = 0.0  # up first
        if self.phase == "push" and np.linalg.norm(way) < ARRIVED:
            step[:] = 0.0
        return np.array([*step, 0.0], np.float32)


def episode(env: gymnasium.Env, beside: float) -> None:
    """A line for every fourth step at which the box is at the gripper."""
    policy = Policy(beside)
    observation, info = env.reset(seed=6)
    truncated, step = False, 0
    while not truncated:
        observation, _, _, truncated, info = env.step(policy(observation))
        step += 1
        told = info["capture"]
        if step % 4 == 0 and not np.isnan(told["score"]):
            way = np.linalg.norm(observation["achieved_goal"] - observation["desired_goal"])
            interval = f"{told['low']:.2f} to {told['high']:.2f}"
            print(f"  step {step}: captured {told['score']:.2f} ({interval}), goal {way:.2f} m")
    print("  pushed to the goal" if info["is_success"] else "  not at the goal")


def main() -> None:
    """The same start twice: a push at the middle of the box, and one beside it."""
    gymnasium.register_envs(gymnasium_robotics)
    env = em.gym.CaptureWrapper(gymnasium.make("FetchPush-v4"), problem_of)
    for beside in (0.0, 0.02):
        print(f"pushed {100 * beside:.0f} cm beside the middle")
        episode(env, beside)


if __name__ == "__main__":
    main()
