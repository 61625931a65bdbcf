"""How far the convex parts of a mesh are from it, and how near they come if asked to."""

import numpy as np
import pytest
import trimesh
from mesh_files import angle, mug, plate, written
from urdf_files import INERTIAL, built, link

import energymargin as em
from energymargin.model.meshes import cuts, mesh, shape
from energymargin.model.meshes.convex import corners

pytestmark = pytest.mark.usefixtures("mesh_cache")


def test_the_hull_of_a_plate_closes_the_whole_hole(tmp_path):
    found = mesh(plate(tmp_path), decompose=False).deviation
    assert found.closed_opening == pytest.approx(0.042, rel=0.01)
    assert found.distance == pytest.approx(0.021, rel=0.01)
    filled = 0.1**2 - np.pi * 0.021**2
    assert found.volume == pytest.approx(0.1**2 / filled, rel=1e-3)


def test_the_hull_of_a_mug_closes_what_a_ball_of_its_inner_width_fits_in(tmp_path):
    found = mesh(mug(tmp_path), decompose=False).deviation
    assert found.closed_opening == pytest.approx(0.07, rel=0.01)


def test_the_hull_of_an_angle_reaches_as_far_as_the_middle_of_its_long_side(tmp_path):
    found = mesh(angle(tmp_path), decompose=False).deviation
    assert found.closed_opening == pytest.approx(2 * 0.075, rel=0.01)
    assert found.volume == pytest.approx((0.2**2 - 0.15**2 / 2) / (0.2**2 - 0.15**2), rel=1e-3)


def test_the_hull_of_a_hollow_box_closes_its_cavity(tmp_path):
    inner = trimesh.creation.box((0.06,) * 3)
    inner.invert()
    hollow = written(tmp_path, trimesh.util.concatenate([trimesh.creation.box((0.1,) * 3), inner]))
    found = mesh(hollow, decompose=False).deviation
    assert found.closed_opening == pytest.approx(0.06, rel=0.01)
    assert found.volume == pytest.approx(0.1**3 / (0.1**3 - 0.06**3), rel=1e-3)


def test_a_box_is_its_part(tmp_path):
    found = mesh(written(tmp_path, trimesh.creation.box())).deviation
    assert (found.distance, found.closed_opening, found.volume) == (0.0, 0.0, 1.0)


def test_a_ball_of_few_corners_falls_short_and_closes_nothing(tmp_path):
    ball = mesh(written(tmp_path, trimesh.creation.icosphere(4, radius=0.1)), max_points=64)
    hull = trimesh.convex.convex_hull(ball.parts[0].shape.points)
    depth = 0.1 - (hull.face_normals * hull.triangles[:, 0]).sum(axis=1).min()
    assert ball.deviation.distance == pytest.approx(depth, rel=0.03)
    assert ball.deviation.closed_opening == pytest.approx(0.0, abs=1e-9)
    assert ball.deviation.volume < 0.97


def test_a_mesh_with_holes_has_no_deviation(tmp_path):
    tube = trimesh.creation.cylinder(0.05, 0.1, sections=8)
    tube.update_faces(tube.face_normals[:, 2] < 0.5)
    file = written(tmp_path, tube)
    assert mesh(file, decompose=False).deviation is None
    with pytest.raises(ValueError, match=r"accuracy is 0\.001, and .*solid\.stl has holes"):
        mesh(file, accuracy=1e-3)


def test_a_prompt_shows_the_figures_and_they_are_cached(tmp_path, monkeypatch):
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "own"))
    first = mesh(angle(tmp_path), decompose=False)
    text = repr(first)
    assert text.startswith("MeshShape(parts=[1 Part]")
    assert "deviation=Deviation(distance=0.075, closed_opening=0.15, volume=1.643)" in text
    monkeypatch.setattr(shape, "deviation", lambda *_: pytest.fail("measured again"))
    assert mesh(angle(tmp_path), decompose=False).deviation == first.deviation


@pytest.mark.parametrize(("accuracy", "falls"), [(None, False), (4e-4, True)])
def test_a_peg_of_41_mm_goes_through_a_hole_of_42_mm_if_accuracy_is_asked_for(
    tmp_path, accuracy, falls
):
    scene = em.Scene()
    scene.add_body("plate", mesh(plate(tmp_path), accuracy=accuracy), mass=0)
    peg = em.Cylinder(0.0205, 0.06)
    scene.add_body("peg", peg, mass=0.1, position=(0, 0, 0.045), role="object")
    state = em.World(scene).rollout(scene.pack(), np.zeros(6), 0.5).state
    assert (scene.unpack(state)["peg"]["position"][2] < -0.1) == falls


def test_parts_are_no_farther_from_the_mesh_than_the_accuracy(tmp_path):
    fine = mesh(plate(tmp_path), accuracy=4e-4)
    assert 0.0 < fine.deviation.distance <= 4e-4
    assert fine.deviation.closed_opening <= 8e-4
    assert len(fine.parts) < 60
    assert mesh(plate(tmp_path)).deviation.distance > 4e-4


def test_an_accuracy_that_needs_more_corners_is_refused_with_a_number_that_suffices(tmp_path):
    ball = written(tmp_path, trimesh.creation.icosphere(3, radius=0.1))
    with pytest.raises(ValueError, match=r"m off; max_points=642 keeps all corners"):
        mesh(ball, accuracy=1e-3, max_points=32)
    assert mesh(ball, accuracy=1e-3, max_points=642).deviation.distance <= 1e-3


def test_an_accuracy_that_needs_too_many_parts_is_refused_with_one_that_does_not(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(cuts, "MOST_PARTS", 12)
    with pytest.raises(ValueError, match=r"more than 12 convex parts; accuracy=") as error:
        mesh(plate(tmp_path), accuracy=1e-4)
    enough = float(str(error.value).split("accuracy=")[1].split()[0])
    assert len(mesh(plate(tmp_path), accuracy=enough).parts) <= 12


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"accuracy": 0.0}, "accuracy is 0.0, expected a positive number"),
        ({"accuracy": 1e-3, "decompose": False}, "accuracy is 0.001, and decompose is False"),
        ({"max_points": 7}, "max_points is 7, expected a number from 8"),
    ],
)
def test_what_cannot_be_is_refused_by_name(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        mesh(angle(tmp_path), **options)


@pytest.mark.parametrize(("most", "best"), [(8, 0.433), (12, 0.605), (24, 0.776)])
def test_a_hull_of_few_corners_has_four_fifths_of_the_volume_that_it_can_have(most, best):
    for axes in ((1.0, 1.0, 1.0), (1.0, 0.02, 0.3)):
        ball = trimesh.creation.icosphere(3)
        ball.apply_transform(np.diag([*axes, 1.0]))
        chosen = corners(ball.vertices, most)
        assert len(chosen) == most
        assert trimesh.convex.convex_hull(chosen).volume > 0.8 * best * ball.volume


def test_recentered_the_frame_is_at_the_centre_of_mass_and_says_where_that_was(tmp_path):
    far = trimesh.creation.box((0.1, 0.2, 0.3))
    far.apply_translation((5.0, -2.0, 1.0))
    file = written(tmp_path, far)
    plain, centred = mesh(file), mesh(file, recenter=True)
    assert np.array_equal(plain.origin, np.zeros(3))
    assert centred.origin == pytest.approx([5.0, -2.0, 1.0])
    assert centred.solid.center == pytest.approx(np.zeros(3), abs=1e-12)
    assert centred.solid.moments == pytest.approx(plain.solid.moments)
    points, moved = plain.parts[0].shape.points, centred.parts[0].shape.points
    assert moved + centred.origin == pytest.approx(points)
    assert centred.deviation == plain.deviation


def test_without_mass_properties_of_its_own_a_mesh_is_recentered_by_its_parts(tmp_path):
    tube = trimesh.creation.cylinder(0.05, 0.1, sections=8)
    tube.update_faces(tube.face_normals[:, 2] < 0.5)
    tube.apply_translation((3.0, 0.0, 0.0))
    found = mesh(written(tmp_path, tube), decompose=False, recenter=True)
    assert found.solid is None
    assert found.origin[0] == pytest.approx(3.0)
    assert em.mass_properties(found).center == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_robots_meshes_have_the_same_options(tmp_path):
    plate(tmp_path)
    shape_of = '<collision><geometry><mesh filename="plate.stl"/></geometry></collision>'
    text = f'<robot name="r">{link("a", INERTIAL + shape_of)}</robot>'
    scene = built(tmp_path, text, accuracy=4e-4, inertia="shapes")
    expected = mesh(tmp_path / "plate.stl", accuracy=4e-4)
    assert len(scene.bodies[0].shape.parts) == len(expected.parts)
    few = built(tmp_path, text, decompose=False, max_points=8, inertia="shapes")
    assert len(few.bodies[0].shape.parts[0].shape.points) == 8
