"""What a URDF file or an argument may not be, and the error that names it."""

import math

import numpy as np
import pytest
from urdf_files import (
    ARM,
    body,
    built,
    link,
    names,
)

import energymargin as em
from energymargin.scenes import NotSimulatedError, from_urdf

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
        ("robot", "<loop_joint/>", "loop_joint"),
        ("joint", "<compliance/>", "compliance"),
        ("link", '<contact><adhesion value="0.1"/></contact>', "adhesion"),
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
    text = ARM.replace('damping="0.3"', 'damping="0.3" spring="0.2"').replace(
        "</robot>", "<loop/><loop/></robot>"
    )
    message = r"dynamics\.spring \(1\), loop \(2\); ignore=\('dynamics\.spring', 'loop'\)"
    with pytest.raises(ValueError, match=message):
        built(tmp_path, text)
    assert built(tmp_path, text, ignore=("dynamics.spring", "loop")).joints[0].damping == 0.3


def test_an_error_names_all_that_is_wrong_before_a_mesh_is_read(tmp_path):
    (tmp_path / "bad.stl").write_text("no mesh")
    text = ARM.replace('<box size="0.1 0.1 0.1"/>', '<mesh filename="bad.stl"/>')
    text = text.replace('izz="0.0003"', 'izz="0.1"').replace("</robot>", "<loop/></robot>")
    text = text.replace('<cylinder radius="0.02" length="0.4"/>', '<mesh filename="none.stl"/>')
    with pytest.raises(NotSimulatedError) as error:
        built(
            tmp_path, text.replace('lower="-1"', 'lower="2"'), role="none", roles={"hand": "object"}
        )
    lines = str(error.value).splitlines()
    assert error.value.features == {"loop": 1}
    for expected in (
        "roles has 'hand', expected one of base, arm",
        "joint 'shoulder' is revolute and has limits from 2.0 to 2.0",
        "link 'arm': inertia is",
    ):
        assert sum(line.startswith(expected) for line in lines) == 1
    assert sum("none.stl'" in line for line in lines) == 1


@pytest.mark.parametrize(
    ("where", "element", "name"),
    [
        ("robot", "<transmission><joint/></transmission>", "transmission"),
        ("robot", "<gazebo/>", "gazebo"),
        ("joint", '<safety_controller k_velocity="1"/>', "safety_controller"),
        ("joint", '<joint_properties friction="0"/>', "joint_properties"),
        ("link", "<self_collision_checking/>", "self_collision_checking"),
        ("link", '<origin xyz="0 0 9"/>', "link/origin"),
        ("link", "<contact><friction_anchor/></contact>", "friction_anchor"),
    ],
)
def test_what_moves_nothing_is_left_out_with_a_line(tmp_path, where, element, name):
    at = ARM.rindex(f"</{where}>")
    text = ARM[:at] + element + ARM[at:]
    words = rf"left out, .*: {name} \(1\); ignore="
    with pytest.warns(em.PlausibilityWarning, match=words) as told:
        scene = built(tmp_path, text)
    assert len(told) == 1
    assert scene.report.names("left out") == [name]
    assert names(scene) == names(built(tmp_path))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("link/axis", '<link name="base">', '<link name="base"><axis xyz="0 0 9"/>'),
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
    assert "does not declare" in str(warning.message) and warning.filename == __file__
    assert "link.xsi:kind (1), sensor:camera (1); ignore=(" in str(warning.message)
    assert names(scene) == names(built(tmp_path))


@pytest.mark.filterwarnings("error")
def test_an_undeclared_namespace_that_is_ignored_is_no_warning(tmp_path):
    scene = built(tmp_path, FOREIGN, ignore=("link.xsi:kind", "sensor:camera"))
    assert names(scene) == names(built(tmp_path))


def test_a_declared_namespace_is_refused_by_a_name_that_can_be_ignored(tmp_path):
    text = ARM.replace("</robot>", '<a:b xmlns:a="http://a"/></robot>')
    with pytest.raises(ValueError, match=r"ignore=\('a:b',\)"):
        built(tmp_path, text)
    assert names(built(tmp_path, text, ignore=("a:b",))) == names(built(tmp_path))


@pytest.mark.parametrize("namespace", ["", ' xmlns:xacro="http://www.ros.org/wiki/xacro"'])
def test_xacro_is_refused_whether_or_not_its_namespace_is_declared(tmp_path, namespace):
    text = f'<robot name="r"{namespace}>{link("a")}<xacro:hand name="b"/></robot>'
    with pytest.raises(ValueError, match="<xacro:hand> is of xacro: expected a URDF file"):
        built(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ('size="0.1 0.1 0.1"', 'size="${size} 0.1 0.1"', "link 'base': <box size="),
        ('name="shoulder"', 'name="${prefix}shoulder"', "<joint name="),
        ('<box size="0.1 0.1 0.1"/>', '<mesh filename="$(find arm)/arm.stl"/>', "<mesh filename="),
    ],
)
def test_an_expression_of_xacro_is_refused_by_its_place(tmp_path, old, new, place):
    with pytest.raises(ValueError, match=rf"{place}'\$.* expression of xacro: expected a URDF"):
        built(tmp_path, ARM.replace(old, new, 1))


@pytest.mark.parametrize("element", ["a", "link", "visual"])
def test_elements_that_are_nested_without_end_are_refused(tmp_path, element):
    deep = f"<{element}>" * 200_000 + f"</{element}>" * 200_000
    with pytest.raises(ValueError, match="nested deeper than 100 in line 1"):
        built(tmp_path, f'<robot name="r">{deep}</robot>')
