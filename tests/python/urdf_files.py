"""URDF files of small robots, and the scenes made of them."""

from pathlib import Path

import numpy as np
import pybullet_data
from scipy.spatial.transform import Rotation

from energymargin.scenes import from_urdf

DATA = Path(pybullet_data.getDataPath())
BOX = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
INERTIAL = """<inertial><mass value="1"/>
      <inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>"""
ARM = f"""<robot name="arm">
  <link name="base">{INERTIAL}{BOX}</link>
  <link name="arm">
    <inertial><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><mass value="0.5"/>
      <inertia ixx="0.0068" iyy="0.0067" izz="0.0003" ixy="0.0001" ixz="0" iyz="0"/>
    </inertial>
    <collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.02" length="0.4"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.05" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 0 1"/>
    <dynamics damping="0.3"/>
    <limit lower="-1" upper="2" effort="3" velocity="1"/>
  </joint>
</robot>
"""


ONE = 'lower="-1" upper="1"'


def link(name, inside=INERTIAL + BOX):
    return f'<link name="{name}">{inside}</link>'


def joint(name, parent, child, inside="", *, kind="revolute", at="0.3 0 0", limit=ONE):
    limits = f"<limit {limit}/>" if kind in ("revolute", "prismatic") else ""
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
      <origin xyz="{at}"/><axis xyz="0 0 1"/>{limits}{inside}</joint>"""


def follower(of, factor, shift, damping=0.0):
    """The inside of a joint that follows."""
    return f"""<mimic joint="{of}" multiplier="{factor}" offset="{shift}"/>
      <dynamics damping="{damping}"/>"""


def chain(*joints, links="abcd"):
    """Links a, b, c, ... in a row."""
    return f'<robot name="chain">{"".join(link(n) for n in links)}{"".join(joints)}</robot>'


def built(tmp_path, text=ARM, *args, **options):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return from_urdf(path, *args, **options)


def names(scene):
    bodies, joints = ([x.name for x in some] for some in (scene.bodies, scene.joints))
    return bodies, joints, scene.disabled_collisions


def body(scene, name):
    return next(body for body in scene.bodies if body.name == name)


def inertia(center, moments, axes):
    """About the centre, along the axes of the link's frame, and the centre."""
    turn = Rotation.from_quat(axes).as_matrix()
    return turn @ np.diag(moments) @ turn.T, np.asarray(center)
