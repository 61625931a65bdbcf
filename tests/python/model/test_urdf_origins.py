"""Warnings of lengths and angles in a URDF file that look like those of other units."""

import warnings

import pytest
from urdf_files import ARM, BOX, DATA, INERTIAL, body, built, link

import energymargin as em


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'rpy="0 0 1.5707963267948966"',
            'rpy="0 0 90"',
            r"robot\.urdf: joint 'shoulder': rpy is '0 0 90' rad, expected .*: .*degrees\?",
        ),
        ('rpy="0 1.5707963267948966 0"', 'rpy="0 90 0"', "link 'arm', inertial: rpy is"),
        (
            '<collision><origin xyz="0.2 0 0"',
            '<collision><origin xyz="200 0 0"',
            r"link 'arm', collision: xyz is '200 0 0' m, .*millimetres\?",
        ),
        ('xyz="0 0 0.05"', 'xyz="0 0 50"', r"joint 'shoulder': xyz is '0 0 50' m"),
    ],
)
def test_an_origin_in_degrees_or_millimetres_is_a_warning_that_names_its_place(
    tmp_path, old, new, message
):
    with pytest.warns(em.PlausibilityWarning, match=message):
        built(tmp_path, ARM.replace(old, new, 1), self_collision=False)


def test_a_warning_repairs_nothing(tmp_path):
    with pytest.warns(em.PlausibilityWarning):
        scene = built(tmp_path, ARM.replace('xyz="0 0 0.05"', 'xyz="0 0 50"'))
    assert body(scene, "arm").position == pytest.approx([0, 0, 50])


def test_a_mesh_in_millimetres_is_a_warning_that_names_its_file(tmp_path):
    cube = f'<mesh filename="{DATA / "cube.obj"}" scale="100 100 100"/>'  # 1 m long, in cm
    text = f'<robot name="r">{link("a", INERTIAL + BOX)}</robot>'.replace(
        '<box size="0.1 0.1 0.1"/>', cube
    )
    with pytest.warns(em.PlausibilityWarning, match=r"cube\.obj 100 m long: .* millimetres"):
        built(tmp_path, text, decompose=False)


def test_a_half_turn_of_a_robot_is_taken_as_it_is_written(tmp_path):
    with pytest.warns(em.PlausibilityWarning, match=r"orientation is \(1, 0, 0, 0\), a half turn"):
        em.World(built(tmp_path, ARM, orientation=(1, 0, 0, 0)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = built(tmp_path, ARM, orientation=(-1, 0, 0, 0))
        em.World(scene)
    assert scene.bodies[0].orientation.tolist() == [-1, 0, 0, 0]
