"""Files of formats that are not read, and what moves nothing in those that are."""

import numpy as np
import pytest
import trimesh
from mesh_files import written

import energymargin as em
from energymargin import grasps, scenes
from energymargin.meshes import mesh

MOVEIT = "- id: a\n  grasp_pose: {pose: {position: {x: 0, y: 0, z: 0.1}}}\n"


@pytest.mark.parametrize(
    ("name", "content", "read", "message"),
    [
        ("r.usd", b"PXR-USDC", scenes.from_urdf, r"is USD, which is not read: expected URDF .* or"),
        ("r.usda", b"#usda 1.0", scenes.from_mjcf, "is USD, which is not read: expected URDF"),
        ("r.sdf", b"<sdf/>", scenes.from_urdf, "is SDF, expected URDF or MJCF: "),
        ("r.xacro", b"<robot/>", scenes.from_urdf, "`xacro FILE -o robot.urdf` makes URDF"),
        ("r.xml", b"<mujoco/>", scenes.from_urdf, "root is <mujoco>.*from_mjcf reads MJCF"),
        ("m.glb", b"glTF", mesh, r"expected a file that ends in .*\.export\('mesh\.stl'\)"),
        (
            "g.npy",
            b"\x93NUMPY\x01\x00",
            grasps.read,
            r"is a file of numpy, which is not read: em\.",
        ),
        ("g.npz", b"PK\x03\x04", grasps.read, r"is a ZIP file, as numpy's \.npz"),
        ("g.pkl", b"\x80\x04\x95", grasps.read, "is a pickle, which can run code"),
        ("g.parquet", b"PAR1", grasps.read, "is a Parquet file, which is not read"),
        ("g.yaml", MOVEIT.encode(), grasps.read, "is a YAML file of something else, as of MoveIt"),
        ("h.yaml", b"# x\ngrasp_1:\n  pose: 1\n", grasps.read, "is a YAML file of something else"),
    ],
)
def test_a_format_that_is_not_read_is_named_with_a_way_out(tmp_path, name, content, read, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read(tmp_path / name)


def robot(tmp_path, *elements):
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="r">{"".join(elements)}</robot>')
    return path


def link(name, geometry='<box size=".1 .1 .1"/>', more="", mass=""):
    inertia = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><mass value="{mass}"/>{inertia}</inertial>' if mass else ""
    return (
        f'<link name="{name}">{inertial}<collision><geometry>{geometry}</geometry>{more}'
        "</collision></link>"
    )


def joint(name, parent, child, more="", kind="revolute"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="0 0 1"/>{more}</joint>'
    )


LIMIT = '<limit lower="0" upper="1" effort="1" velocity="1"/>'


@pytest.mark.parametrize("mass", ["", "0.01"])
def test_a_flat_mesh_of_a_robot_is_left_out_and_named(tmp_path, mass):
    sheet = trimesh.Trimesh([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0]], [[0, 1, 2]], process=False)
    written(tmp_path, sheet, "flat.stl")
    sticker = link("sticker", '<mesh filename="flat.stl"/>', mass=mass)
    path = robot(tmp_path, link("a"), joint("j", "a", "sticker", kind="fixed"), sticker)
    with pytest.warns(em.PlausibilityWarning, match=r"is flat .*flat mesh flat\.stl of '(a|stick)"):
        scene = scenes.from_urdf(path)
    assert scene.report.names("left out")[0].startswith("flat mesh flat.stl of ")
    assert em.mass_properties(scene.bodies[0].shape).volume == pytest.approx(1e-3)


def test_sdf_of_a_shape_and_equal_dynamics_are_left_out_and_named(tmp_path):
    twice = 2 * '<dynamics damping="1"/>'
    path = robot(
        tmp_path,
        '<link name="a"/>',
        joint("j", "a", "b", LIMIT + twice),
        link("b", more='<sdf resolution="256"/>', mass="1"),
    )
    with pytest.warns(em.PlausibilityWarning, match=r"sdf \(1\), joint/dynamics \(1\)"):
        scene = scenes.from_urdf(path)
    assert scene.joints[0].damping == 1.0


def test_two_dynamics_that_differ_are_refused_with_a_way_out_that_works(tmp_path):
    differ = '<dynamics damping="1"/><dynamics damping="2"/>'
    parts = link("a"), joint("j", "a", "b", LIMIT + differ), link("b", mass="1")
    path = robot(tmp_path, *parts)
    with pytest.raises(ValueError, match=r"2 <dynamics>.*ignore=\('joint/dynamics',\) leaves them"):
        scenes.from_urdf(path)
    assert scenes.from_urdf(path, ignore=("joint/dynamics",)).joints[0].damping == 0.0


@pytest.mark.parametrize(("upper", "held"), [("0.9996", True), ("0.98", False)])
def test_limits_of_a_mimic_joint_that_differ_by_less_than_a_hundredth_are_a_warning(
    tmp_path, upper, held
):
    own = f'<limit lower="0" upper="{upper}" effort="1" velocity="1"/><mimic joint="j"/>'
    parts = link("a"), joint("j", "a", "b", LIMIT), link("b", mass="1")
    path = robot(tmp_path, *parts, joint("k", "a", "c", own), link("c", mass="1"))
    if held:
        with pytest.warns(em.PlausibilityWarning, match="'k' follows 'j' from 0 to 1, and its own"):
            assert len(scenes.from_urdf(path).joints) == 2
    else:
        with pytest.raises(ValueError, match="mimic_limits='leader'"):
            scenes.from_urdf(path)


def test_a_density_gives_links_without_a_mass_that_of_their_shapes(tmp_path):
    parts = link("a"), joint("j", "a", "b", LIMIT), link("b"), joint("k", "b", "c", LIMIT)
    path = robot(tmp_path, *parts, link("c", mass="2"))
    bodies = {body.name: body for body in scenes.from_urdf(path, base="free", density=1e3).bodies}
    assert bodies["a"].mass == bodies["b"].mass == pytest.approx(1.0)
    assert bodies["c"].mass == 2.0
    moments = em.mass_properties(bodies["b"].shape, bodies["b"].mass).moments
    assert moments == pytest.approx([0.1**2 / 6] * 3)
    with pytest.raises(ValueError, match="density is -1, expected"):
        scenes.from_urdf(path, density=-1)


def test_a_density_weighs_meshes_by_their_volume_and_keeps_fixed_links_apart(tmp_path):
    written(tmp_path, trimesh.creation.box((0.1, 0.2, 0.1)), "box.stl")
    parts = link("a"), joint("j", "a", "b", kind="fixed"), link("b", '<mesh filename="box.stl"/>')
    scene = scenes.from_urdf(robot(tmp_path, *parts), base="free", density=500.0)
    assert [body.mass for body in scene.bodies] == pytest.approx([0.5, 1.0])
    assert np.isfinite(scene.pack()).all()
