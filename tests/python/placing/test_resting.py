"""How a body can lie: closed forms of boxes and cylinders, trimesh's poses, simulated drops."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import energymargin as em

GRASPS = Path(os.environ.get("ENERGYMARGIN_GRASPS", "")) / "graspa/meshes"
G = 9.81


def test_a_box_topples_over_each_edge_with_the_work_of_the_closed_form():
    for size in np.random.default_rng(3).uniform(0.03, 0.4, (10, 3)):
        found = em.resting_poses(em.Box(size), mass=0.7, merge=0.0)
        assert len(found) == 6
        for one in found:
            low, *sides = sorted(size, key=lambda side: abs(side / 2 - one.height))
            expected = [0.7 * G * (np.hypot(w / 2, low / 2) - low / 2) for w in sides]
            assert sorted(set(np.round(list(one.work.values()), 9))) == pytest.approx(
                sorted(expected), rel=1e-6
            )
            assert one.largest_tilt == pytest.approx(np.arctan(min(sides) / low))


def test_a_cylinder_topples_with_the_work_of_the_closed_form_and_rolls_on_its_side():
    radius, length = 0.03, 0.12
    side, *ends = em.resting_poses(em.Cylinder(radius, length), mass=0.5)
    work = 0.5 * G * (np.hypot(radius, length / 2) - length / 2)
    assert len(ends) == 2 and side.height == pytest.approx(radius, rel=0.003)
    assert all(one.work == {0: pytest.approx(work, rel=0.01)} for one in ends)
    sides = np.degrees(np.arctan2(length / 2, radius))
    solid = 1 - np.cos(np.radians(90 - sides))  # of a cap, half of it for each end
    assert ends[0].probability == pytest.approx(solid / 2, rel=0.01)


def test_round_bodies_lie_in_one_way():
    for shape in (em.Sphere(0.05), em.Capsule(0.03, 0.1)):
        (one,) = em.resting_poses(shape)
        assert one.probability == pytest.approx(1.0) and one.least_work == np.inf


def test_the_probability_of_a_face_of_a_box_is_its_solid_angle():
    a, b, c = 0.1, 0.2, 0.3
    found = em.resting_poses(em.Box((a, b, c)))
    for one in found:
        h = one.height
        u, v = (x / 2 for x in sorted((a, b, c), key=lambda x: abs(x / 2 - h))[1:])
        angle = 4 * np.arctan(u * v / (h * np.sqrt(u * u + v * v + h * h)))
        assert one.probability == pytest.approx(angle / (4 * np.pi))


@pytest.mark.parametrize(
    ("shape", "ways", "stands"),
    [
        (em.Box((1.0, 1.0, 0.04)), 2, 0),  # on an edge for a breath
        (em.Box((1.0, 1.0, 0.06)), 2, 4),
        (em.Box((0.1, 0.1, 1.0)), 4, 2),
        (em.Cylinder(0.05, 0.01), 2, 1),
        (em.Cylinder(0.05, 0.002), 2, 0),
    ],
)
def test_what_comes_to_a_slender_pose_goes_on_to_all_alike_beside_it(shape, ways, stands):
    found = em.resting_poses(shape)
    expected = [1 / ways] * ways + [0] * stands
    assert [one.probability for one in found] == pytest.approx(expected)


def test_a_slender_pose_has_its_work_and_its_tilt():
    w, h = 0.1, 1.0
    stands = em.resting_poses(em.Box((w, w, h)), mass=1.0)[-1]
    assert stands.least_work == pytest.approx(G * (np.hypot(w / 2, h / 2) - h / 2))
    assert stands.largest_tilt == pytest.approx(np.arctan(w / h))


def test_a_centre_of_mass_outside_of_the_hull_is_refused():
    beside = em.Inertial(center=(0.06, 0, 0), inertia=(1e-3,) * 3)
    with pytest.raises(ValueError, match="inertial has its centre outside of the hull"):
        em.resting_poses(em.Box((0.1, 0.1, 0.1)), mass=1.0, inertial=beside)


@pytest.mark.parametrize("degrees", [10, 20, 28])
def test_all_directions_end_somewhere_on_a_slope_too(degrees):
    turn = np.deg2rad(degrees)
    on = (np.sin(turn), 0, np.cos(turn))
    found = em.resting_poses(em.Box((0.1, 0.2, 0.3)), on=on, friction=0.9)
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    assert all(one.largest_tilt >= turn for one in found)


@pytest.mark.parametrize(
    ("shape", "stand"),
    [(em.Sphere(0.05), 0), (em.Capsule(0.03, 0.1), 0), (em.Cylinder(0.03, 0.1), 2)],
    ids=["ball", "capsule", "can"],
)
def test_what_is_round_rolls_away_on_any_slope(shape, stand):
    turn = np.deg2rad(1.0)
    level = em.resting_poses(shape)
    leaning = em.resting_poses(shape, on=(np.sin(turn), 0, np.cos(turn)))
    assert level[0].largest_tilt == 0.0 and len(level) == stand + 1
    assert [one.probability for one in leaning] == pytest.approx(
        [one.probability for one in level[1:]]
    )


def test_what_topples_on_a_slope_goes_to_all_sides_alike():
    turn = np.deg2rad(25.0)
    found = em.resting_poses(
        em.Box((0.1, 0.1, 0.3)), on=(np.sin(turn), 0, np.cos(turn)), friction=0.9
    )
    assert [one.probability for one in found] == pytest.approx([0.25] * 4)


def test_a_pose_is_at_rest_and_on_the_plane():
    shape = em.Compound(
        [em.Part(em.Box((0.1, 0.06, 0.04))), em.Part(em.Box((0.03, 0.03, 0.08)), (0.03, 0, 0.06))]
    )
    found = em.resting_poses(shape, mass=0.3)
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    for one in found:
        scene = em.Scene()
        scene.add_plane("floor", friction=1.0)
        turn = Rotation.from_matrix(one.pose[:3, :3]).as_quat()
        scene.add_body("thing", shape, mass=0.3, position=one.pose[:3, 3], orientation=turn)
        assert em.settle(scene).stays


def test_a_slope_takes_what_topples_on_it_and_everything_that_slides():
    box = em.Box((0.1, 0.1, 0.3))
    slope = np.radians(20)  # the tall pose topples from atan(1/3) = 18.4 degrees on
    on = (np.sin(slope), 0, np.cos(slope))
    heights = {round(one.height, 3) for one in em.resting_poses(box, friction=0.6, on=on)}
    assert heights == {0.05}
    assert not em.resting_poses(box, friction=0.3, on=on)


@pytest.mark.parametrize(
    "shape", [em.Box((0.1, 0.12, 0.2)), em.Cylinder(0.04, 0.06)], ids=["box", "cylinder"]
)
def test_drops_end_as_the_probabilities_say(shape):
    found = em.resting_poses(shape, drops=200)
    assert found.complete and found.drops == 200
    assert found.total_variation <= 0.1


def test_drops_that_are_stopped_keep_what_is_done_on_any_threads():
    cancel, box = em.Cancel(), em.Box((0.1, 0.12, 0.2))
    found = em.resting_poses(
        box,
        drops=10**6,
        progress=lambda done, _: cancel.set() if done >= 20 else None,
        cancel=cancel,
    )
    assert not found.complete and 0 < found.drops < 10**6
    same = em.resting_poses(box, drops=found.drops, threads=1)
    assert same.complete and [o.dropped for o in same] == [o.dropped for o in found]
    with pytest.raises(em.Cancelled):
        em.resting_poses(box, drops=10, cancel=cancel)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"friction": -1.0}, "friction is -1"),
        ({"on": (0, 0, -1)}, "on is"),
        ({"merge": 2.0}, "merge is 2"),
        ({"drops": -1}, "drops is -1"),
    ],
)
def test_bad_arguments_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        em.resting_poses(em.Box((1, 1, 1)), **given)


def test_pictures_show_each_pose():
    plots = pytest.importorskip("energymargin.plots")
    found = em.resting_poses(em.Box((0.05, 0.06, 0.1)))
    figure = plots.figure_resting_poses(found)
    assert len([ax for ax in figure.axes if ax.get_title()]) == 6
    assert f"{found[0].probability:.1%}" in plots.plot_resting_pose(found).get_title()
    with pytest.raises(ValueError, match="number is 6"):
        plots.plot_resting_pose(found, 6)


@pytest.mark.skipif(not GRASPS.is_dir(), reason="ENERGYMARGIN_GRASPS is not set")
@pytest.mark.parametrize(
    "name", ["YcbBanana", "YcbChipsCan", "YcbCrackerBox", "YcbGelatinBox", "YcbTennisBall"]
)
def test_poses_and_probabilities_are_those_of_trimesh(name):
    trimesh = pytest.importorskip("trimesh")
    hull = trimesh.load(GRASPS / f"{name}.stl").convex_hull
    inertial = em.mass_properties(em.ConvexHull(hull.vertices), 1.0)
    center = np.array(inertial.center)
    theirs = trimesh.poses.compute_stable_poses(hull, center_mass=center)[1]
    own = em.resting_poses(em.ConvexHull(hull.vertices), merge=0.0)
    assert len(own) == len(theirs)
    shares = np.array([one.probability for one in own])
    assert 0.5 * np.abs(shares - np.sort(theirs)[::-1]).sum() < 0.02
