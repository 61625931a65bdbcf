"""Warnings of links whose inertia, centre of mass or place contradicts their collision shapes."""

import warnings

import numpy as np
import pytest
import urdf_files
from urdf_files import body, built, chain, joint, link

import energymargin as em

LENGTH, WIDTH, MASS = 0.4, 0.04, 1.0  # of a bar along x, 0.2 m in front of its link's origin
ALONG, ACROSS = MASS / 12 * 2 * WIDTH**2, MASS / 12 * (LENGTH**2 + WIDTH**2)
SHAPE = f"""<collision><origin xyz="0.2 0 0"/>
  <geometry><box size="{LENGTH} {WIDTH} {WIDTH}"/></geometry></collision>"""


def inertial(xx=ALONG, yy=ACROSS, zz=ACROSS, at="0.2 0 0", rpy="0 0 0"):
    return f"""<inertial><origin xyz="{at}" rpy="{rpy}"/><mass value="{MASS}"/>
      <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>"""


def bar(tmp_path, inside, **options):
    text = f'<robot name="r">{link("bar", inside + SHAPE)}</robot>'
    return built(tmp_path, text, base="free", **options)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (inertial(1, 1, 1), r"more inertia .*placeholder\? 'bar' \(radius of gyration 1\.22 m"),
        (inertial(*(1e6 * np.array([ALONG, ACROSS, ACROSS]))), "wrong units.*'bar'"),
        (inertial(*(1e-6 * np.array([ALONG, ACROSS, ACROSS]))), "a mesh in millimetres.*'bar'"),
        (inertial(ACROSS, ACROSS, ALONG), "about other axes: is the rpy.*'bar'"),
        (inertial(rpy="0 0 1.5708"), "about other axes: is the rpy.*'bar'"),
        (
            inertial(ALONG, ACROSS + MASS * 0.2**2, ACROSS + MASS * 0.2**2),
            "about the link's origin, expected about the centre of mass.*'bar'",
        ),
        (
            inertial(at="1.2 0 0"),
            r"centre of mass far outside.*'bar' \(0\.8 m away from shapes of 0\.4",
        ),
    ],
)
def test_what_contradicts_the_shapes_is_a_warning_that_names_link_and_value(
    tmp_path, inside, message
):
    with pytest.warns(em.PlausibilityWarning, match=message) as caught:
        scene = bar(tmp_path, inside)
    assert len(caught) == 1 and caught[0].filename == urdf_files.__file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = bar(tmp_path, inside, inertia="shapes")
    assert scene.bodies[0].inertial is None


def test_nothing_that_is_warned_of_is_repaired(tmp_path):
    with pytest.warns(em.PlausibilityWarning):
        (made,) = bar(tmp_path, inertial(1, 1, 1, at="1.2 0 0")).bodies
    assert made.inertial.moments == pytest.approx([1, 1, 1])
    assert made.inertial.center == pytest.approx([1.2, 0, 0])


@pytest.mark.parametrize(
    "inside",
    [
        inertial(),
        inertial(2 * ALONG, 2 * ACROSS, 2 * ACROSS),  # with what the shapes leave out
        inertial(0.5 * ALONG, 0.5 * ACROSS, 0.5 * ACROSS),
        inertial(ACROSS, ACROSS, ALONG, rpy="0 1.5707963 0"),
        inertial(at="0.35 0.1 0"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_may_be_meant_is_no_warning(tmp_path, inside):
    assert len(bar(tmp_path, inside).bodies) == 1


@pytest.mark.filterwarnings("error")
def test_a_fixed_root_has_no_inertia_that_could_be_wrong(tmp_path):
    text = f'<robot name="r">{link("bar", inertial(1, 1, 1) + SHAPE)}</robot>'
    assert built(tmp_path, text).bodies[0].fixed


def test_links_of_one_kind_are_one_warning(tmp_path):
    links = "".join(link(name, inertial(1, 1, 1) + SHAPE) for name in "abcdef")
    joints = "".join(
        joint(a + b, a, b, at="0.5 0 0") for a, b in zip("abcde", "bcdef", strict=True)
    )
    text = f'<robot name="r">{links}{joints}</robot>'
    with pytest.warns(em.PlausibilityWarning) as caught:
        built(tmp_path, text)
    (warning,) = caught
    assert "robot.urdf has links with more inertia" in str(warning.message)
    assert "'f' (radius of gyration 1.22 m, shapes within 0.202 m). inertia='shapes'" in str(
        warning.message
    )


def test_a_joint_that_is_far_away_is_a_warning_that_names_it(tmp_path):
    text = chain(joint("ab", "a", "b", at="12 0 0"), links="ab")
    message = r"robot\.urdf has links with shapes far from .*'b' \(11\.9 m from 'a' by joint 'ab'\)"
    with pytest.warns(em.PlausibilityWarning, match=message):
        scene = built(tmp_path, text)
    assert body(scene, "b").position == pytest.approx([12, 0, 0])
