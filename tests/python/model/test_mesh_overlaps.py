"""Surfaces of one mesh file that overlap, contain or repeat each other, or face both ways."""

import re

import numpy as np
import pytest
import trimesh
from mesh_files import bars, objects, written

import energymargin as em
from energymargin import scenes
from energymargin.meshes import mesh

pytestmark = pytest.mark.usefixtures("mesh_cache")


def box(size, at=(0.0, 0.0, 0.0), *, inwards=False):
    made = trimesh.creation.box(np.broadcast_to(size, 3))
    made.apply_translation(at)
    if inwards:
        made.invert()
    return made


def two_sided(surface):
    faces = np.vstack([surface.faces, surface.faces[:, ::-1] + len(surface.vertices)])
    return trimesh.Trimesh(np.vstack([surface.vertices] * 2), faces, process=False)


def wound_both_ways(surface):
    faces = surface.faces.copy()
    faces[::2] = faces[::2, ::-1]
    return trimesh.Trimesh(surface.vertices, faces, process=False)


def back_to_back(*corners):
    """Two triangles that enclose nothing."""
    return trimesh.Trimesh(corners, [[0, 1, 2], [2, 1, 0]], process=False)


HOLLOW = (box(0.1), box(0.06, inwards=True))
SHELL = 0.1**3 - 0.06**3
# By what they are: surfaces, the volume of their union, and what a warning says.
UNIONS = {
    "overlapping": ([box(0.1), box(0.1, (0.03, 0.02, 0.01))], 2e-3 - 0.07 * 0.08 * 0.09, None),
    "in a row": ([box(0.1, (0.05 * k, 0, 0)) for k in range(5)], 0.3 * 0.1**2, None),
    "contained": ([box(0.1), box(0.06)], 1e-3, "1 closed surfaces within bodies"),
    "contained, all inwards": (
        [box(0.1, inwards=True), box(0.06, inwards=True)],
        1e-3,
        "1 closed surfaces within bodies",
    ),
    "twice": ([box(0.1), box(0.1)], 1e-3, None),
    "nearly twice": ([box(0.1), box(0.1, (1e-5, 0, 0))], 1e-3 + 1e-7, None),
    "hollow": (HOLLOW, SHELL, None),
    "hollow twice": ([*HOLLOW, *HOLLOW], SHELL, None),
    "a body in a cavity": ([*HOLLOW, box(0.02)], SHELL + 0.02**3, None),
    "a body beside a cavity": ([*HOLLOW, box(0.1, (0.09, 0, 0))], SHELL + 0.09 * 0.1**2, None),
    "a rod into a cavity": (
        [*HOLLOW, box((0.06, 0.02, 0.02), (0.05, 0, 0))],
        SHELL + 0.04 * 0.02**2,
        None,
    ),
    "with two triangles back to back": (
        [box(0.1), back_to_back((0, 0, 0), (0.01, 0, 0), (0, 0.02, 0.01))],
        1e-3,
        None,
    ),
    "with two of them at a corner": (
        [box(0.1), back_to_back((0.05, 0.05, 0.05), (0.01, 0, 0), (0, 0.02, 0.01))],
        1e-3,
        None,
    ),
    "hollow, with two triangles": (
        [*HOLLOW, back_to_back((0.04, 0.04, 0.04), (0.041, 0.04, 0.04), (0.04, 0.041, 0.04))],
        SHELL,
        None,
    ),
    "touching at a wall": ([box(0.1), box(0.1, (0.1, 0, 0))], 2e-3, None),
    "touching at an edge": ([box(0.1), box(0.1, (0.1, 0.1, 0))], 2e-3, None),
    "touching at a corner": ([box(0.1), box(0.1, (0.1, 0.1, 0.1))], 2e-3, None),
    "two-sided": ([two_sided(bars())], 0.0175 * 0.04, "there twice or face both ways"),
    "wound both ways": ([wound_both_ways(bars())], 0.0175 * 0.04, "there twice or face both ways"),
    "two-sided beside another": (
        [two_sided(box(0.1)), box(0.05, (0.3, 0, 0))],
        1e-3 + 0.05**3,
        "there twice or face both ways",
    ),
    "wound both ways, overlapping": (
        [wound_both_ways(box(0.1)), wound_both_ways(box(0.1, (0.05, 0, 0)))],
        1.5e-3,
        "there twice or face both ways",
    ),
}


def read(path, message, **options):
    if message is None:
        return mesh(path, **options)
    with pytest.warns(em.PlausibilityWarning, match=message):
        return mesh(path, **options)


@pytest.mark.parametrize("name", UNIONS)
@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_what_lies_in_several_surfaces_of_a_file_counts_once(tmp_path, name, suffix):
    surfaces, volume, message = UNIONS[name]
    path = tmp_path / f"{re.sub(r'[^a-z]', '_', name)}.{suffix}"
    if suffix == "stl":
        trimesh.util.concatenate(surfaces).export(path)
    else:
        path.write_text(objects(*surfaces))
    solid = read(path, message, decompose=False).solid
    assert solid.volume == pytest.approx(volume, rel=1e-6)


def test_centre_and_inertia_of_overlapping_boxes_are_those_of_their_union(tmp_path):
    at = [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.06, 0.0)]
    path = written(tmp_path, trimesh.util.concatenate([box(0.02, place) for place in at]))
    solid = mesh(path).solid
    assert solid.volume == pytest.approx(2e-5, rel=1e-6)
    assert solid.center == pytest.approx([0.003, 0.024, 0.0], abs=1e-8)
    long = em.mass_properties(em.Box((0.03, 0.02, 0.02)), 0.6).moments
    cube = em.mass_properties(em.Box((0.02, 0.02, 0.02)), 0.4).moments
    about_z = max(long) + max(cube) + 0.6 * (0.002**2 + 0.024**2) + 0.4 * (0.003**2 + 0.036**2)
    assert max(solid.moments) == pytest.approx(about_z, rel=1e-6)


def test_a_body_of_density_and_a_link_of_shapes_weigh_what_the_union_does(tmp_path):
    path = written(tmp_path, trimesh.util.concatenate([box(0.1), box(0.1, (0.05, 0, 0))]))
    assert em.grasps.GraspObject.load(path, density=1000.0).mass == pytest.approx(1.5, rel=1e-6)
    (tmp_path / "one.urdf").write_text(
        '<robot name="r"><link name="a"><inertial><mass value="1"/></inertial><collision><geometry>'
        f'<mesh filename="{path.name}"/></geometry></collision></link></robot>'
    )
    scene = scenes.from_urdf(tmp_path / "one.urdf", base="free", inertia="shapes")
    body = em.mass_properties(scene.bodies[0].shape, 1.0)
    assert body.center == pytest.approx([0.025, 0, 0], abs=1e-8)
    assert max(body.moments) == pytest.approx((0.1**2 + 0.15**2) / 12, rel=1e-6)


def test_an_open_mesh_says_that_its_mass_properties_are_those_of_its_parts(tmp_path):
    tube = trimesh.creation.cylinder(0.05, 0.1, sections=24)
    tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    assert read(written(tmp_path, tube), "not closed", decompose=False).solid is None


def test_a_two_sided_surface_within_another_is_refused(tmp_path):
    path = written(tmp_path, trimesh.util.concatenate([two_sided(box(0.1)), two_sided(box(0.06))]))
    with pytest.raises(ValueError, match="within another, which may bound a cavity or not"):
        mesh(path)
