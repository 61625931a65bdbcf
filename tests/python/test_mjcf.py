"""Scenes from MuJoCo models: each of their numbers against MuJoCo's."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mjcf_models import MASS, body, built, joint, link, model, pose_error, random_data
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


# Actuators


def driven(actuator, **options):
    sections = {"actuator": actuator, **options.pop("sections", {})}
    return joint(built(link("a", **options), sections=sections), "a")


def test_a_position_actuator_is_the_joint_s_compliance_about_its_control():
    of = model(
        link("a", joint='<joint name="a" damping="0.5"/>'),
        actuator='<position joint="a" kp="4" kv="0.25" gear="3" forcerange="-2 2"/>',
    )
    data = mujoco.MjData(of)
    data.ctrl[:] = 0.6
    made = joint(from_mjcf(of, data=data), "a")
    assert (made.stiffness, made.damping, made.torque_limit) == (36.0, 0.5 + 9 * 0.25, 6.0)
    assert made.target == pytest.approx(0.2)


@pytest.mark.parametrize("control", [0.0, 0.3])
def test_a_drive_holds_its_joint_where_mujoco_s_does(control):
    of = model(
        link("a", joint='<joint name="a" axis="0 1 0" damping="1" stiffness="1" springref="20"/>'),
        actuator='<general joint="a" gainprm="5 1" gaintype="affine" biastype="affine" '
        'biasprm="0.2 -6 -0.5"/>',
    )
    data = mujoco.MjData(of)
    data.ctrl[:] = control
    scene = from_mjcf(of, data=data)
    (end,) = em.World(scene).simulate(scene.pack(), 2000, record=[2000]).states
    mujoco.mj_step(of, data, 5000)
    assert end[0] == pytest.approx(data.qpos[0], abs=1e-6)


def test_a_velocity_actuator_is_damping_towards_a_velocity():
    of = model(link("a"), actuator='<velocity joint="a" kv="2" gear="0.5"/>')
    data = mujoco.MjData(of)
    data.ctrl[:] = 3.0
    made = joint(from_mjcf(of, data=data), "a")
    assert (made.stiffness, made.damping, made.target_velocity) == (0.0, 0.5, 6.0)


def test_a_motor_is_named_unless_its_force_is_zero_or_the_joint_is_commanded():
    motor = {"actuator": '<motor joint="a"/>'}
    with pytest.warns(em.PlausibilityWarning, match=r"moves nothing here.*actuator/motor \(1\)"):
        scene = built(link("a"), sections=motor)
    assert scene.report.names("joint undriven") == ["a"]
    pushing = motor | {"keyframe": '<key ctrl="0.5"/>'}
    with pytest.raises(ValueError, match=r"actuator/motor \(1\)"):
        built(link("a"), sections=pushing, keyframe=0)
    assert built(link("a"), sections=motor, joints={"a": {"held": True}}).joints[0].held
    assert built(link("a"), sections=motor, ignore=["actuator/motor"]).joints[0].stiffness == 0


def test_a_limit_of_force_that_is_uneven_or_shared_is_named():
    for actuators in (
        '<position joint="a" kp="1" forcerange="-1 2"/>',
        '<position joint="a" kp="1" forcerange="-1 1"/><velocity joint="a" kv="1"/>',
    ):
        with pytest.raises(ValueError, match=r"actuator\.forcerange"):
            driven(actuators)
    with pytest.raises(ValueError, match=r"actuator\.forcerange"):
        driven(
            '<position joint="a" kp="1" forcerange="-1 1"/>',
            joint='<joint name="a" stiffness="1"/>',
        )


# Equalities and tendons


def pair(equality, **options):
    return built(
        link("a") + link("b", at="1 0 1", joint=options.pop("joint", '<joint name="{0}"/>')),
        sections={"equality": equality, **options.pop("sections", {})},
        **options,
    )


def test_an_equality_of_joints_is_a_mimic_with_the_references():
    equality = '<joint joint1="b" joint2="a" polycoef="0.1 -2 0 0 0"/>'
    reference = '<joint name="{0}" ref="30"/>'
    mimic = joint(pair(equality, joint=reference), "b").mimic
    assert (mimic.joint, mimic.multiplier) == ("a", -2.0)
    assert mimic.offset == pytest.approx(0.1 + math.radians(30))


def test_the_joint_with_an_actuator_leads():
    equality = '<joint joint1="b" joint2="a" polycoef="0.2 2 0 0 0"/>'
    scene = pair(equality, sections={"actuator": '<position joint="b" kp="8"/>'})
    mimic = joint(scene, "a").mimic
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("b", 0.5, pytest.approx(-0.1))
    assert joint(scene, "b").stiffness == 8.0


def test_what_acts_on_a_joint_that_follows_acts_on_the_one_that_leads():
    equality = '<joint joint1="b" joint2="a" polycoef="0 2 0 0 0"/>'
    of = '<joint name="{0}" range="-60 20" damping="0.5" armature="0.25"/>'
    made = joint(pair(equality, joint=of), "a")
    assert made.limits == pytest.approx(np.radians((-30, 10)))
    assert (made.damping, made.armature) == (2.0, 1.0)


def test_a_joint_that_equals_a_constant_is_held_there():
    made = joint(pair('<joint joint1="b" polycoef="0.3 1 0 0 0"/>'), "b")
    assert (made.held, made.start) == (True, 0.3)


def test_a_chain_of_equalities_leads_to_one_joint_and_a_curved_one_is_named():
    inside = "".join(link(name, at=f"{i} 0 1") for i, name in enumerate("abcd"))
    chain = "".join(
        f'<joint joint1="{one}" joint2="{other}" polycoef="0.5 2 0 0 0"/>'
        for one, other in ("dc", "cb", "ba")
    )
    mimic = joint(built(inside, sections={"equality": chain}), "d").mimic
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("a", 8.0, 3.5)
    with pytest.raises(ValueError, match=r"equality/joint \(1\)"):
        pair('<joint joint1="b" joint2="a" polycoef="0 1 1 0 0"/>')


def test_a_tendon_of_two_joints_that_an_equality_holds_is_a_mimic():
    fixed = '<fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="0.5"/></fixed>'
    mimic = joint(pair('<tendon tendon1="t"/>', sections={"tendon": fixed}), "b").mimic
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("a", -2.0, 0.0)


def test_an_actuator_of_a_tendon_drives_the_joint_that_leads():
    fixed = '<fixed name="t"><joint joint="a" coef="0.5"/><joint joint="b" coef="0.5"/></fixed>'
    drive = '<position tendon="t" kp="4"/>'
    sections = {"tendon": fixed, "actuator": drive}
    made = joint(pair('<joint joint1="b" joint2="a"/>', sections=sections), "a")
    assert made.stiffness == 4.0
    (tendon,) = built(link("a") + link("b", at="1 0 1"), sections=sections).tendons
    assert tendon.stiffness == 4.0
    assert [(of.joint, of.coefficient) for of in tendon.joints] == [("a", 0.5), ("b", 0.5)]


def test_a_tendon_of_one_joint_is_its_limit_spring_and_damper():
    fixed = (
        '<fixed name="t" range="-0.1 0.2" limited="true" stiffness="3" springlength="0.1" '
        'damping="2"><joint joint="a" coef="0.5"/></fixed>'
    )
    made = joint(built(link("a"), sections={"tendon": fixed}), "a")
    assert made.limits == pytest.approx((-0.2, 0.4))
    assert (made.stiffness, made.damping, made.target) == (0.75, 0.5, pytest.approx(0.2))


def test_a_tendon_of_two_joints_has_limits_unless_those_of_the_joints_keep_it_slack():
    limited = '<joint name="{0}" range="-10 10"/>'
    inside = link("a", joint=limited) + link("b", at="1 0 1", joint=limited)
    ends = '<joint joint="a" coef="{0}"/><joint joint="b" coef="{0}"/>'
    fixed = f'<fixed range="-1 1" limited="true">{ends}</fixed>'
    assert not built(inside, sections={"tendon": fixed.format(1)}).tendons
    (tendon,) = built(inside, sections={"tendon": fixed.format(10)}).tendons
    assert tendon.limits == (-1, 1)


# Contacts


def contacts(of, scene=None):
    """Pairs of bodies that touch, and their coefficients, in MuJoCo and in the scene."""
    data = mujoco.MjData(of)
    mujoco.mj_forward(of, data)
    name = lambda geom: of.body(of.geom_bodyid[geom]).name  # noqa: E731
    in_mujoco = {
        frozenset((name(c.geom1), name(c.geom2))): (c.friction[0] if c.dim > 1 else 0.0)
        for c in data.contact
    }
    made = scene or from_mjcf(of, ignore=["geom.condim"])
    world, start = em.World(made), made.pack()
    ours = {frozenset((c.body_a, c.body_b)) for c in world.contacts(start)}
    frictions = {pair: made.contact_friction(*pair) for pair in ours}
    return in_mujoco, frictions


def loose(name, at, **geom):
    of = " ".join(f'{key}="{value}"' for key, value in geom.items())
    return (
        f'<body name="{name}" pos="{at}"><freejoint/><geom name="{name}" size="0.5" {of}/></body>'
    )


def test_who_collides_and_how_rough_is_what_mujoco_says():
    of = model(
        loose("a", "0 0 0", friction=0.3)
        + loose("b", "0.9 0 0", friction=0.7)
        + loose("c", "0.4 0.8 0", friction=0.1, priority=1)
        + loose("d", "0.4 -0.8 0", condim=1, friction=0.9)
        + loose("e", "0.4 0 0.8", contype=2, conaffinity=2)
        + loose("f", "0.4 0 -0.8", contype=2, conaffinity=1),
        contact='<pair geom1="a" geom2="e" friction="0.05 0.05 0 0 0"/>'
        '<exclude body1="b" body2="f"/>',
    )
    in_mujoco, ours = contacts(of)
    assert len(in_mujoco) == 7
    assert ours == pytest.approx(in_mujoco)


def test_a_parent_collides_with_its_child_only_if_it_is_the_world():
    ball = '<geom size="0.3"/>'
    inside = link("b", link("c", at="0.2 0 0", geom=ball), at="0.2 0 0", geom=ball)
    of = model('<geom name="wall" size="0.3"/>' + link("a", inside, at="0.2 0 0", geom=ball))
    scene = from_mjcf(of, disable_collisions="overlapping")
    in_mujoco, _ = contacts(of, scene)
    allowed = {frozenset(pair) for pair in scene.disabled_collisions}
    allowed |= {frozenset((j.parent, j.child)) for j in scene.joints}
    names = {"world": "wall"}
    ours = {frozenset(names.get(name, name) for name in pair) for pair in in_mujoco}
    assert frozenset(("wall", "a")) in ours
    assert frozenset(("a", "b")) not in ours
    assert ours <= allowed  # as they overlap at the start


def test_geoms_of_a_body_that_collide_with_others_differently_are_bodies_fixed_to_it():
    geoms = (
        '<geom name="rough" size="0.1" friction="1"/>'
        '<geom name="smooth" size="0.1" pos="0.3 0 0" friction="0.1"/>'
    )
    scene = built(
        '<geom name="floor" type="plane" size="1 1 1" friction="0"/>' + link("a", geom=geoms)
    )
    light = body(scene, "a/smooth")
    assert (body(scene, "a").friction, light.friction) == (1.0, pytest.approx(0.1))
    assert body(scene, "a").mass == 0.5
    assert 0 < light.mass < 1e-8
    assert joint(scene, "a/smooth/fixed").parent == "a"


def test_links_that_always_overlap_never_collide_and_others_are_let_through_if_asked():
    with pytest.warns(em.PlausibilityWarning, match="'a' and 'b' by 50 mm. They never collide"):
        assert ("a", "b") in built(link("a") + link("b", at="0.05 0 1")).disabled_collisions
    slide = '<joint name="{0}" type="slide" range="0 1" limited="true"/>'
    inside = link("a") + link("b", at="0.05 0 1", joint=slide)
    assert built(inside).disabled_collisions == []
    for options in (
        {"disable_collisions": "overlapping"},
        {"disable_collisions": [("a", "b")]},
        {"self_collision": False},
    ):
        assert ("a", "b") in built(inside, **options).disabled_collisions
    with pytest.raises(ValueError, match="body is 'c', expected one of"):
        built(inside, disable_collisions=[("a", "c")])


# A finger that a servo presses on a cube or on a table; the cube rests on the table.
PRESS = """<mujoco>
  <worldbody>
    <geom name="table" type="plane" size="1 1 1" friction="1"/>
    <body name="palm" pos="0 0 0.3">
      <body name="finger">
        <joint name="down" type="slide" axis="0 0 -1" range="0 0.3" damping="5"/>
        <geom type="sphere" size="0.02" mass="0.2" friction="1"/>
      </body>
    </body>
    <body name="cube" pos="{at} 0 0.03">
      <freejoint/><geom type="box" size="0.03 0.03 0.03" mass="0.2" friction="1"/>
    </body>
  </worldbody>
  <actuator><position joint="down" kp="200" forcerange="-20 20"/></actuator>
</mujoco>"""


def pressed(at):
    """In MuJoCo, with the cube beside the finger, until all is at rest."""
    of = mujoco.MjModel.from_xml_string(PRESS.format(at=at))
    data = mujoco.MjData(of)
    data.ctrl[:] = 0.4
    mujoco.mj_step(of, data, 2000)
    return of, data


def fingertip(scene, state, name="finger"):
    return scene.unpack(state)[name]["position"][2]


@pytest.mark.parametrize("options", [{}, {"disable_collisions": "overlapping"}])
def test_a_grip_of_mujoco_is_a_contact_that_holds(options):
    of, data = pressed(at=0)
    assert min(contact.dist for contact in data.contact) < -1e-4
    scene = from_mjcf(of, object="cube", effector="finger", data=data, **options)
    start = em.mujoco.state(scene, of, data)
    end = em.World(scene).simulate(start, steps=240, record=[240]).states[-1]
    assert fingertip(scene, end) == pytest.approx(0.08, abs=1e-3)
    inside = em.regions.Ball("cube", (0, 0, 0.03), 0.01)
    bounds = {"force": (3, 3, 0), "torque": (0, 0, 0), "duration": 0.1, "captured": inside}
    problem = em.Problem(scene, start, horizon=0.5, **bounds)
    assert em.capture_probability(problem, rollouts=20).captured == 1.0


def test_a_finger_that_presses_on_a_table_in_a_keyframe_presses_on_it_here():
    data = pressed(at=0.5)[1]
    key = f'<keyframe><key qpos="{" ".join(map(str, data.qpos))}" ctrl="0.4"/></keyframe>'
    saved = PRESS.format(at=0.5).replace("</mujoco>", key + "</mujoco>")
    with pytest.warns(em.PlausibilityWarning, match=r"'finger' and 'table' by .*pressed apart"):
        scene = from_mjcf(saved, keyframe=0)
    assert scene.report.names("overlap, touching") == ["finger and table"]
    end = em.World(scene).simulate(scene.pack(), steps=240, record=[240]).states[-1]
    assert fingertip(scene, end) == pytest.approx(0.02, abs=1e-3)


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
    monkeypatch.setattr("energymargin.plausibility._known", set())
    with pytest.warns(em.PlausibilityWarning, match=message):
        hand()


def test_joints_that_are_driven_or_held_otherwise_are_not_told_as_loose(monkeypatch):
    monkeypatch.setattr("energymargin.plausibility._known", set())
    joints = {"a": {"stiffness": 5.0}, "b": {"held": True}, "c": {"stiffness": 5.0}}
    with pytest.warns(em.PlausibilityWarning) as told:
        hand(joints=joints)
    assert ["equality/connect" in str(one.message) for one in told] == [True]


def test_margins_are_named():
    with pytest.raises(ValueError, match=r"geom.margin \(1\)"):
        built(link("a", geom='<geom size="0.05" margin="0.01"/>'))


def test_friction_that_turns_is_that_of_the_dimensions_of_contacts():
    """Of a pair the larger ones, where its contacts have so many dimensions."""
    rough = '<geom size="0.05" friction="0.9 0.03 0.002" condim="{}"/>'
    places = {"a": 3, "b": 4, "c": 6}
    inside = [
        link(name, at=f"{i} 0 1", geom=rough.format(condim))
        for i, (name, condim) in enumerate(places.items())
    ]
    scene = built("".join(inside))
    expected = {"ab": (0.03, 0.0), "ac": (0.03, 0.002), "bc": (0.03, 0.002)}
    for (a, b), turning in expected.items():
        surface = scene.contact_surface(a, b)
        assert (surface.torsional_friction, surface.rolling_friction) == turning
        assert scene.contact_friction(a, b) == 0.9
    assert scene.bodies[[body.name for body in scene.bodies].index("a")].surface is None
    sliding = built("".join(inside), ignore=("geom.condim",))
    assert sliding.report.names("left out") == ["geom.condim"]
    assert all(body.surface is None for body in sliding.bodies)


def test_a_pair_has_its_own_friction_that_turns():
    geoms = [
        link(name, at=f"{i} 0 1", geom=f'<geom name="{name}" size="0.05"/>')
        for i, name in enumerate("ab")
    ]
    pair = '<pair geom1="a" geom2="b" condim="6" friction="0.4 0.4 0.02 0.001 0.001"/>'
    scene = built("".join(geoms), sections={"contact": pair})
    surface = scene.contact_surface("a", "b")
    assert (surface.torsional_friction, surface.rolling_friction) == (0.02, 0.001)
    assert scene.contact_friction("a", "b") == 0.4


def test_a_margin_as_small_as_an_overlap_of_mujoco_is_left_out_with_a_warning():
    with pytest.warns(em.PlausibilityWarning, match=r"next to nothing: geom.margin \(1\)"):
        scene = built(link("a", geom='<geom size="0.05" margin="0.001"/>'))
    assert scene.report == (("left out", "geom.margin", "1"), ("joint undriven", "a", ""))


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
