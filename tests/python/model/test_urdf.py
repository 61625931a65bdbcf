"""Robots from URDF files: links, frames, collisions and meshes."""

import math

import numpy as np
import pybullet
import pytest
from mesh_files import angle
from scipy.spatial.transform import Rotation
from urdf_files import (
    ARM,
    BOX,
    DATA,
    INERTIAL,
    body,
    built,
    chain,
    follower,
    inertia,
    joint,
    link,
    names,
)

import energymargin as em
from energymargin.scenes import from_urdf

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
    "panda": ("safety_controller", "friction_anchor"),
    "xarm": ("gazebo", "transmission"),
}


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    ("file", "moving", "options"),
    [
        ("pr2_gripper.urdf", 2, {}),
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
@pytest.mark.parametrize("scaling", ["", '<contact><inertia_scaling value="3"/></contact>'])
def test_an_inertia_that_is_turned_and_has_products_is_the_files(tmp_path, scaling):
    scene = built(tmp_path, ARM.replace("</link>", scaling + "</link>"))
    robot = pybullet.loadURDF(
        str(tmp_path / "robot.urdf"), flags=pybullet.URDF_USE_INERTIA_FROM_FILE
    )
    _, _, moments, center, axes = pybullet.getDynamicsInfo(robot, 0)[:5]
    own = body(scene, "arm").inertial
    found = inertia(own.center, own.moments, own.axes)[0]
    assert found == pytest.approx(inertia(center, moments, axes)[0], abs=1e-9)
    # The z axis of the inertia's frame is the arm's x.
    factor = 3.0 if scaling else 1.0
    assert (found[0, 0], found[1, 2]) == pytest.approx((factor * 0.0003, factor * -0.0001))
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


NOTHING = '<inertial><mass value="1e-9"/></inertial>'


@pytest.mark.parametrize("inside", ["", NOTHING])
def test_a_link_of_next_to_no_mass_is_a_frame_and_gets_a_mass_where_a_joint_moves_it(
    tmp_path, inside
):
    text = chain(
        *(joint("tool", "a", "tcp", kind="fixed", at="0 0 0.105"), joint("moves", "a", "carrier")),
        *(joint("hold", "carrier", "b", kind="fixed"), joint("turn", "b", "tip")),
        links="ab",
    ).replace("</robot>", "".join(link(n, inside) for n in ("tcp", "carrier", "tip")) + "</robot>")
    with pytest.warns(em.PlausibilityWarning, match="'carrier' 1e-09 kg, 'tip' 0.002 kg") as told:
        scene = built(tmp_path, text)
    assert len(told) == 1
    assert [body.name for body in scene.bodies] == ["a", "b", "carrier", "tip"]
    assert [body(scene, name).mass for name in ("carrier", "tip")] == pytest.approx([1e-9, 2e-3])
    assert scene.report == (
        ("part of another body", "tcp", "a at (0, 0, 0.105) m"),
        ("stated", "carrier", "1e-09 kg"),
        ("stated", "tip", "0.002 kg"),
        ("joint undriven", "moves", ""),
        ("joint undriven", "turn", ""),
    )


def test_links_that_end_a_chain_without_a_mass_get_the_same_thousandth(tmp_path):
    joints = (joint(f"to_{tip}", "a", tip, at=f"0 {i} 0") for i, tip in enumerate(("tip", "top")))
    tips = link("tip", BOX) + link("top", BOX)
    text = chain(*joints, links="a").replace("</robot>", tips + "</robot>")
    with pytest.warns(em.PlausibilityWarning, match="'tip' 0.001 kg, 'top' 0.001 kg"):
        scene = built(tmp_path, text)
    assert [b.mass for b in scene.bodies[1:]] == [1e-3, 1e-3]


def test_a_mass_without_extent_gets_an_inertia_if_it_is_asked_for(tmp_path):
    heavy = '<inertial><mass value="0.1"/></inertial>'
    text = chain(joint("moves", "a", "b"), links="a").replace(
        "</robot>", link("b", heavy) + "</robot>"
    )
    with pytest.raises(ValueError, match="link 'b': it has a mass and no <inertia>; inertia='sh"):
        built(tmp_path, text)
    with pytest.warns(em.PlausibilityWarning, match=r"'b' a radius of gyration of 0\.01 m"):
        scene = built(tmp_path, text, inertia="shapes")
    assert body(scene, "b").inertial.moments == pytest.approx([1e-5] * 3)


# The report


def test_a_report_tells_of_all_files_of_a_scene_and_of_nothing_made_by_hand(tmp_path):
    by_hand = em.Scene()
    assert len(by_hand.report) == 0 and "Nothing was left out" in repr(by_hand.report)
    text = ARM.replace("</robot>", "<transmission/><transmission/></robot>")
    scene = built(tmp_path, text, prefix="left/", ignore=["transmission"])
    driven = {"shoulder": {"stiffness": 5.0}}
    again = built(tmp_path, text, scene, prefix="right/", joints=driven, ignore=["transmission"])
    assert again.report.names("left out") == ["transmission"] * 2
    assert again.report.names("joint undriven") == ["left/shoulder"]
    assert "| joint holds its start | right/shoulder | 0, for want of a target |" in repr(
        again.report
    )
    assert "| joint undriven | left/shoulder |" in repr(scene.report)
    assert "<td" in scene.report._repr_html_()


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


def test_links_that_overlap_wherever_their_joints_are_never_collide_and_it_is_told(tmp_path):
    text = chain(near("a", "b"), near("b", "c"), links="abc")
    message = r"wherever their joints are: 'a' and 'c' by 20 mm\. They never collide"
    with pytest.warns(em.PlausibilityWarning, match=message):
        scene = built(tmp_path, text, prefix="p/")
    assert scene.disabled_collisions == [("p/a", "p/c")]
    assert scene.report.names("overlap, never colliding") == ["p/a and p/c"]


SLIDE = joint("ab", "a", "b", kind="prismatic", at="0.2 0 0", limit='lower="0" upper="0.5"')
SLIDES = chain(SLIDE, joint("ac", "a", "c", kind="fixed", at="0.2 0 0.09"), links="abc")


def test_links_that_overlap_at_the_start_alone_touch_and_are_pressed_apart(tmp_path):
    message = r"overlap at the start: 'b' and 'c' by 10 mm\. They touch.*'start'.*\('b', 'c'\)"
    with pytest.warns(em.PlausibilityWarning, match=message):
        scene = built(tmp_path, SLIDES)
    assert scene.disabled_collisions == []
    assert scene.report.names("overlap, touching") == ["b and c"]
    for given in ("overlapping", [("b", "c")]):
        apart = built(tmp_path, SLIDES, disable_collisions=given)
        assert apart.disabled_collisions == [("b", "c")]
    with pytest.raises(ValueError, match="disable_collisions is 'all', expected 'overlapping' or"):
        built(tmp_path, SLIDES, disable_collisions="all")


def test_a_hull_that_blocks_another_link_of_its_robot_is_warned_of(tmp_path):
    """A block that slides in the corner of an L: its hull is there, the mesh is not."""
    angle(tmp_path)
    mesh = '<collision><geometry><mesh filename="angle.stl"/></geometry></collision>'
    box = '<collision><geometry><box size=".02 .02 .02"/></geometry></collision>'
    slide = joint("ab", "a", "b", kind="prismatic", at=".1 .1 .09", limit='lower="-.1" upper="0"')
    text = chain(slide, joint("ac", "a", "c", kind="fixed", at="0 0 0"), links="").replace(
        "</robot>",
        link("a", INERTIAL) + link("b", INERTIAL + box) + link("c", INERTIAL + mesh) + "</robot>",
    )
    way = r"'c' collides as the convex hull .* overlaps 'b' in .*decompose=True .*\('c', 'b'\)"
    with pytest.warns(em.PlausibilityWarning, match=way):
        built(tmp_path, text, decompose=False)


def test_without_self_collision_no_two_links_collide(tmp_path):
    text = chain(near("a", "b"), near("b", "c"), near("c", "d"))
    scene = built(tmp_path, text, self_collision=False)
    assert scene.disabled_collisions == [("a", "c"), ("a", "d"), ("b", "d")]
    assert em.World(scene).contacts(scene.pack()) == []


def test_links_that_fixed_joints_hold_together_do_not_collide(tmp_path):
    fixed = [near(*pair).replace("revolute", "fixed") for pair in ("ab", "bc")]
    scene = built(tmp_path, chain(*fixed, links="abc"))
    assert em.World(scene).contacts(scene.pack()) == []


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


def test_all_meshes_that_are_missing_are_listed_and_the_folders_once(tmp_path):
    text = MESH.replace("FILE", "meshes/a.stl").replace(
        '<cylinder radius="0.02" length="0.4"/>', '<mesh filename="meshes/b.stl"/>'
    )
    with pytest.raises(FileNotFoundError) as error:
        built(tmp_path, text)
    assert str(error.value).count(str(tmp_path / "meshes/a.stl")) == 1
    assert str(error.value).endswith("has 'meshes/b.stl', nor there")


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
