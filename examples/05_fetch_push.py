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


def scene_of(env: gymnasium.Env) -> em.Scene:
    """Table, box and gripper of the environment's model."""
    inner = env.unwrapped
    shut = {f"robot0:{side}_gripper_finger_joint": {"held": True} for side in "lr"}
    parts = {
        "table0": {},
        BOX: {"base": "free", "object": BOX},
        # The arm moves it, whatever it meets.
        GRIPPER: {"base": "kinematic", "effector": GRIPPER, "joints": shut},
    }
    scene = None
    for name, options in parts.items():
        options |= {"subtree": name, "data": inner.data, "ignore": ("geom.margin",)}
        scene = em.scenes.from_mjcf(inner.model, scene, **options)
    for side in "lr":  # the fingers graze the table
        scene.disable_collisions(f"robot0:{side}_gripper_finger_link", "table0")
    return scene


class Question:
    """Will the box stay at the gripper? Nothing to ask before it is there."""

    def __init__(self, scene: em.Scene) -> None:
        """`scene`: of the environment."""
        self.scene = scene
        self.pushed = em.regions.Ball(BOX, center=(0, 0, 0), radius=NEAR, frame=GRIPPER)

    def __call__(self, env: gymnasium.Env) -> em.Problem | None:
        """The problem at the state of the simulator."""
        inner = env.unwrapped
        state = em.mujoco.state(self.scene, inner.model, inner.data)
        if not self.pushed.contains(self.scene, state):
            return None
        return em.Problem(
            self.scene,
            state,
            force=(25.0, 25.0, 0.0),  # a quarter more than the friction of the box at rest
            torque=(0.0, 0.0, 0.4),
            duration=0.1,
            captured=self.pushed,
            plan=em.Plan.hold(self.scene, state, HORIZON),
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
    bare = gymnasium.make("FetchPush-v4")
    env = em.gym.CaptureWrapper(bare, Question(scene_of(bare)))
    for beside in (0.0, 0.02):
        print(f"pushed {100 * beside:.0f} cm beside the middle")
        episode(env, beside)


if __name__ == "__main__":
    main()
