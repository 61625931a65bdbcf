"""Joints of URDF files, and long chains of them."""

import math
import sys
import time
import warnings

import pytest
from urdf_files import (
    ARM,
    BOX,
    INERTIAL,
    built,
    chain,
    follower,
    joint,
    link,
    names,
)

import energymargin as em
from energymargin.scenes import data_file, from_urdf

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


def test_the_report_names_a_follower_whose_effort_does_not_count(tmp_path):
    strong = 'lower="-1" upper="1" effort="8"'
    text = chain(
        joint("source", "a", "b", limit=strong),
        joint("follows", "b", "c", follower("source", 1, 0), limit=strong),
        joint("last", "c", "d", limit=strong),
    )
    scene = built(tmp_path, text, prefix="my/")
    assert scene.report.names("effort that does not count") == ["my/follows"]
    assert "8: that of my/source counts" in repr(scene.report)


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


TWO_WRONG = chain(
    joint("source", "a", "b"),
    joint("follows", "b", "c", follower("source", 2.0, 0.0)),
    joint("late", "c", "d", follower("source", 1.0, 0.5)),
)


def test_limits_that_contradict_are_listed_at_once_with_one_switch(tmp_path):
    with pytest.raises(ValueError, match="mimic_limits='leader'") as error:
        built(tmp_path, TWO_WRONG)
    for name in ("follows", "late"):
        assert f"joint '{name}' has limits from" in str(error.value)
    scene = built(tmp_path, TWO_WRONG, mimic_limits="leader")
    last = scene.unpack(scene.pack(joints={"source": 1.0}))["joints"]
    assert (last["follows"]["position"], last["late"]["position"]) == pytest.approx((2.0, 1.5))
    with pytest.raises(ValueError, match="mimic_limits is 'mine', expected 'file' or 'leader'"):
        built(tmp_path, TWO_WRONG, mimic_limits="mine")


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


@pytest.mark.parametrize("inside", ["", BOX, INERTIAL, INERTIAL + BOX])
def test_ten_times_as_many_fixed_links_take_ten_times_as_long(tmp_path, inside):
    """A hundred times, if each link would look at all others."""
    taken = []
    for count in (500, 5000):
        begin = time.process_time()
        scene = built(tmp_path, chain_of(count, "fixed", inside))
        taken.append(time.process_time() - begin)
        assert len(scene.bodies) == (count if INERTIAL in inside else 1)
    assert taken[1] < 40 * taken[0]


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


@pytest.mark.parametrize("element", ["capsule", "plane"])
def test_an_unknown_shape_is_refused(tmp_path, element):
    with pytest.raises(ValueError, match=element):
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
            "'bc' mimics 'ab', expected one that moves",
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


# Torque limits of joints that follow each other


def lift(tmp_path, factor, effort, of_follower):
    """How far a slide with 1 kg sinks in a quarter of a second, with a follower of 1 kg beside."""
    wide = 'lower="-9" upper="9" effort="{}"'
    text = chain(
        joint("leads", "a", "b", kind="prismatic", limit=wide.format(effort)),
        joint(
            "follows",
            "a",
            "c",
            follower("leads", factor, 0.0),
            kind="prismatic",
            at="-0.3 0 0",
            limit=f'lower="-99" upper="99" effort="{of_follower}"',
        ),
        links="abc",
    )
    scene = built(tmp_path, text, joints={"leads": {"stiffness": 1e4, "damping": 100.0}})
    end = em.World(scene).simulate(scene.pack(), steps=60, record=[60]).states[0]
    return -scene.unpack(end)["joints"]["leads"]["position"]


@pytest.mark.parametrize("factor", [1.0, -1.0, 2.0])
def test_a_pair_shares_the_torque_limit_of_the_joint_that_is_followed(tmp_path, factor):
    """Its drive carries both: a load on the follower counts by the multiplier."""
    load = 9.81 * abs(1.0 + factor)
    if load:
        assert lift(tmp_path, factor, 0.9 * load, of_follower=1e3) > 0.02
    assert abs(lift(tmp_path, factor, 1.1 * load + 1.0, of_follower=0.1)) < 0.005


def test_the_torque_limit_of_a_pair_is_raised_at_the_joint_that_is_followed(tmp_path):
    text = chain(
        joint("leads", "a", "b", limit='lower="-1" upper="1" effort="20"'),
        joint("follows", "a", "c", follower("leads", 1.0, 0.0), at="-0.3 0 0"),
        links="abc",
    )
    of_both = built(tmp_path, text, joints={"leads": {"torque_limit": 40.0}}).joints
    assert [j.torque_limit for j in of_both] == [40.0, math.inf]
    with pytest.raises(ValueError, match=r"'torque_limit', expected limits$"):
        built(tmp_path, text, joints={"follows": {"torque_limit": 40.0}})


FINGER = 'lower="0" upper="0.1" effort="0"'


def finger(tmp_path, inside="", **options):
    text = chain(joint("j", "a", "b", inside, kind="prismatic", limit=FINGER), links="ab")
    return built(tmp_path, text, **options)


def test_an_effort_of_zero_is_refused_where_a_drive_would_never_move(tmp_path):
    closing = {"target": 0.05, "stiffness": 500.0, "damping": 20.0}
    with pytest.raises(ValueError, match=r"'j' has effort=\"0\".*'torque_limit': 10"):
        finger(tmp_path, joints={"j": closing})
    scene = finger(tmp_path, joints={"j": {**closing, "torque_limit": math.inf}})
    end = em.World(scene).simulate(scene.pack(), steps=240, record=[240]).states[-1]
    sag = 9.81 / 500.0  # it stands upright, and has 1 kg
    assert scene.unpack(end)["joints"]["j"]["position"] == pytest.approx(0.05 - sag, abs=1e-3)


def test_an_effort_of_zero_lets_damping_resist(tmp_path):
    scene = finger(tmp_path, '<dynamics damping="3"/>')
    (only,) = scene.joints
    assert (only.damping, only.torque_limit) == (3.0, math.inf)


def test_joints_that_follow_none_when_mimic_is_ignored_are_named_unless_they_are_driven(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("energymargin.base.plausibility._known", set())
    text = chain(joint("ab", "a", "b"), joint("bc", "b", "c", follower("ab", 1, 0)), links="abc")
    options = {"ignore": ("joint/mimic",)}
    with pytest.warns(em.PlausibilityWarning, match="without 'joint/mimic' nothing drives .* bc"):
        built(tmp_path, text, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        built(tmp_path, text, joints={"bc": {"stiffness": 5.0}}, **options)
