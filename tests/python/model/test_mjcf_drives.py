"""What drives and couples joints of a MuJoCo model: actuators, equalities, tendons."""

import math

import mujoco
import numpy as np
import pytest
from mjcf_models import built, joint, link, model

import energymargin as em
from energymargin.scenes import from_mjcf

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
