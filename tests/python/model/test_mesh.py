"""Mesh files as convex parts with the mass properties of the mesh."""

import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pybullet_data
import pytest
import trimesh
from mesh_files import angle, bars, has_inside, volume, written

import energymargin as em
from energymargin.model.meshes import convex, mesh
from energymargin.model.meshes.convex import cache_folder, corners

DATA = Path(pybullet_data.getDataPath())

pytestmark = pytest.mark.usefixtures("mesh_cache")


@pytest.mark.parametrize("suffix", ["stl", "obj", "dae", "STL"])
def test_a_box_from_each_format_is_one_part_with_the_mass_properties_of_a_box(tmp_path, suffix):
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.apply_translation((1.0, 2.0, 3.0))
    box.export(tmp_path / f"box.{suffix}", file_type=suffix.lower())
    compound = mesh(tmp_path / f"box.{suffix}")
    (part,) = compound.parts
    assert len(part.shape.points) == 8
    expected = em.mass_properties(em.Box((0.1, 0.2, 0.3)))
    assert compound.solid.volume == pytest.approx(expected.volume)
    assert compound.solid.center == pytest.approx([1.0, 2.0, 3.0])
    assert sorted(compound.solid.moments) == pytest.approx(sorted(expected.moments), rel=1e-5)


def test_an_angle_is_taken_apart_so_that_its_inside_corner_is_empty(tmp_path):
    parts = mesh(angle(tmp_path)).parts
    assert len(parts) >= 2
    assert not any(has_inside(part, np.array([0.08, 0.08, 0.02])) for part in parts)
    for inside in ((0.15, 0.025, 0.02), (0.025, 0.15, 0.02), (0.02, 0.02, 0.02)):
        assert any(has_inside(part, np.array(inside)) for part in parts)


def test_the_mass_properties_are_those_of_the_mesh_and_not_of_its_parts(tmp_path):
    solid = mesh(angle(tmp_path)).solid
    first, second = 0.2 * 0.05, 0.15 * 0.05  # areas of the bars
    along = (first * 0.1 + second * 0.025) / (first + second)
    across = (first * 0.025 + second * 0.125) / (first + second)
    assert solid.volume == pytest.approx((first + second) * 0.04)
    assert solid.center == pytest.approx([along, across, 0.02])
    hull = mesh(angle(tmp_path), decompose=False)
    assert hull.solid.moments == pytest.approx(solid.moments)


def test_without_decomposition_the_hull_of_it_all_is_the_one_part(tmp_path):
    (part,) = mesh(angle(tmp_path), decompose=False).parts
    assert has_inside(part, np.array([0.08, 0.08, 0.02]))


def test_a_ball_falls_through_a_ring_but_not_through_its_hull(tmp_path):
    ring = written(tmp_path, trimesh.creation.annulus(0.03, 0.05, 0.02, sections=12))
    for decompose, falls in ((True, True), (False, False)):
        scene = em.Scene()
        scene.add_body("ring", mesh(ring, decompose=decompose), mass=0)
        scene.add_body("ball", em.Sphere(0.02), mass=0.1, position=(0, 0, 0.05), role="object")
        state = em.World(scene).rollout(scene.pack(), np.zeros(6), 0.5).state
        assert (scene.unpack(state)["ball"]["position"][2] < -0.1) == falls


@pytest.mark.parametrize(
    ("file", "most", "size"),
    [
        ("franka_panda/meshes/collision/finger.obj", 1, (0.0210, 0.0265, 0.0537)),
        ("duck_vhacd.obj", 5, (1.6547, 1.5471, 1.1605)),  # five convex objects
        ("racecar/meshes/cone.dae", 4, (0.15, 0.15, 0.17)),  # in inches
        ("gripper/meshes/WSG50_110.stl", 6, (0.146, 0.05, 0.0725)),
    ],
)
def test_files_of_others_become_few_parts_in_metres(file, most, size):
    compound = mesh(DATA / file)
    points = np.concatenate([part.shape.points for part in compound.parts])
    assert len(compound.parts) <= most
    assert np.ptp(points, axis=0) == pytest.approx(size, rel=0.02)
    assert compound.solid.volume == pytest.approx(volume(compound), rel=0.06)


def test_a_scale_is_one_number_or_one_for_each_axis_and_may_mirror(tmp_path):
    file = angle(tmp_path)
    plain, double = mesh(file).solid, mesh(file, scale=2.0).solid
    assert double.volume == pytest.approx(8.0 * plain.volume)
    assert double.moments == pytest.approx(4.0 * plain.moments)
    mirrored = mesh(file, scale=(-1.0, 1.0, 3.0)).solid
    assert mirrored.volume == pytest.approx(3.0 * plain.volume)
    assert mirrored.center == pytest.approx(plain.center * [-1.0, 1.0, 3.0])


def test_a_surface_that_faces_inwards_bounds_the_same_solid(tmp_path):
    turned = bars()
    turned.invert()
    solid = mesh(written(tmp_path, turned)).solid
    assert solid.volume == pytest.approx(mesh(angle(tmp_path)).solid.volume)


def test_a_surface_in_several_groups_is_one_surface(tmp_path):
    lines = (written(tmp_path, trimesh.creation.box(), "box.obj")).read_text().splitlines()
    faces = [i for i, line in enumerate(lines) if line.startswith("f ")]
    (tmp_path / "box.obj").write_text(
        "\n".join(
            [*lines[: faces[0]], "g a", *lines[faces[0] : faces[6]], "g b", *lines[faces[6] :]]
        )
    )
    assert mesh(tmp_path / "box.obj").solid.volume == pytest.approx(1.0)


def test_objects_that_touch_are_solids_of_their_own():
    assert mesh(DATA / "objects/mug_col.obj").solid.volume == pytest.approx(5.30e-4, rel=1e-3)


def test_a_hole_of_one_triangle_is_filled(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.update_faces(np.arange(len(box.faces)) > 0)
    assert mesh(written(tmp_path, box)).solid.volume == pytest.approx(1e-3)


def test_an_open_mesh_has_the_mass_properties_of_its_parts(tmp_path):
    tube = trimesh.creation.cylinder(0.05, 0.1, sections=8)
    tube.update_faces(tube.face_normals[:, 2] < 0.5)
    compound = mesh(written(tmp_path, tube), threshold=1.0)
    assert compound.solid is None
    assert volume(compound) == pytest.approx(0.05**2 * 4 * 2**0.5 / 2 * 0.1, rel=0.1)


def test_a_ball_of_many_points_becomes_one_of_few_that_is_as_round(tmp_path):
    ball = written(tmp_path, trimesh.creation.icosphere(4, radius=0.1))
    (part,) = mesh(ball).parts
    assert len(part.shape.points) == 128
    center, reach = np.zeros(3), trimesh.convex.convex_hull(part.shape.points).triangles_center
    assert np.linalg.norm(reach - center, axis=1).min() > 0.096
    assert len(corners(trimesh.creation.icosphere(4).vertices, 40)) == 40


def test_parts_are_cached_so_that_a_mesh_is_taken_apart_once(tmp_path, monkeypatch):
    file = angle(tmp_path)
    first = mesh(file)
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("decomposed again"))
    for again, was in zip(mesh(file).parts, first.parts, strict=True):
        assert np.array_equal(again.shape.points, was.shape.points)


def test_the_same_mesh_gives_the_same_parts_wherever_they_are_cached(tmp_path, monkeypatch):
    first = mesh(angle(tmp_path), threshold=0.2)
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "other"))
    for again, was in zip(mesh(angle(tmp_path), threshold=0.2).parts, first.parts, strict=True):
        assert np.array_equal(again.shape.points, was.shape.points)


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda _: b"", lambda _: b"no zip"])
def test_a_damaged_file_of_parts_is_written_anew(tmp_path, monkeypatch, damage):
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "own"))
    first = mesh(angle(tmp_path))
    (file,) = (tmp_path / "own" / "convex").iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    assert len(mesh(angle(tmp_path)).parts) == len(first.parts)
    assert len(file.read_bytes()) == len(whole)


def test_a_cache_that_cannot_be_written_to_is_a_warning(tmp_path, monkeypatch, caplog):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "file"))
    assert len(mesh(angle(tmp_path)).parts) >= 2
    assert "not cached" in caplog.text


def test_parts_are_cached_in_the_users_cache_folder(monkeypatch):
    monkeypatch.delenv("ENERGYMARGIN_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache_folder() == Path("/somewhere/energymargin")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "energymargin"


def test_a_decomposition_is_logged_once_and_nowhere_else(tmp_path, monkeypatch, caplog, capfd):
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path))
    with caplog.at_level(logging.WARNING, logger="energymargin"):
        for _ in range(2):
            mesh(angle(tmp_path), threshold=0.3)
    assert [r.levelname for r in caplog.records] == ["WARNING"]
    assert "triangles into convex parts, once" in caplog.text and "angle.stl" in caplog.text
    assert capfd.readouterr().out == ""


def test_a_failure_of_the_decomposition_names_the_file_and_the_way_out(tmp_path, monkeypatch):
    monkeypatch.setitem(convex.SEARCH, "no_such_setting", 1)
    with pytest.raises(RuntimeError, match=r"angle\.stl.*no_such_setting.*decompose=False"):
        mesh(angle(tmp_path))


def spoiled(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    return tmp_path / name


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("mesh.ply", "", r"path is .*mesh\.ply', expected a file that ends in \.stl"),
        ("text.stl", "solid of words\nendsolid\n", r"text\.stl"),
        ("text.dae", "no collada", r"text\.dae is no DAE mesh"),
        ("points.obj", TRIANGLE, r"points\.obj has no faces"),
        ("sheet.obj", TRIANGLE + "v 1 1 0\nf 1 2 3\nf 2 4 3\n", r"sheet\.obj is flat"),
        ("nan.obj", TRIANGLE + "v 0 0 nan\nf 1 2 3\nf 1 2 4\n", r"nan\.obj has a vertex"),
        ("empty.stl", "", r"empty\.stl"),
    ],
)
def test_a_file_that_is_no_solid_is_refused_by_name(tmp_path, name, text, message):
    with pytest.raises(ValueError, match=message):
        mesh(spoiled(tmp_path, name, text))


@pytest.mark.parametrize(
    "argument",
    [
        {"scale": 0.0},
        {"scale": (1.0, 2.0)},
        {"scale": float("nan")},
        {"scale": "big"},
        {"threshold": 0.0},
        {"threshold": float("nan")},
        {"max_points": 3},
        {"seed": -1},
    ],
)
def test_a_bad_argument_is_refused_by_name(tmp_path, argument):
    with pytest.raises(ValueError, match=f"{next(iter(argument))} is "):
        mesh(angle(tmp_path), **argument)


def test_a_missing_file_is_an_error_that_says_so():
    with pytest.raises(FileNotFoundError, match=r"path is 'none\.stl'"):
        mesh("none.stl")


def test_without_the_extra_the_error_says_what_to_install(tmp_path, monkeypatch):
    file = angle(tmp_path)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[urdf\]"):
        mesh(file)


def test_a_package_that_is_there_and_broken_is_told_with_its_own_words(tmp_path, monkeypatch):
    file = angle(tmp_path)
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "trimesh.py").write_text('raise ImportError("its core is missing")\n')
    monkeypatch.delitem(sys.modules, "trimesh", raising=False)
    monkeypatch.syspath_prepend(broken)
    with pytest.raises(ImportError, match=r"is there and does not load: its core is missing"):
        mesh(file)


# Cavities


def disc(count):
    return [(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, count, endpoint=False)]


def test_a_prism_whose_caps_have_many_corners_is_read(tmp_path):
    count = 600
    points = [f"v {x} {y} {z}" for z in (0, 1) for x, y in disc(count)]
    sides = [
        f"f {i + 1} {(i + 1) % count + 1} {(i + 1) % count + 1 + count} {i + 1 + count}"
        for i in range(count)
    ]
    low = "f " + " ".join(str(i) for i in range(count, 0, -1))
    high = "f " + " ".join(str(i) for i in range(count + 1, 2 * count + 1))
    path = spoiled(tmp_path, "prism.obj", "\n".join([*points, *sides, low, high]))
    assert mesh(path).solid.volume == pytest.approx(np.pi, rel=1e-3)
