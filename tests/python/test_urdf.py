import math
import sys
from pathlib import Path

import numpy as np
import pybullet
import pybullet_data
import pytest
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.scenes import data_file, from_urdf

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


# Bullet itself


@pytest.fixture
def bullet():
    client = pybullet.connect(pybullet.DIRECT)
    yield
    pybullet.disconnect(client)


def bullets_pose(robot, index):
    """Of a link's frame; in double precision, as that of the centre of mass is."""
    center, turn, inertial_center, inertial_turn = pybullet.getLinkState(
        robot, index, computeForwardKinematics=True
    )[:4]
    frame = Rotation.from_quat(turn) * Rotation.from_quat(inertial_turn).inv()
    return np.array(center) - frame.apply(inertial_center), frame.as_matrix()


NOT_SIMULATED = {
    "panda": ("safety_controller", "friction_anchor", "stiffness", "damping", "spinning_friction"),
    "xarm": ("gazebo", "transmission", "dynamics.friction"),
}


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    ("file", "moving", "options"),
    [
        ("pr2_gripper.urdf", 2, {"ignore": ("spinning_friction",)}),
        ("kuka_iiwa/model.urdf", 7, {}),
        ("franka_panda/panda.urdf", 8, {"ignore": NOT_SIMULATED["panda"]}),
        ("xarm/xarm6_with_gripper.urdf", 7, {"ignore": NOT_SIMULATED["xarm"], "inertia": "shapes"}),
        ("aliengo/aliengo.urdf", 12, {}),
    ],
)
def test_links_masses_and_inertias_are_where_bullet_has_them(file, moving, options):
    scene = from_urdf(DATA / file, decompose=False, self_collision=False, **options)
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    robot = pybullet.loadURDF(str(DATA / file), useFixedBase=True, flags=flags)
    infos = [pybullet.getJointInfo(robot, i) for i in range(pybullet.getNumJoints(robot))]
    ours = [j for j in scene.joints if j.type != "fixed" and j.mimic is None]
    assert len(ours) == moving
    random = np.random.default_rng(0)
    for _ in range(3):
        drawn = {j.name: random.uniform(*np.clip(j.limits, -3, 3)) for j in ours}
        state = scene.unpack(scene.pack(joints=drawn))
        for info in infos:
            if info[1].decode() in state["joints"]:  # also those that follow, which Bullet's do not
                position = state["joints"][info[1].decode()]["position"]
                pybullet.resetJointState(robot, info[0], position)
        for info in infos:
            if (name := info[12].decode()) not in state:
                continue
            position, turn = bullets_pose(robot, info[0])
            assert state[name]["position"] == pytest.approx(position, abs=1e-9)
            own = Rotation.from_quat(state[name]["orientation"]).as_matrix()
            assert own == pytest.approx(turn, abs=1e-9)
    for info in infos:
        mass, _, moments, center, axes = pybullet.getDynamicsInfo(robot, info[0])[:5]
        if not any(b.name == info[12].decode() for b in scene.bodies):
            assert mass == 0.0
            continue
        own = body(scene, info[12].decode())
        assert own.mass == mass
        if own.inertial is not None:
            ours_of, theirs = (
                inertia(own.inertial.center, own.inertial.moments, own.inertial.axes),
                inertia(center, moments, axes),
            )
            assert ours_of[0] == pytest.approx(theirs[0], abs=1e-7 * np.abs(theirs[0]).max())
            assert ours_of[1] == pytest.approx(theirs[1], abs=1e-12)


@pytest.mark.usefixtures("bullet")
def test_an_inertia_that_is_turned_and_has_products_is_the_files(tmp_path):
    scene = built(tmp_path)
    robot = pybullet.loadURDF(
        str(tmp_path / "robot.urdf"), flags=pybullet.URDF_USE_INERTIA_FROM_FILE
    )
    _, _, moments, center, axes = pybullet.getDynamicsInfo(robot, 0)[:5]
    own = body(scene, "arm").inertial
    found = inertia(own.center, own.moments, own.axes)[0]
    assert found == pytest.approx(inertia(center, moments, axes)[0], abs=1e-9)
    assert found[0, 0] == pytest.approx(0.0003)  # the z axis of the inertia's frame is the arm's x
    assert found[1, 2] == pytest.approx(-0.0001)
    assert own.center == pytest.approx([0.2, 0.0, 0.0])


# Links


def test_links_are_where_the_joints_put_them(tmp_path):
    scene = built(tmp_path, position=(1, 2, 3), joints={"shoulder": {"start": math.pi / 6}})
    arm = scene.unpack(scene.pack())["arm"]
    assert arm["position"] == pytest.approx([1, 2, 3.05])
    assert arm["yaw"] == pytest.approx(math.pi / 2 + math.pi / 6)


def test_a_robot_stands_as_its_root_does(tmp_path):
    on_its_side = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    arm = body(built(tmp_path, orientation=on_its_side), "arm")
    assert arm.position == pytest.approx([0, -0.05, 0])


def test_the_root_is_fixed_or_free(tmp_path):
    assert [body.fixed for body in built(tmp_path).bodies] == [True, False]
    free = built(tmp_path, base="free", position=(0, 0, 1))
    assert [body.mass for body in free.bodies] == [1.0, 0.5]
    assert free.dimension == 13 + 2
    assert free.unpack(free.pack())["base"]["position"] == pytest.approx([0, 0, 1])


def test_an_object_from_a_file_may_be_the_object_of_a_problem():
    scene = from_urdf(DATA / "objects/mug.urdf", base="free", role="object", decompose=False)
    (mug,) = scene.bodies
    assert (mug.name, mug.role, mug.mass, mug.friction) == ("base_link", "object", 1.0, 1.0)
    world = em.World(scene)
    fallen = world.rollout(scene.pack(), np.zeros(6), 0.1).state
    assert fallen[2] == pytest.approx(-0.5 * 9.81 * 0.1**2, rel=0.1)


def test_several_shapes_of_a_link_move_as_one(tmp_path):
    ball = """<collision><origin xyz="0 0 0.2" rpy="0 0 1"/><geometry><sphere radius="0.05"/>
      </geometry></collision>"""
    scene = built(tmp_path, f'<robot name="r">{link("a", INERTIAL + BOX + ball)}</robot>')
    box, sphere = scene.bodies[0].shape.parts
    assert (box.shape.size[0], sphere.shape.radius) == (0.1, 0.05)
    assert sphere.position == pytest.approx([0, 0, 0.2])


def test_a_link_with_a_mass_and_no_shape_has_the_files_inertia(tmp_path):
    for spread in ("file", "shapes"):
        text = f'<robot name="r">{link("a", INERTIAL)}</robot>'
        (only,) = built(tmp_path, text, base="free", inertia=spread).bodies
        assert only.shape.parts == []
        assert only.inertial.moments == pytest.approx([0.002] * 3)


def test_the_inertia_may_be_that_of_the_shapes(tmp_path):
    arm = body(built(tmp_path, inertia="shapes"), "arm")
    assert arm.inertial is None
    properties = em.mass_properties(arm.shape, arm.mass)
    assert properties.center == pytest.approx([0.2, 0, 0])
    assert min(properties.moments) == pytest.approx(0.5 / 2 * 0.02**2)


def test_roles_and_frictions_may_differ_by_link(tmp_path):
    scene = built(
        tmp_path, role="effector", friction=0.7, roles={"base": "none"}, frictions={"arm": 0.9}
    )
    assert [body.role for body in scene.bodies] == ["none", "effector"]
    assert [body.friction for body in scene.bodies] == [0.7, 0.9]


def test_the_files_friction_goes_before_the_default_and_the_callers_before_both(tmp_path):
    sticky = ARM.replace(BOX, BOX + '<contact><lateral_friction value="1.5"/></contact>')
    assert [body.friction for body in built(tmp_path, sticky, friction=0.7).bodies] == [1.5, 0.7]
    assert body(built(tmp_path, sticky, frictions={"base": 0.2}), "base").friction == 0.2


# Frames: links without mass


FRAME = link("frame", BOX.replace("<geometry>", '<origin xyz="0 0 0.1"/><geometry>'))


def test_a_link_without_mass_is_part_of_the_link_that_it_is_fixed_to(tmp_path):
    text = chain(
        joint("to_frame", "a", "frame", kind="fixed"), joint("to_b", "frame", "b"), links="ab"
    ).replace("</robot>", FRAME + "</robot>")
    scene = built(tmp_path, text)
    assert names(scene)[:2] == (["a", "b"], ["to_b"])
    assert body(scene, "b").position == pytest.approx([0.6, 0, 0])
    assert body(scene, "a").shape.parts[1].position == pytest.approx([0.3, 0, 0.1])


def test_a_root_without_mass_is_a_fixed_body_or_part_of_what_is_fixed_to_it(tmp_path):
    text = f"""<robot name="r">{link("world", "")}{link("a")}{link("b")}
      {joint("stand", "world", "a", kind="fixed")}{joint("j", "world", "b", at="0 1 0")}</robot>"""
    fixed = built(tmp_path, text)
    assert [body.name for body in fixed.bodies] == ["world", "a", "b"]
    assert fixed.bodies[0].shape.parts == []
    free = built(tmp_path, text, base="free", position=(0, 0, 1))
    assert names(free)[:2] == (["a", "b"], ["j"])
    assert body(free, "a").position == pytest.approx([0.3, 0, 1])
    assert body(free, "b").position == pytest.approx([0, 1, 1])


def test_what_is_said_of_a_frame_is_an_error_that_names_its_link():
    message = "roles has 'panda_link8', a frame without mass that is part of 'panda_link7'"
    with pytest.raises(ValueError, match=message):
        from_urdf(
            DATA / "franka_panda/panda.urdf",
            ignore=NOT_SIMULATED["panda"],
            roles={"panda_link8": "effector"},
        )


# Joints


def test_limits_effort_and_damping_come_from_the_file_unless_the_caller_says_otherwise(tmp_path):
    (shoulder,) = built(tmp_path).joints
    assert (shoulder.limits, shoulder.torque_limit, shoulder.damping) == ((-1.0, 2.0), 3.0, 0.3)
    own = {"limits": (0.5, 1.0), "torque_limit": 9.0, "damping": 2.0, "stiffness": 4.0}
    (shoulder,) = built(tmp_path, joints={"shoulder": own}).joints
    assert (shoulder.limits, shoulder.torque_limit) == ((0.5, 1.0), 9.0)
    assert (shoulder.damping, shoulder.stiffness, shoulder.start) == (2.0, 4.0, 0.5)


def test_a_continuous_joint_turns_without_limits(tmp_path):
    (turning,) = built(tmp_path, chain(joint("j", "a", "b", kind="continuous"), links="ab")).joints
    assert (turning.type, turning.limits) == ("revolute", (-math.inf, math.inf))


def test_an_axis_need_not_be_a_unit_vector(tmp_path):
    (shoulder,) = built(tmp_path, ARM.replace('axis xyz="0 0 1"', 'axis xyz="0 3 4"')).joints
    assert shoulder.axis == pytest.approx([0, 0.6, 0.8])


def follower(of, factor, shift, damping=0.0):
    """The inside of a joint that follows."""
    return f"""<mimic joint="{of}" multiplier="{factor}" offset="{shift}"/>
      <dynamics damping="{damping}"/>"""


def following(factor):
    return joint("follows", "b", "c", follower("source", factor, 0.0))


def test_a_chain_of_mimic_joints_follows_its_source(tmp_path):
    wide = 'lower="-9" upper="9"'
    text = chain(
        joint("last", "c", "d", follower("middle", 2.0, 0.25, 0.1), limit=wide),
        joint("middle", "b", "c", follower("source", -1.0, 0.5, 0.2), limit=wide),
        joint("source", "a", "b", '<dynamics damping="0.3"/>'),
    )
    scene = built(tmp_path, text)
    joints = scene.unpack(scene.pack(joints={"source": 0.75}))["joints"]
    assert joints["middle"]["position"] == pytest.approx(-0.25)
    assert joints["last"]["position"] == pytest.approx(-0.25)
    source = next(j for j in scene.joints if j.name == "source")
    assert source.damping == pytest.approx(0.3 + 1.0 * 0.2 + 4.0 * 0.1)
    assert scene.dimension == 2


def test_a_mimic_joint_may_not_be_led_beyond_its_limits(tmp_path):
    text = chain(
        joint("source", "a", "b"),
        joint("follows", "b", "c", follower("source", 2.0, 0.0)),
        links="abc",
    )
    with pytest.raises(ValueError, match=r"'follows' has limits from -1.* 2\.0; joints="):
        built(tmp_path, text)
    built(tmp_path, text, joints={"source": {"limits": (-0.5, 0.5)}})
    built(tmp_path, text, joints={"follows": {"limits": (-2, 2)}})


# Several robots


def test_robots_with_prefixes_share_a_scene(tmp_path):
    text = chain(
        joint("source", "a", "b"),
        joint("follows", "b", "c", follower("source", 1.0, 0.0)),
        links="abc",
    )
    scene = built(tmp_path, text, prefix="left/")
    assert built(tmp_path, text, scene, prefix="right/", position=(0, 1, 0)) is scene
    bodies, joints, _ = names(scene)
    assert bodies == [f"{side}/{n}" for side in ("left", "right") for n in "abc"]
    assert joints == [f"{side}/{n}" for side in ("left", "right") for n in ("source", "follows")]
    assert [j.mimic.joint for j in scene.joints if j.mimic] == ["left/source", "right/source"]
    state = scene.pack(joints={"left/source": 0.5})
    assert scene.unpack(state)["joints"]["right/follows"]["position"] == 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "the scene has a body 'base'; prefix="),
        ({"prefix": "two/", "role": "chief"}, "role"),
        ({"prefix": "two/", "joints": {"shoulder": {"start": 7.0}}}, "shoulder"),
        ({"prefix": "two/", "friction": -1.0}, "friction"),
    ],
)
def test_an_error_leaves_the_scene_as_it_was(tmp_path, options, message):
    scene = built(tmp_path)
    before = names(scene)
    with pytest.raises(ValueError, match=message):
        built(tmp_path, ARM, scene, **options)
    assert names(scene) == before


# Collisions


def near(a, b):
    """A joint whose child overlaps the link before the parent."""
    return joint(f"{a}{b}", a, b, at="0.04 0 0")


def test_links_that_overlap_at_the_start_are_listed_with_the_way_out(tmp_path):
    text = chain(near("a", "b"), near("b", "c"), links="abc")
    message = r"'a' and 'c' by 20 mm; .*disable_collisions=\[\('a', 'c'\)\], or self"
    with pytest.raises(ValueError, match=message):
        built(tmp_path, text)
    with pytest.raises(ValueError, match=message):
        built(tmp_path, text, prefix="p/")
    apart = built(tmp_path, text, disable_collisions=[("a", "c")], prefix="p/")
    assert apart.disabled_collisions == [("p/a", "p/c")]


def test_without_self_collision_no_two_links_collide(tmp_path):
    text = chain(near("a", "b"), near("b", "c"), near("c", "d"))
    scene = built(tmp_path, text, self_collision=False)
    assert scene.disabled_collisions == [("a", "c"), ("a", "d"), ("b", "d")]
    assert em.World(scene).contacts(scene.pack()) == []


def test_links_that_fixed_joints_hold_together_do_not_collide(tmp_path):
    fixed = [near(*pair).replace("revolute", "fixed") for pair in ("ab", "bc")]
    assert built(tmp_path, chain(*fixed, links="abc")).disabled_collisions == [("a", "c")]


# Meshes


MESH = ARM.replace('<box size="0.1 0.1 0.1"/>', '<mesh filename="FILE" scale="0.1 0.1 0.2"/>')


@pytest.fixture
def cube(tmp_path):
    """A unit cube in a package, beside the robot's folder."""
    folder = tmp_path / "stones" / "meshes"
    folder.mkdir(parents=True)
    (folder / "cube.obj").write_text((DATA / "cube.obj").read_text())
    (tmp_path / "robots").mkdir()
    return folder / "cube.obj"


@pytest.mark.parametrize(
    ("name", "packages"),
    [
        ("package://stones/meshes/cube.obj", ()),  # above the file
        ("package://stones/meshes/cube.obj", ("PLACE/elsewhere", "PLACE")),
        ("package://other/meshes/cube.obj", ("PLACE/stones",)),
        ("../stones/meshes/cube.obj", ()),
        ("stones/meshes/cube.obj", ()),
        ("meshes/cube.obj", ("PLACE/stones",)),
        ("file://PLACE/stones/meshes/cube.obj", ()),
        ("PLACE/stones/meshes/cube.obj", ()),
    ],
)
def test_a_mesh_is_found_by_path_file_and_package(tmp_path, cube, name, packages):
    text = MESH.replace("FILE", name.replace("PLACE", str(tmp_path)))
    folders = [folder.replace("PLACE", str(tmp_path)) for folder in packages]
    scene = built(tmp_path / "robots", text, packages=folders)
    points = scene.bodies[0].shape.parts[0].shape.points
    assert np.ptp(points, axis=0) == pytest.approx([0.1, 0.1, 0.2])


def test_packages_are_found_on_ros_package_path(tmp_path, cube, monkeypatch, tmp_path_factory):
    text = MESH.replace("FILE", "package://stones/meshes/cube.obj")
    far = tmp_path_factory.mktemp("far")
    with pytest.raises(FileNotFoundError, match=r"packages=\(\.\.\.\) adds folders:\n.*cube\.obj"):
        built(far, text)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path}")
    assert len(built(far, text).bodies) == 2


def test_a_mesh_stands_where_its_collision_element_does(tmp_path, cube):
    turned = MESH.replace("FILE", "package://stones/meshes/cube.obj").replace(
        "<collision><geometry>",
        '<collision><origin xyz="0 0 0.5" rpy="1.5707963267948966 0 0"/><geometry>',
    )
    scene = built(tmp_path, turned, base="free", inertia="shapes", self_collision=False)
    properties = em.mass_properties(scene.bodies[0].shape)
    assert properties.volume == pytest.approx(0.002)
    assert properties.center == pytest.approx([0, 0, 0.5])
    (part,) = scene.bodies[0].shape.parts
    turn = Rotation.from_quat(part.orientation)
    assert np.ptp(turn.apply(part.shape.points), axis=0) == pytest.approx([0.1, 0.2, 0.1])


# What is refused


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</robot>", "", "no XML file"),
        ("robot>", "model>", "no XML file"),
        ('<robot name="arm">', "<robot>", "robot: <robot> has no 'name'"),
        ('type="revolute"', 'type="floating"', "'shoulder' is 'floating'.*base='free'"),
        ('type="revolute"', 'type="planar"', "'shoulder' is 'planar', expected one of revolute"),
        ('xyz="0 0 0.05"', 'xyz="0 0"', "joint 'shoulder': <origin xyz='0 0'>, expected three"),
        ('<mass value="0.5"/>', "", "link 'arm': <inertial> has 0 <mass>, expected one"),
        (
            '<mass value="0.5"/>',
            '<mass value="abc"/>',
            "'arm': <mass value='abc'>, expected",
        ),
        ('<mass value="0.5"/>', '<mass value="-1"/>', r"'arm' has the mass -1\.0 kg"),
        (
            '<mass value="0.5"/>',
            '<mass value="0"/>',
            "'arm' has no mass and moves",
        ),
        ('izz="0.0003"', 'izz="0"', "link 'arm': .*inertia='shapes'"),
        ('izz="0.0003"', 'izz="0.1"', "link 'arm': .*0.1.*inertia='shapes'"),
        ('izz="0.0003"', "", "link 'arm': <inertia> has no 'izz'"),
        ('<child link="arm"/>', '<child link="base"/>', "1 root links|loop"),
        ('<child link="arm"/>', "", "'shoulder': <joint> has 0 <child>, expected one"),
        (
            '<parent link="base"/>',
            '<parent link="bass"/>',
            "the parent 'bass', expected one of",
        ),
        ('<link name="arm">', '<link name="base">', "two links 'base'"),
        ('lower="-1" upper="2" ', "", "'shoulder' is revolute and has no limits; joints="),
        ('lower="-1"', 'lower="2"', r"'shoulder' is revolute and has limits from 2\.0 to 2\.0"),
        ('type="revolute"', 'type="continuous"', "'shoulder' is continuous and has limits"),
        ('axis xyz="0 0 1"', 'axis xyz="0 0 0"', "'shoulder' has the axis 0 0 0"),
        ('<box size="0.1 0.1 0.1"/>', "", "link 'base': <geometry> has 0 shapes"),
        ('<box size="0.1 0.1 0.1"/>', '<box size="0.1 0.1 0"/>', "size"),
        ('<box size="0.1 0.1 0.1"/>', '<mesh filename="http://a/b.stl"/>', "expected a path, file"),
    ],
)
def test_a_mistake_in_the_file_is_refused_by_name(tmp_path, old, new, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, ARM.replace(old, new, 1))


@pytest.mark.parametrize(
    ("where", "element", "name"),
    [
        ("robot", "<transmission/>", "transmission"),
        ("robot", "<gazebo/>", "gazebo"),
        ("joint", '<safety_controller k_velocity="1"/>', "safety_controller"),
        ("joint", '<calibration rising="0"/>', "calibration"),
        ("joint", '<joint_properties friction="0"/>', "joint_properties"),
        ("link", "<self_collision_checking/>", "self_collision_checking"),
        ("link", '<contact><rolling_friction value="0.1"/></contact>', "rolling_friction"),
        ("link", '<contact><stiffness value="300"/></contact>', "stiffness"),
    ],
)
def test_what_is_not_simulated_is_refused_unless_it_is_to_be_ignored(
    tmp_path, where, element, name
):
    end = f"</{where}>"
    at = ARM.rindex(end)
    text = ARM[:at] + element + ARM[at:]
    with pytest.raises(ValueError, match=rf"not simulated: {name} \(1\); ignore=\('{name}',\)"):
        built(tmp_path, text)
    assert names(built(tmp_path, text, ignore=(name,))) == names(built(tmp_path))


def test_all_that_is_not_simulated_is_listed_at_once(tmp_path):
    text = ARM.replace('damping="0.3"', 'damping="0.3" friction="0.2"').replace(
        "</robot>", "<gazebo/><gazebo/></robot>"
    )
    message = r"dynamics\.friction \(1\), gazebo \(2\); ignore=\('dynamics\.friction', 'gazebo'\)"
    with pytest.raises(ValueError, match=message):
        built(tmp_path, text)
    assert built(tmp_path, text, ignore=("dynamics.friction", "gazebo")).joints[0].damping == 0.3


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("link/origin", '<link name="base">', '<link name="base"><origin xyz="0 0 9"/>'),
        ("robot/limit", '<link name="base">', '<limit lower="0"/><link name="base">'),
        ("joint/mass", "<dynamics", '<mass value="9"/><dynamics'),
    ],
)
def test_a_misplaced_element_is_ignored_there_and_nowhere_else(tmp_path, name, old, new):
    text = ARM.replace(old, new, 1)
    with pytest.raises(ValueError, match=rf"not simulated: {name} \(1\); ignore=\('{name}',\)"):
        built(tmp_path, text)
    scene, plain = built(tmp_path, text, ignore=(name,)), built(tmp_path)
    assert body(scene, "arm").position == pytest.approx([0, 0, 0.05])
    for ours, expected in zip(scene.bodies, plain.bodies, strict=True):
        assert (ours.name, ours.mass) == (expected.name, expected.mass)
        assert np.array_equal(ours.position, expected.position)
        assert np.array_equal(ours.orientation, expected.orientation)
    assert [j.limits for j in scene.joints] == [j.limits for j in plain.joints] == [(-1.0, 2.0)]


@pytest.mark.parametrize(
    ("name", "places"),
    [
        ("origin", "<inertial>, <collision>, <joint>"),
        ("origin.xyz", "<inertial>, <collision>, <joint>"),
        ("limit", "<joint>"),
        ("link", "<robot>"),
    ],
)
def test_what_is_simulated_is_not_ignored_by_its_bare_name(tmp_path, name, places):
    message = rf"ignore has '{name}', .*simulated in {places}; expected 'parent/{name}'"
    with pytest.raises(ValueError, match=message):
        built(tmp_path, ignore=(name,))


def test_what_is_simulated_is_ignored_with_its_parent(tmp_path):
    scene = built(tmp_path, ignore=("joint/origin.xyz", "joint/limit.effort"))
    assert np.array_equal(body(scene, "arm").position, [0, 0, 0])
    assert body(scene, "arm").inertial.center == pytest.approx([0.2, 0, 0])
    (shoulder,) = scene.joints
    assert (shoulder.limits, shoulder.torque_limit) == ((-1.0, 2.0), math.inf)


# An element and an attribute of namespaces that the file does not declare.
FOREIGN = ARM.replace(
    "</robot>", '<sensor:camera><link name="x"/></sensor:camera></robot>'
).replace('<link name="base">', '<link name="base" xsi:kind="a">')


def test_an_undeclared_namespace_is_one_warning_that_names_what_is_left_out(tmp_path):
    path = tmp_path / "foreign.urdf"
    path.write_text(FOREIGN)
    with pytest.warns(UserWarning) as caught:
        scene = from_urdf(path)
    (warning,) = caught
    assert "undeclared" in str(warning.message) and warning.filename == __file__
    assert "link.xsi:kind (1), sensor:camera (1); ignore=(" in str(warning.message)
    assert names(scene) == names(built(tmp_path))


@pytest.mark.filterwarnings("error")
def test_an_undeclared_namespace_that_is_ignored_is_no_warning(tmp_path):
    scene = built(tmp_path, FOREIGN, ignore=("link.xsi:kind", "sensor:camera"))
    assert names(scene) == names(built(tmp_path))


def test_a_declared_namespace_is_refused_by_a_name_that_can_be_ignored(tmp_path):
    text = ARM.replace("</robot>", '<a:b xmlns:a="http://a"/></robot>')
    with pytest.raises(ValueError, match=r"ignore=\('http://a:b',\)"):
        built(tmp_path, text)
    assert names(built(tmp_path, text, ignore=("http://a:b",))) == names(built(tmp_path))


@pytest.mark.parametrize("namespace", ["", ' xmlns:xacro="http://www.ros.org/wiki/xacro"'])
def test_xacro_is_refused_whether_or_not_its_namespace_is_declared(tmp_path, namespace):
    text = f'<robot name="r"{namespace}>{link("a")}<xacro:hand name="b"/></robot>'
    with pytest.raises(ValueError, match=r"xacro:hand \(1\).*xacro turns such a file into URDF"):
        built(tmp_path, text)


@pytest.mark.parametrize("element", ["a", "link", "visual"])
def test_elements_that_are_nested_without_end_are_refused(tmp_path, element):
    deep = f"<{element}>" * 200_000 + f"</{element}>" * 200_000
    with pytest.raises(ValueError, match="nested deeper than 100 in line 1"):
        built(tmp_path, f'<robot name="r">{deep}</robot>')


def test_an_undefined_entity_is_refused(tmp_path):
    text = '<!DOCTYPE robot SYSTEM "none.dtd">' + ARM.replace("</robot>", "&arm;</robot>")
    with pytest.raises(ValueError, match="undefined entity &arm;"):
        built(tmp_path, text)


# Long chains


def chain_of(count, kind="revolute", inside=INERTIAL + BOX):
    """Links 0, 1, ... in a row; all but the first have `inside`."""
    links = [link("0"), *(link(str(i), inside) for i in range(1, count))]
    joints = [joint(f"j{i}", str(i), str(i + 1), kind=kind) for i in range(count - 1)]
    return f'<robot name="r">{"".join(links + joints)}</robot>'


@pytest.mark.parametrize("how", ["timeout", "cancel"])
def test_a_long_chain_ends_at_its_limit_and_leaves_the_scene_as_it_was(tmp_path, how):
    cancel = em.Cancel()
    cancel.set()
    limit = {"timeout": 0.01} if how == "timeout" else {"cancel": cancel}
    scene = em.Scene()
    with pytest.raises(TimeoutError if how == "timeout" else em.Cancelled, match="before"):
        built(tmp_path, chain_of(5000), scene, **limit)
    assert names(scene) == ([], [], [])


def test_a_scene_takes_a_chain_of_five_thousand_links():
    """Hours, if each joint would place all links anew."""
    scene, count = em.Scene(), 5000
    for i in range(count):
        scene.add_body(str(i), em.Box((0.1, 0.1, 0.1)), mass=1.0)
    for i in range(count - 1):
        scene.add_joint(f"j{i}", parent=str(i), child=str(i + 1), origin=(0.3, 0, 0))
    assert scene.bodies[-1].position == pytest.approx([0.3 * (count - 1), 0, 0])


def test_a_chain_of_links_in_any_order_is_where_the_joints_put_it(tmp_path):
    text = chain_of(40)
    start, end = text.index("<joint"), text.index("</robot>")
    parts = [part + "</joint>" for part in text[start:end].split("</joint>")[:-1]]
    for order in (parts, parts[::-1], parts[::2] + parts[1::2]):
        scene = built(tmp_path, text[:start] + "".join(order) + text[end:])
        for i, link_of in enumerate(scene.bodies):
            assert link_of.position == pytest.approx([0.3 * i, 0, 0])


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_frames_in_a_long_row_are_part_of_the_link_that_carries_them(tmp_path, base):
    (only,) = built(tmp_path, chain_of(1500, "fixed", BOX), base=base).bodies
    assert len(only.shape.parts) == 1500
    assert only.shape.parts[-1].position == pytest.approx([0.3 * 1499, 0, 0])


@pytest.mark.parametrize(
    ("element", "hint"), [("capsule", "a cylinder with a sphere"), ("plane", "Scene.add_plane")]
)
def test_an_unknown_shape_is_refused_with_another_way(tmp_path, element, hint):
    with pytest.raises(ValueError, match=f"{element}.*{hint}"):
        built(tmp_path, ARM.replace('<box size="0.1 0.1 0.1"/>', f"<{element}/>"))


def test_looks_and_what_asks_for_nothing_are_left_out(tmp_path):
    text = (
        ARM.replace(BOX, BOX + "<visual><geometry><teapot/></geometry></visual>")
        .replace('damping="0.3"', 'damping="0.3" friction="0.0"')
        .replace("</robot>", '<material name="red"><color rgba="1 0 0 1"/></material></robot>')
    )
    assert names(built(tmp_path, text)) == names(built(tmp_path))


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ((joint("ab", "a", "b"), joint("cb", "c", "b")), "'ab' and 'cb' both carry 'b'.*loops"),
        ((joint("ab", "a", "b"),), r"2 root links, expected one: \['a', 'c'\]"),
        ((joint("bc", "b", "c"), joint("cb", "c", "b")), "loop, expected a tree"),
        ((joint("ab", "a", "b"), joint("bc", "b", "c", follower("no", 1, 0))), "'bc' mimics 'no'"),
        (
            (
                joint("ab", "a", "b", follower("bc", 1, 0)),
                joint("bc", "b", "c", follower("ab", 1, 0)),
            ),
            "without a circle",
        ),
        (
            (joint("ab", "a", "b", kind="fixed"), joint("bc", "b", "c", follower("ab", 1, 0))),
            "'bc' mimics 'ab', expected a joint that moves",
        ),
        ((joint("ab", "a", "b"), joint("ab", "b", "c")), "two joints 'ab'"),
    ],
)
def test_a_robot_that_is_no_tree_is_refused(tmp_path, joints, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, chain(*joints, links="abc"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"position": (0, 0)}, "position is"),
        ({"orientation": (0, 0, 1)}, "orientation is"),
        ({"orientation": (0, 0, 1, 1)}, "orientation is .* unit quaternion"),
        ({"base": "loose"}, "base is 'loose', expected 'fixed' or 'free'"),
        ({"inertia": "none"}, "inertia is 'none', expected 'file' or 'shapes'"),
        ({"joints": {"elbow": {}}}, "joints has 'elbow', expected one of shoulder"),
        (
            {"joints": {"shoulder": {"stifness": 1}}},
            r"has 'stifness', expected start",
        ),
        ({"joints": {"shoulder": {"limits": (1, 0)}}}, r"has the limits \(1, 0\)"),
        ({"roles": {"hand": "effector"}}, "roles has 'hand', expected one of base, arm"),
        ({"frictions": {"hand": 1.0}}, "frictions has 'hand'"),
        ({"disable_collisions": [("arm", "hand")]}, "disable_collisions has 'hand'"),
        ({"disable_collisions": ["arm"]}, "disable_collisions has .* expected pairs"),
        ({"ignore": "gazebo"}, r"ignore is 'gazebo', expected a tuple: \('gazebo',\)"),
        ({"packages": "/here"}, "packages is '/here', expected a tuple"),
    ],
)
def test_a_bad_argument_is_refused_by_name(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, **options)


def test_a_file_of_another_kind_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no URDF file: its root is <sdf>"):
        built(tmp_path, "<sdf/>")


def test_a_missing_file_is_an_error_that_says_so(tmp_path):
    with pytest.raises(FileNotFoundError):
        from_urdf(tmp_path / "none.urdf")
    with pytest.raises(FileNotFoundError, match="no data file 'none'"):
        data_file("none")


def test_a_robot_of_solids_needs_no_extra(tmp_path, monkeypatch):
    for name in ("trimesh", "coacd"):
        monkeypatch.setitem(sys.modules, name, None)
    assert names(built(tmp_path))[0] != []


def test_the_gripper_of_the_package_is_a_urdf_file():
    scene = from_urdf(data_file("three_finger_gripper.urdf"))
    assert (len(scene.bodies), len(scene.joints)) == (13, 12)
