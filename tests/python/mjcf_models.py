"""Small MuJoCo models, and how their scenes compare with them."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from energymargin.mujoco import state
from energymargin.scenes import from_mjcf

MASS = """<inertial pos="0.01 0.02 0.03" mass="0.5" diaginertia="0.002 0.003 0.004"
  euler="10 20 30"/>"""


def model(inside, **sections):
    """Of the elements of the world, and of further sections."""
    others = "".join(f"<{name}>{text}</{name}>" for name, text in sections.items())
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{inside}</worldbody>{others}</mujoco>"
    )


def link(name, inside="", joint='<joint name="{0}"/>', at="0 0 1", geom='<geom size="0.05"/>'):
    """A body on a joint; `{0}` is its name."""
    joints = joint.format(name)
    return f'<body name="{name}" pos="{at}">{joints}{MASS}{geom}{inside}</body>'


def built(inside, *args, sections=None, **options):
    """The scene of such a model."""
    return from_mjcf(model(inside, **(sections or {})), *args, **options)


def body(scene, name):
    return next(body for body in scene.bodies if body.name == name)


def loose(name, at, **geom):
    """A free ball of 0.5 m."""
    of = " ".join(f'{key}="{value}"' for key, value in geom.items())
    return (
        f'<body name="{name}" pos="{at}"><freejoint/><geom name="{name}" size="0.5" {of}/></body>'
    )


def joint(scene, name):
    return next(joint for joint in scene.joints if joint.name == name)


def random_data(of, seed=0, names=None):
    """Positions within the joints' limits, and velocities."""
    data, random = mujoco.MjData(of), np.random.default_rng(seed)
    mujoco.mj_integratePos(of, data.qpos, random.normal(size=of.nv), 1.0)
    for i in range(of.njnt):
        if of.jnt_limited[i]:
            data.qpos[of.jnt_qposadr[i]] = random.uniform(*of.jnt_range[i])
    data.qvel[:] = random.normal(size=of.nv)
    return data


def pose_error(scene, of, data, prefix=""):
    """Largest distance [m] and angle [rad] of the scene's moving bodies from the model's."""
    now = scene.unpack(state(scene, of, data, prefix=prefix))
    mujoco.mj_kinematics(of, data)
    worst = 0.0
    for name, at in now.items():
        known = mujoco.mj_name2id(of, mujoco.mjtObj.mjOBJ_BODY, name.removeprefix(prefix))
        if name == "joints" or known < 0:
            continue
        turn = Rotation.from_quat(np.roll(data.xquat[known], -1)).inv()
        angle = (turn * Rotation.from_quat(at["orientation"])).magnitude()
        worst = max(worst, angle, np.abs(data.xpos[known] - at["position"]).max())
    return worst
