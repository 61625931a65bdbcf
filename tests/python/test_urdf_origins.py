"""Warnings of origins in a URDF file: in other units, or beside what is seen."""

import pytest
from urdf_files import ARM, BOX, DATA, INERTIAL, body, built, link

import energymargin as em

SEEN = """<visual><origin {origin}/><geometry><box size="0.1  0.1 0.1"/></geometry></visual>"""


def seen(origin, collision=BOX):
    return f'<robot name="r">{link("a", INERTIAL + SEEN.format(origin=origin) + collision)}</robot>'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'rpy="0 0 1.5707963267948966"',
            'rpy="0 0 90"',
            r"robot\.urdf: joint 'shoulder': rpy is \(0, 0, 90\) rad, beyond .*: .*degrees\?",
        ),
        ('rpy="0 1.5707963267948966 0"', 'rpy="0 90 0"', "link 'arm', inertial: rpy is"),
        (
            '<collision><origin xyz="0.2 0 0"',
            '<collision><origin xyz="200 0 0"',
            r"link 'arm', collision: xyz is \(200, 0, 0\) m: .*millimetres\?",
        ),
        ('xyz="0 0 0.05"', 'xyz="0 0 50"', r"joint 'shoulder': xyz is \(0, 0, 50\) m"),
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


@pytest.mark.parametrize("origin", ['xyz="0 0 0.1"', 'rpy="0 0 0.7"', 'xyz="0 0 0.1" rpy="1 0 0"'])
def test_a_collision_shape_beside_the_same_shape_that_is_seen_is_a_warning(tmp_path, origin):
    message = r"link 'a', collision: origin is xyz \(0, 0, 0\) rpy \(0, 0, 0\), and the same"
    with pytest.warns(em.PlausibilityWarning, match=message):
        scene = built(tmp_path, seen(origin))
    assert scene.bodies[0].shape.size == pytest.approx([0.1, 0.1, 0.1])  # where the file has it


MESHES = f"""<robot name="r">{link("a", INERTIAL)}</robot>""".replace(
    "</link>",
    """<visual><geometry><mesh filename="a.stl" scale="0.001 0.001 0.001"/></geometry></visual>
    <collision><geometry><mesh filename="a.stl"/></geometry></collision></link>""",
)


def test_a_collision_mesh_of_another_scale_than_the_one_that_is_seen_is_a_warning(tmp_path):
    message = r"link 'a', collision: scale is 1, and that of the same mesh in <visual> 0\.001"
    with (
        pytest.warns(em.PlausibilityWarning, match=message),
        pytest.raises(FileNotFoundError),
    ):
        built(tmp_path, MESHES)


@pytest.mark.parametrize(
    "text",
    [
        seen('xyz="0 0 0.0005"'),  # rounded
        seen('xyz="0 0 0" rpy="0 0 6.2831853"'),
        seen('xyz="0 0 0.1"', BOX.replace("<geometry>", '<origin xyz="0 0 0.1"/><geometry>')),
        seen('xyz="0 0 0.1"', BOX.replace('size="0.1', 'size="0.2')),  # another shape
        seen('xyz="nonsense"'),  # how things look is not read
        seen('xyz="0 0 0.1"', SEEN.format(origin="") + BOX),  # two of which one is there
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_may_be_meant_is_no_warning(tmp_path, text):
    assert len(built(tmp_path, text).bodies) == 1


def test_a_mesh_in_millimetres_is_a_warning_that_names_its_file(tmp_path):
    cube = f'<mesh filename="{DATA / "cube.obj"}" scale="100 100 100"/>'  # 1 m long, in cm
    text = f'<robot name="r">{link("a", INERTIAL + BOX)}</robot>'.replace(
        '<box size="0.1 0.1 0.1"/>', cube
    )
    with pytest.warns(em.PlausibilityWarning, match=r"cube\.obj 100 m long: .* millimetres"):
        built(tmp_path, text, decompose=False)
