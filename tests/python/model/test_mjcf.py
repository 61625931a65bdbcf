"""Scenes from MuJoCo models: each of their numbers against MuJoCo's."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mjcf_models import MASS, body, built, joint, link, loose, model, pose_error, random_data
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.scenes import from_mjcf

# Bodies


def test_a_body_has_mujoco_s_mass_centre_and_inertia():
    of = model(link("a"))
    made = body(from_mjcf(of), "a")
    inertial = made.inertial
    assert made.mass == 0.5
    assert np.array_equal(inertial.center, of.body("a").ipos)
    assert np.array_equal(inertial.moments, of.body("a").inertia)
    turn = Rotation.from_quat(np.roll(of.body("a").iquat, -1)).inv()
    assert (turn * Rotation.from_quat(inertial.axes)).magnitude() < 1e-12


def test_a_file_and_its_text_give_the_same_scene_as_the_model(tmp_path):
    text = f"<mujoco><worldbody>{link('a')}</worldbody></mujoco>"
    path = tmp_path / "model.xml"
    path.write_text(text)
    for source in (path, str(path), text):
        assert [b.name for b in from_mjcf(source).bodies] == ["world", "a"]
    with pytest.raises(FileNotFoundError, match=r"no file 'nothing\.xml'"):
        from_mjcf("nothing.xml")
    with pytest.raises(ValueError, match=r"model is \{\}, expected a path"):
        from_mjcf({})


def test_gravity_is_the_model_s_unless_there_is_a_scene_or_it_is_off():
    of = '<option gravity="1 2 3"/>'
    text = f"<mujoco>{of}<worldbody>{link('a')}</worldbody></mujoco>"
    assert from_mjcf(text).gravity == pytest.approx([1, 2, 3])
    off = text.replace('3"/>', '3"><flag gravity="disable"/></option>')
    assert from_mjcf(off).gravity == pytest.approx([0, 0, 0])
    scene = em.Scene((0, 0, -1), friction_rule="max")
    assert from_mjcf(text, scene) is scene
    assert scene.gravity == pytest.approx([0, 0, -1])


def test_gravity_compensation_is_a_force_that_holds_its_share_of_the_weight():
    free = '<freejoint/><geom size="0.1" mass="2"/>'
    scene = built(f'<body name="a" gravcomp="0.75">{free}</body>')
    assert body(scene, "a").force == pytest.approx([0, 0, 0.75 * 2 * 9.81])


# Geoms


def test_solids_have_the_sizes_and_places_of_the_geoms():
    scene = built(
        link("a", geom='<geom type="box" size="1 2 3" pos="0.1 0.2 0.3" euler="0 0 90"/>')
        + link("b", geom='<geom type="sphere" size="0.5"/>')
        + link("c", geom='<geom type="capsule" size="0.1 0.4"/>')
        + link("d", geom='<geom type="cylinder" fromto="0 0 0 0 0 2" size="0.1"/>'),
        self_collision=False,
    )
    (part,) = body(scene, "a").shape.parts
    assert part.shape.size == pytest.approx([2, 4, 6])
    assert part.position == pytest.approx([0.1, 0.2, 0.3])
    assert part.orientation == pytest.approx([0, 0, 0.5**0.5, 0.5**0.5])
    assert body(scene, "b").shape.radius == 0.5
    capsule = body(scene, "c").shape
    assert (capsule.radius, capsule.length) == (0.1, 0.8)
    (part,) = body(scene, "d").shape.parts
    assert (part.shape.radius, part.shape.length) == (0.1, 2.0)
    assert part.position == pytest.approx([0, 0, 1])


def test_an_ellipsoid_is_a_hull_of_points_on_it():
    scene = built(link("a", geom='<geom type="ellipsoid" size="0.1 0.2 0.3"/>'))
    points = np.array(body(scene, "a").shape.points)
    assert np.linalg.norm(points / [0.1, 0.2, 0.3], axis=1) == pytest.approx(np.ones(len(points)))
    volume = em.mass_properties(body(scene, "a").shape, 1.0).volume
    assert volume == pytest.approx(4 / 3 * math.pi * 0.006, rel=0.05)


def test_a_mesh_is_the_hull_that_mujoco_collides_where_its_geom_is():
    corners = "0 0 0  1 0 0  0 1 0  0 0 1  0.1 0.1 0.1"
    of = mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset><mesh name="m" vertex="{corners}" scale="0.1 0.1 0.1"/></asset>
        <worldbody>{link("a", geom='<geom type="mesh" mesh="m" pos="1 2 3" euler="0 90 0"/>')}
        </worldbody></mujoco>"""
    )
    (part,) = body(from_mjcf(of), "a").shape.parts
    turn = Rotation.from_quat(part.orientation)
    points = turn.apply(np.array(part.shape.points)) + part.position
    hull = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    expected = Rotation.from_euler("y", 90, degrees=True).apply(hull) + np.array([1, 2, 3])
    assert len(points) == 4
    for point in expected:
        assert np.abs(points - point).max(axis=1).min() < 1e-6  # a mesh has single precision


def test_planes_are_half_spaces_where_their_body_has_them():
    scene = built(
        '<geom name="floor" type="plane" size="1 1 1" pos="0 0 0.5" friction="0.3"/>'
        '<body pos="0 0 1" euler="0 90 0"><geom name="wall" type="plane" size="1 1 1"/></body>'
        + link("a", at="3 3 3")
    )
    floor = body(scene, "floor")
    assert (floor.shape.offset, floor.friction) == (pytest.approx(0.5), pytest.approx(0.3))
    wall = next(b for b in scene.bodies if b.name not in ("world", "floor", "a"))
    assert wall.shape.normal == pytest.approx([1, 0, 0], abs=1e-12)


def test_what_no_contact_can_reach_is_no_shape():
    seen = '<geom size="0.1" contype="0" conaffinity="0"/>'
    assert body(built(link("a", geom=seen)), "a").shape.parts == []


def test_height_fields_are_named():
    field = '<hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/>'
    inside = '<geom type="hfield" hfield="h"/>'
    with pytest.raises(ValueError, match=r"not simulated: geom/hfield \(1\); ignore="):
        built(inside, sections={"asset": field})
    assert built(inside, sections={"asset": field}, ignore=["geom/hfield"]).bodies == []


# Joints


def test_a_chain_of_hinges_and_slides_with_references_has_the_poses_of_mujoco():
    several = (
        '<joint name="{0}1" axis="1 2 3" pos="0.1 0.2 0.3" ref="40"/>'
        '<joint name="{0}2" type="slide" axis="0 1 1" ref="0.3"/>'
        '<joint name="{0}3" axis="0 1 0" pos="0 0 0.1"/>'
    )
    turned = '<body name="w" pos="0.1 0 0" euler="10 20 30"><geom size="0.01"/>{}</body>'
    inside = link("b", turned.format(link("c", at="0.2 0 0")), several)
    of = model(link("a", inside, '<joint axis="0 0 1" ref="-20"/>'))
    scene = from_mjcf(of, self_collision=False)
    for seed in range(5):
        assert pose_error(scene, of, random_data(of, seed)) < 1e-9
    assert "joint0" in [j.name for j in scene.joints]


def test_a_body_with_several_joints_moves_as_in_mujoco():
    several = (
        '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" axis="0 1 0" pos="0 0 0.3"/>'
        '<joint name="z" axis="0 0 1"/>'
    )
    of = model(link("a", joint=several))
    of.opt.timestep, of.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_RK4
    scene = from_mjcf(of)
    fine = em.Scene(scene.gravity, step=1e-4, friction_rule="max")
    from_mjcf(of, fine)
    data = mujoco.MjData(of)
    data.qvel[:] = 0.5, 1.0, 2.0
    start = em.mujoco.state(fine, of, data)
    (end,) = em.World(fine).simulate(start, 2000, record=[2000]).states
    mujoco.mj_step(of, data, 2000)
    positions = [end[fine.joint_slice(name).start] for name in "xyz"]
    assert positions == pytest.approx(data.qpos, abs=1e-3)


def test_limits_damping_armature_and_stiffness_are_those_of_the_joint():
    of = '<joint name="{0}" range="-30 60" damping="0.3" stiffness="2" springref="10"'
    of += ' armature="1"/>'
    made = joint(built(link("a", joint=of)), "a")
    assert made.limits == pytest.approx(np.radians((-30, 60)))
    assert (made.damping, made.stiffness, made.armature) == (0.3, 2.0, 1.0)
    assert made.target == pytest.approx(np.radians(10))
    assert made.torque_limit == math.inf


def test_a_joint_starts_where_data_or_a_keyframe_has_it_or_at_its_limit():
    of = model(
        link("a", joint='<joint name="a" range="10 60"/>'),
        keyframe='<key name="bent" qpos="0.5" qvel="2"/>',
    )
    assert joint(from_mjcf(of), "a").start == pytest.approx(math.radians(10))
    bent = joint(from_mjcf(of, keyframe="bent"), "a")
    assert (bent.start, bent.start_velocity) == (0.5, 2.0)
    data = mujoco.MjData(of)
    data.qpos[:] = 0.7
    assert joint(from_mjcf(of, data=data), "a").start == 0.7
    with pytest.raises(ValueError, match=r"keyframe is 'straight', expected one of \['bent'\]"):
        from_mjcf(of, keyframe="straight")
    with pytest.raises(ValueError, match="beside data, expected one of the two"):
        from_mjcf(of, keyframe="bent", data=data)


def test_what_joints_sets_replaces_the_model_s():
    scene = built(link("a"), joints={"a": {"stiffness": 3.0, "start": 0.2, "limits": (-1, 1)}})
    assert (joint(scene, "a").stiffness, joint(scene, "a").start) == (3.0, 0.2)
    with pytest.raises(ValueError, match="joints has 'b', expected one of a"):
        built(link("a"), joints={"b": {}})
    with pytest.raises(ValueError, match=r"joints\['a'\] has 'axis', expected start,"):
        built(link("a"), joints={"a": {"axis": 1}})


def test_a_body_on_a_ball_joint_is_free_and_tied_and_ignored_it_is_fixed():
    inside = link("a", joint='<joint type="ball"/>')
    tied = built(inside)
    assert not body(tied, "a").fixed
    assert [(loop.type, loop.body_b) for loop in tied.loops] == [("point", "a")]
    assert body(built(inside, ignore=("joint/ball",)), "a").fixed


def test_a_ball_joint_beside_others_or_with_a_limit_is_named():
    for joints in (
        '<joint type="slide"/><joint type="ball"/>',
        '<joint type="ball" range="0 1" limited="true"/>',
    ):
        with pytest.raises(ValueError, match=r"joint/ball \(1\); ignore=\('joint/ball',\)"):
            built(link("a", joint=joints))


def test_dry_friction_is_of_joints_and_that_of_a_free_joint_is_named():
    dry = link("a", joint='<joint name="a" frictionloss="1"/>')
    assert joint(built(dry), "a").friction == 1
    ignored = built(dry, ignore=("joint.frictionloss",))
    assert joint(ignored, "a").friction == 0
    assert ignored.report.names("left out") == ["joint.frictionloss"]
    off = built(dry, sections={"option": '<flag frictionloss="disable"/>'})
    assert joint(off, "a").friction == 0
    free = link("b", joint='<joint type="free" damping="0.1" frictionloss="1"/>')
    with pytest.raises(ValueError, match=r"joint.damping \(1\), joint.frictionloss \(1\)"):
        built(free)
    with pytest.raises(ValueError, match=r"joint.frictionloss \(1\); ignore"):
        built(dry + link("b", joint='<joint type="free" frictionloss="1"/>'))


def test_a_weld_and_a_connection_of_what_moves_are_loops():
    ends = '<connect body1="a" body2="b" anchor="0 0 0"/><weld body1="a" body2="b"/>'
    inside = link("a") + link("b", at="1 0 1")
    made = built(inside, sections={"equality": ends})
    assert [(of.type, of.body_a, of.body_b) for of in made.loops] == [
        ("point", "a", "b"),
        ("weld", "a", "b"),
    ]


def test_a_word_alone_to_ignore_is_refused():
    with pytest.raises(ValueError, match=r"ignore is 'tendon', expected a tuple: \('tendon',\)"):
        built(link("a"), ignore="tendon")


# What `ignore` leaves loose: joints under a tendon and a motor, and a closed chain.
HAND = {
    "tendon": '<fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed>',
    "actuator": '<position tendon="t" kp="5"/><motor joint="c"/><position joint="d" kp="5"/>',
    "equality": '<connect body1="d" body2="c" anchor="0 0 0"/>',
}
LEFT_OUT = ("actuator/tendon", "actuator/motor", "equality/connect")


def hand(**options):
    links = "".join(link(name, at=f"{i} 0 1") for i, name in enumerate("abcd"))
    return built(links, sections=HAND, ignore=LEFT_OUT, **options)


@pytest.mark.parametrize(
    "message",
    [
        "without 'actuator/tendon' nothing drives or holds a, b",
        "without 'actuator/motor' nothing drives or holds c",
        "without 'equality/connect' nothing drives or holds body 'd', body 'c'",
    ],
)
def test_what_is_ignored_is_told_with_what_it_leaves_loose(message, monkeypatch):
    monkeypatch.setattr("energymargin.base.plausibility._known", set())
    with pytest.warns(em.PlausibilityWarning, match=message):
        hand()


def test_joints_that_are_driven_or_held_otherwise_are_not_told_as_loose(monkeypatch):
    monkeypatch.setattr("energymargin.base.plausibility._known", set())
    joints = {"a": {"stiffness": 5.0}, "b": {"held": True}, "c": {"stiffness": 5.0}}
    with pytest.warns(em.PlausibilityWarning) as told:
        hand(joints=joints)
    assert ["equality/connect" in str(one.message) for one in told] == [True]


CONTRADICTING = link("a", joint='<joint name="{0}" range="0 10" limited="true"/>') + link(
    "b", at="1 0 1", joint='<joint name="{0}" range="20 30" limited="true"/>'
)
EQUAL = {"equality": '<joint joint1="b" joint2="a" polycoef="0 1 0 0 0"/>'}


def test_limits_that_contradict_and_all_else_are_one_error_with_a_switch():
    with pytest.raises(ValueError, match="joint 'a' and those that follow it") as error:
        built(CONTRADICTING, sections=EQUAL, object="c", joints={"d": {}})
    for said in ("mimic_limits='leader'", "object is 'c'", "joints has 'd'"):
        assert said in str(error.value)
    scene = built(CONTRADICTING, sections=EQUAL, mimic_limits="leader")
    assert joint(scene, "a").limits == pytest.approx((0.0, np.radians(10)))
    assert joint(scene, "b").mimic.joint == "a"


@pytest.mark.parametrize(
    "inside",
    [
        '<replicate count="1000000000" offset="1 0 0"><geom size="0.1"/></replicate>',
        '<replicate count="999"><replicate count="999"><geom size="1"/></replicate></replicate>',
    ],
)
def test_copies_without_end_are_refused_before_mujoco_makes_them(inside):
    with pytest.raises(ValueError, match=r"elements by <replicate count=.*at most 100000"):
        from_mjcf(f"<mujoco><worldbody>{inside}</worldbody></mujoco>")


def test_bodies_that_are_nested_without_end_are_refused():
    nested = "<body>" * 20_000 + "</body>" * 20_000
    with pytest.raises(ValueError, match="nesting is too deep"):
        from_mjcf(f"<mujoco><worldbody>{nested}</worldbody></mujoco>")


def test_copies_in_an_included_file_count(tmp_path):
    copies = '<replicate count="200000" offset="1 0 0"><geom size="0.1"/></replicate>'
    (tmp_path / "many.xml").write_text(f"<mujocoinclude>{copies}</mujocoinclude>")
    path = tmp_path / "scene.xml"
    path.write_text('<mujoco><worldbody><include file="many.xml"/></worldbody></mujoco>')
    with pytest.raises(
        ValueError, match=r"asks for 40000\d elements by <replicate count='200000'>"
    ):
        from_mjcf(path)


def test_a_scene_with_another_friction_rule_is_refused_and_stays_as_it_was():
    scene = em.Scene()
    with pytest.raises(ValueError, match=r"scene\.friction_rule is 'product', expected"):
        built(link("a"), scene)
    assert scene.bodies == []


# Subtrees and roles

ARM = link(
    "upper", link("palm", link("finger", at="0.2 0 0"), at="0 0 0.5") + link("side", at="1 0 0")
)


@pytest.mark.parametrize("base", ["fixed", "free", "kinematic"])
def test_a_subtree_is_a_body_and_what_hangs_on_it_where_the_model_has_it(base):
    of = model(ARM)
    data = random_data(of)
    scene = from_mjcf(of, subtree="palm", base=base, data=data)
    assert [b.name for b in scene.bodies] == ["palm", "finger"]
    assert body(scene, "palm").mass == {"fixed": 0.0, "free": 0.5, "kinematic": 1.0}[base]
    assert body(scene, "palm").kinematic == (base == "kinematic")
    assert pose_error(scene, of, data) < 1e-9
    start = em.mujoco.state(scene, of, data)
    assert start == pytest.approx(scene.pack(), abs=1e-9)


def test_a_weld_that_leads_the_base_of_a_subtree_is_no_part_of_it():
    led = '<body name="mocap" mocap="true"/>' + ARM
    of = model(led, equality='<weld body1="mocap" body2="palm"/>')
    assert len(from_mjcf(of, subtree="palm", base="free").joints) == 1
    whole = from_mjcf(of)
    assert [(loop.body_a, loop.body_b) for loop in whole.loops] == [("mocap", "palm")]
    assert [body.name for body in whole.bodies if body.kinematic] == ["mocap"]


def test_a_subtree_may_stand_elsewhere():
    of = model(ARM)
    turn = Rotation.from_euler("x", 90, degrees=True)
    at = {"position": (1, 2, 3), "orientation": turn.as_quat()}
    now = from_mjcf(of, subtree="palm", **at)
    finger = now.unpack(now.pack())["finger"]
    assert finger["position"] == pytest.approx(turn.apply([0.2, 0, 0]) + np.array([1, 2, 3]))
    with pytest.raises(ValueError, match="subtree is 'hand', expected one of world, upper"):
        from_mjcf(of, subtree="hand")
    with pytest.raises(ValueError, match="base is 'free', expected 'fixed', or subtree="):
        from_mjcf(of, base="free")


def test_what_an_equality_couples_with_the_outside_of_a_subtree_is_named():
    coupled = model(ARM, equality='<joint joint1="finger" joint2="upper"/>')
    with pytest.raises(ValueError, match=r"equality/joint \(1\)"):
        from_mjcf(coupled, subtree="palm")
    assert joint(from_mjcf(coupled), "finger").mimic.joint == "upper"


def test_roles_are_those_of_named_bodies_and_of_all_that_hangs_on_an_effector():
    inside = ARM + loose("ball", "0 0 3")
    scene = built(inside, object="ball", effector="palm", prefix="my/")
    roles = {b.name: b.role for b in scene.bodies if b.role != "none"}
    assert roles == {"my/palm": "effector", "my/finger": "effector", "my/ball": "object"}
    with pytest.raises(ValueError, match="object is 'nothing', expected one of"):
        built(inside, object="nothing")
    with pytest.raises(ValueError, match="object is 'palm', which is fixed"):
        built(inside, object="palm", subtree="palm")


def test_a_massless_body_is_part_of_the_one_that_it_is_fixed_to():
    tip = '<body name="tip" pos="0 0 0.1"><geom size="0.01" mass="0"/>'
    frame = f'<body name="frame" pos="0.1 0 0">{tip}'
    of = link("a", frame + link("b", at="0 0 0.3") + "</body></body>", geom="")
    made = model(of)
    scene = from_mjcf(made)
    assert [b.name for b in scene.bodies] == ["world", "a", "b"]
    assert body(scene, "a").shape.parts[0].position == pytest.approx([0.1, 0, 0.1])
    assert pose_error(scene, made, random_data(made)) < 1e-9


def test_a_mass_that_is_fixed_to_another_body_keeps_its_name_and_mass():
    tip = f'<body name="tip" pos="0 0 0.2">{MASS}<geom size="0.01"/></body>'
    scene = built(link("a", tip))
    assert (body(scene, "tip").mass, joint(scene, "tip/fixed").type) == (0.5, "fixed")


@pytest.mark.parametrize(
    ("file", "subtree", "tendons"),
    [
        ("envs/assets/fetch/pick_and_place.xml", "robot0:gripper_link", 0),
        ("envs/assets/hand/reach.xml", "robot0:hand mount", 4),
    ],
)
def test_a_hand_of_gymnasium_robotics_is_where_mujoco_has_it(file, subtree, tendons):
    robotics = pytest.importorskip("gymnasium_robotics")
    of = mujoco.MjModel.from_xml_path(str(Path(robotics.__file__).parent / file))
    options = {"subtree": subtree, "disable_collisions": "overlapping"}
    scene = from_mjcf(of, **options)
    assert len(scene.tendons) == tendons
    data, random = mujoco.MjData(of), np.random.default_rng(0)
    for one in scene.joints:
        if one.type != "fixed" and one.mimic is None:
            data.joint(one.name).qpos = random.uniform(*one.limits)
    assert pose_error(scene, of, data) < 1e-9


def test_a_mocap_body_that_is_the_effector_is_moved_by_a_plan():
    geom = '<geom type="sphere" size=".02"/>'
    pusher = f'<body name="pusher" mocap="true" pos="0 -.2 .5">{geom}</body>'
    other = f'<body name="other" mocap="true" pos="0 .2 .5">{geom}</body>'
    of = model(pusher + other + f'<body name="ball" pos="0 0 .5"><freejoint/>{geom}</body>')
    scene = em.scenes.from_mjcf(of, object="ball", effector="pusher")
    assert [body.name for body in scene.bodies if body.kinematic] == ["pusher"]
    plan = em.Plan(1 / 240, velocities={"pusher": np.tile([0, 0.1, 0, 0, 0, 0], (24, 1))})
    (end,) = em.World(scene, plan).simulate(scene.pack(), steps=24, record=[24]).states
    assert scene.unpack(end)["pusher"]["position"] == pytest.approx([0, -0.19, 0.5])
