import math

import numpy as np
import pytest

import energymargin as em
from energymargin.scenes import add_urdf, data_file

ARM = """<robot name="arm">
  <link name="base">
    <inertial><mass value="1"/>
      <inertia ixx="0.00166667" iyy="0.00166667" izz="0.00166667" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="arm">
    <inertial><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><mass value="0.5"/>
      <inertia ixx="0.00671667" iyy="0.00671667" izz="0.0001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.02" length="0.4"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.05" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" effort="3" velocity="1"/>
  </joint>
</robot>
"""


def built(tmp_path, text=ARM, **options):
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    scene = em.Scene()
    add_urdf(scene, path, **options)
    return scene


def test_links_are_where_the_joints_put_them(tmp_path):
    scene = built(tmp_path, position=(1, 2, 3), joints={"shoulder": {"start": math.pi / 6}})
    arm = scene.unpack(scene.pack())["arm"]
    angle = math.pi / 2 + math.pi / 6
    expected = np.array([1, 2, 3.05]) + 0.2 * np.array([math.cos(angle), math.sin(angle), 0])
    assert arm["position"] == pytest.approx(expected)


def test_limits_and_the_torque_limit_come_from_the_file_and_the_control_from_the_caller(tmp_path):
    control = {"shoulder": {"stiffness": 2.0, "target": 0.5}}
    (joint,) = built(tmp_path, joints=control, role="effector", friction=0.7).joints
    assert joint.limits == (-1.0, 2.0)
    assert joint.torque_limit == 3.0
    assert (joint.stiffness, joint.target) == (2.0, 0.5)


def test_the_root_is_fixed_and_all_links_have_the_role_and_the_friction(tmp_path):
    scene = built(tmp_path, role="effector", friction=0.7)
    assert [body.fixed for body in scene.bodies] == [True, False]
    assert {(body.role, body.friction) for body in scene.bodies} == {("effector", 0.7)}


def test_the_gripper_of_the_package_is_a_urdf_file():
    scene = em.Scene()
    add_urdf(scene, data_file("three_finger_gripper.urdf"))
    assert (len(scene.bodies), len(scene.joints)) == (13, 12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</robot>", "", "no XML file"),
        ("robot", "model", "its root is <model>"),
        ('<cylinder radius="0.02" length="0.4"/>', '<mesh filename="a.stl"/>', "'arm' is a <mesh>"),
        ('type="revolute"', 'type="floating"', "'shoulder' is 'floating'"),
        ('izz="0.0001"', 'izz="0.0002"', "'arm' has other inertial properties"),
        ("<axis", '<mimic joint="x"/><axis', "'shoulder' has <mimic>"),
        ('xyz="0 0 0.05"', 'xyz="0 0"', "not three numbers"),
        ('<mass value="0.5"/>', "", "has no <mass>"),
        ('<child link="arm"/>', '<child link="base"/>', "parent is 'base'"),
        ('<parent link="base"/>', '<parent link="bass"/>', "'shoulder' has the parent 'bass'"),
        ('<link name="arm">', '<link name="base">', "two <link> of the name 'base'"),
        ('<mass value="0.5"/>', '<mass value="abc"/>', "<mass value='abc'> is not a finite number"),
        ('ixy="0"', 'ixy="0.1"', "products of inertia"),
        ('<limit lower="-1" upper="2" effort="3" velocity="1"/>', "", "'shoulder' has no <limit>"),
        ('<box size="0.1 0.1 0.1"/>', "", "'base' has 0 shapes"),
    ],
)
def test_what_is_not_understood_is_refused_by_name(tmp_path, old, new, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, ARM.replace(old, new))


def test_control_of_an_unknown_joint_is_refused(tmp_path):
    with pytest.raises(ValueError, match="joints has 'elbow', expected one of shoulder"):
        built(tmp_path, joints={"elbow": {}})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"position": (0, 0)}, "position is"),
        ({"orientation": (0, 0, 1)}, "orientation is"),
        ({"joints": {"shoulder": {"stifness": 1}}}, "'shoulder'.* has stifness"),
    ],
)
def test_bad_arguments_are_refused_by_name(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, **options)


def test_a_missing_file_is_an_error_that_says_so(tmp_path):
    with pytest.raises(FileNotFoundError):
        add_urdf(em.Scene(), tmp_path / "none.urdf")
    with pytest.raises(FileNotFoundError, match="no data file 'none'"):
        data_file("none")
