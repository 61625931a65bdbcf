"""What a page of the viewer holds before a browser draws it."""

import base64
import dataclasses
import re

import numpy as np
import pytest
import trimesh
from grippers import gripper
from pages import content_of, floats
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.evaluate.searches import SearchSettings
from energymargin.look.viewer import Page, view
from energymargin.look.viewer.sets import View, region_surface, view_around
from energymargin.look.viewer.shots import MOST_POINTS, one_a_spot, shape_surface
from energymargin.look.viewer.sources import first_frame, replay, score_state, source_of

TASKS = ("balance", "grasp", "push", "push-multi", "push-real", "scoop", "topple")


def problem_of(name, seed=1, frame=3):
    task = em.tasks.make(name)
    trajectory = task.rollout(seed)
    return task.problem(trajectory.states[frame], trajectory.params, trajectory.contacts[frame])


@pytest.fixture(scope="module")
def problem():
    return problem_of("push")


@pytest.fixture(scope="module")
def ranked():
    """Scores of three grasps of a bar; the last one is beside it, where the hand grips nothing."""
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=6)
    bar = em.grasps.GraspObject(em.Box((0.04, 0.18, 0.03)), mass=0.4, friction=0.7)
    poses = np.array([np.diag([1.0, -1.0, -1.0, 1.0])] * 3)
    poses[:, 1, 3], poses[:, 2, 3] = (0.0, 0.06, 0.3), 0.01
    return em.grasps.score(
        em.grasps.GraspSet(poses, names=("middle", "end", "beside")), hand, bar, "lift", rollouts=4
    )


@pytest.mark.parametrize("name", TASKS)
def test_a_replay_ends_in_the_trees_own_states(name):
    problem = problem_of(name)
    escape = em.escape_effort(problem, nodes=150, seed=1)
    node = escape.path[-1] if len(escape.path) else int(np.argmax(escape.tree.costs))
    path = escape.tree.path_to(node)
    way = replay(problem, escape.tree, path)
    assert np.array_equal(way.states[0], problem.state)
    assert np.array_equal(way.states[-1], escape.tree.states[node])
    assert way.costs[-1] == escape.tree.costs[node]
    assert way.times[-1] == pytest.approx(escape.tree.durations[path[1:]].sum())
    assert np.all(np.diff(way.times) > 0)


def test_an_empty_path_is_refused(problem):
    with pytest.raises(ValueError, match="path is empty"):
        replay(problem, em.escape_effort(problem, nodes=5).tree, [])


def solid_of(surface):
    return trimesh.Trimesh(surface.points, surface.faces, process=False)


def turned_outwards(surface):
    """Of triangles that may be seen either way round."""
    solid = solid_of(surface)
    solid.fix_normals(multibody=True)
    return solid


def ball_problem(region, scale=1.0):
    scene = em.Scene()
    scene.add_plane("ground", friction=0.5)
    at = (0, 0, scale)
    scene.add_body("ball", em.Sphere(0.1 * scale), mass=1, position=at, role="object")
    return em.Problem(
        scene, scene.pack(), force=(1, 1, 1), torque=(0, 0, 0), duration=0.2, captured=region
    )


@pytest.mark.parametrize("scale", [0.05, 1.0])
def test_a_set_is_a_closed_surface_around_its_places(scale):
    ball = em.regions.Ball("ball", center=(0, 0, scale), radius=0.5 * scale)
    problem = ball_problem(ball, scale)
    low, high = scale * np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])
    view = View(low, high, floor=0.0)
    surface = solid_of(region_surface(problem, ball, view))
    assert surface.is_watertight
    assert surface.volume == pytest.approx(4 / 3 * np.pi * (0.5 * scale) ** 3, rel=0.05)
    assert np.linalg.norm(surface.vertices - [0, 0, scale], axis=1) == pytest.approx(
        0.5 * scale, abs=0.08 * scale
    )


def test_a_set_that_holds_all_or_nothing_of_the_view_has_no_surface():
    ball = em.regions.Ball("ball", center=(0, 0, 1), radius=50)
    problem = ball_problem(ball)
    view = view_around(problem.scene, [problem.state])
    assert region_surface(problem, ball, view) is None
    assert region_surface(problem, ~ball, view) is None


@pytest.mark.parametrize(
    ("lost", "given", "first"),
    [
        ({}, (None, None), (0, 4)),  # no loss: the middle
        ({2: 6}, (None, None), (2, 4)),
        ({1: 1, 2: 6}, (None, None), (1, 0)),
        ({2: 6}, (1, None), (1, 4)),
        ({2: 6}, (None, 7), (0, 7)),
        ({2: 6}, (0, 3), (0, 3)),
    ],
)
def test_the_first_frame_is_a_quarter_before_the_first_trajectory_s_loss(lost, given, first):
    dataset = em.datasets.generate("push", trajectories=3, frames=8, seed=0)
    trajectories = [
        dataclasses.replace(one, captured=np.arange(8) < lost.get(number, 8))
        for number, one in enumerate(dataset.trajectories)
    ]
    source = source_of(dataclasses.replace(dataset, trajectories=trajectories))
    assert first_frame(source, *given) == first


def test_the_first_frame_is_one_that_makes_a_problem():
    dataset = em.datasets.generate("push", trajectories=1, frames=8, seed=0)
    (recorded,) = dataset.trajectories
    states = recorded.states.copy()
    states[4] = np.nan
    damaged = dataclasses.replace(recorded, states=states)
    source = source_of(dataclasses.replace(dataset, trajectories=[damaged]))
    assert first_frame(source, None, None) == (0, 0)


def test_a_mast_far_away_does_not_shrink_the_hand():
    near, far = gripper(), gripper(mast=True)
    assert view_around(far.scene, [far.state]).size == pytest.approx(
        view_around(near.scene, [near.state]).size
    )


def test_a_flat_set_is_a_slab_on_the_ground(problem):
    disc = em.regions.Disc("object", center=(1, 0.5), radius=0.8)
    view = View(np.array([-1.0, -1.0, 0.0]), np.array([3.0, 3.0, 0.1]), floor=0.0)
    solid = solid_of(region_surface(problem, disc, view, flat=True))
    assert solid.is_watertight
    assert solid.vertices[:, 2].min() == pytest.approx(0.0, abs=0.005 * view.size)
    assert np.ptp(solid.vertices[:, 2]) < 0.01 * view.size
    radii = np.linalg.norm(solid.vertices[:, :2] - [1, 0.5], axis=1)
    assert radii.max() == pytest.approx(0.8, abs=0.03)
    assert solid.area / 2 == pytest.approx(np.pi * 0.8**2, rel=0.1)


@pytest.mark.parametrize(
    "shape",
    [
        em.Box((0.1, 0.2, 0.3)),
        em.Sphere(0.1),
        em.Cylinder(radius=0.1, length=0.3),
        em.Capsule(radius=0.1, length=0.3),
        em.ConvexHull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    ],
)
def test_a_shapes_triangles_hold_its_volume_at_its_place(shape):
    moved = em.Compound([em.Part(shape, (0, 0, 0)), em.Part(shape, (5, 0, 0))])
    properties = em.mass_properties(shape)
    one = turned_outwards(shape_surface(shape))
    two = turned_outwards(shape_surface(moved))
    assert one.is_watertight
    assert one.volume == pytest.approx(properties.volume, rel=0.02)
    assert one.center_mass == pytest.approx(properties.center, abs=1e-6)
    assert two.volume == pytest.approx(2 * one.volume)
    assert two.bounds[1][0] == pytest.approx(5 + one.bounds[1][0])


def test_of_nodes_on_one_spot_the_cheapest_is_drawn():
    random = np.random.default_rng(0)
    points = np.repeat(random.uniform(size=(400, 3)), 100, axis=0)
    costs, lost = random.uniform(size=len(points)), np.arange(len(points)) % 100 == 0
    shown = one_a_spot(points, lost, costs, 1.0, MOST_POINTS)
    assert len(shown) == 800  # a captured and a lost one of each spot
    for spot in range(400):
        here = shown[shown // 100 == spot]
        captured = here[~lost[here]]
        group = np.arange(100 * spot + 1, 100 * spot + 100)
        assert captured == group[np.argmin(costs[group])]


def test_no_more_is_drawn_than_a_browser_moves():
    random = np.random.default_rng(0)
    points, costs = random.uniform(size=(100_000, 3)), random.uniform(size=100_000)
    shown = one_a_spot(points, np.zeros(100_000, bool), costs, 1.0, MOST_POINTS)
    assert 0.5 * MOST_POINTS < len(shown) <= MOST_POINTS
    assert len(np.unique(shown)) == len(shown)
    few = one_a_spot(points[:500], np.zeros(500, bool), costs[:500], 1.0, MOST_POINTS)
    assert sorted(few) == list(range(500))


def test_a_state_without_effector_is_scored_but_for_the_force():
    ball = em.regions.Ball("ball", center=(0, 0, 1), radius=0.5)
    scored = score_state(ball_problem(ball), SearchSettings(nodes=30))
    assert scored.force is None
    assert scored.capture.nodes == 30


def test_scores_of_another_dataset_are_refused(tmp_path):
    for seed, name in ((1, "a.h5"), (2, "b.h5")):
        em.datasets.generate("push", trajectories=1, frames=3, seed=seed).save(tmp_path / name)
    em.store.score_dataset(tmp_path / "a.h5", tmp_path / "a.db", ("force",))
    with pytest.raises(ValueError, match=r"b\.h5 is not the dataset that run 1 of .*a\.db scored"):
        view(tmp_path / "b.h5", scores=tmp_path / "a.db")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"what": None}, "what is None, expected a Problem, a Dataset, the file of one"),
        ({"what": "nothing"}, "'nothing' is neither a problem file .* nor a task: balance, "),
        ({"what": "missing.h5"}, "missing.h5"),
        ({"what": "missing.json"}, "missing.json"),
        ({"what": "push", "parameters": {"friction": -1}}, "friction"),
        ({"what": "some.h5", "parameters": {"friction": 0.3}}, "parameters are given with some.h5"),
    ],
)
def test_what_cannot_be_viewed_is_said(arguments, message):
    with pytest.raises((ValueError, OSError), match=message):
        view(**arguments)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frame": 9}, "frame is 9, expected 0 to 3"),
        ({"trajectory": 1}, "trajectory is 1, expected 0 to 0"),
        ({"nodes": 0}, "nodes is 0"),
        ({"nodes": 10**10}, "nodes is 10000000000"),
        ({"frame": 1.5}, "frame is 1.5"),
        ({"run": 1}, "run is 1, but there are no scores that it is of"),
        ({"every": 0}, "every is 0"),
    ],
)
def test_options_that_cannot_be_are_refused(options, message):
    dataset = em.datasets.generate("push", trajectories=1, frames=4, seed=1)
    with pytest.raises(ValueError, match=message):
        view(dataset, **options)


def test_a_problem_has_no_stored_scores(problem):
    with pytest.raises(ValueError, match="of no use with a problem alone"):
        view(problem, scores="scores.db")


def test_an_object_is_drawn_as_lost_when_it_is_out_of_its_own_set():
    problem = problem_of("push-multi")
    scored = score_state(problem, SearchSettings(nodes=60))
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    assert scored.lost.shape == (61, objects)
    all_in = problem.captured.contains(problem.scene, scored.capture.tree.states)
    assert np.array_equal(~scored.lost.any(axis=1), all_in)


def test_a_page_has_the_scores_of_the_search_and_its_whole_tree(problem):
    page = view(problem, nodes=50, seed=7)
    searched = em.capture_score(problem, nodes=50, seed=7)
    (scored,), content = page.scored, content_of(page)
    assert scored.capture.capture == searched.capture
    (shot,) = content["shots"]
    assert f">{searched.capture:.3f}<" in shot["words"]
    numbers = np.frombuffer(base64.b64decode(content["blobs"][shot["dots"]["numbers"]]), np.uint32)
    assert numbers.tolist() == list(range(51))
    points = floats(content, shot["dots"]["points"], -1, 3)
    places = searched.tree.states[:, problem.scene.slice("object")][:, :3]
    assert points == pytest.approx(places, abs=1e-6)


def test_its_escape_is_played_from_the_state_to_the_end_of_the_path(problem):
    page = view(problem, nodes=300)
    content, way = content_of(page), page.scored[0].way_out
    shot = content["shots"][0]
    track = next(one for one in shot["tracks"] if one["name"] == "escape")
    assert track["times"] == pytest.approx(way.times, abs=1e-4)
    assert f"{way.costs[-1]:.3g} J" in track["captions"][-1]
    poses = floats(content, track["poses"], len(way.times), len(shot["bodies"]), 7)
    object = [body["object"] for body in shot["bodies"]].index(True)
    for moment, state in ((0, problem.state), (-1, way.states[-1])):
        place = problem.scene.unpack(state)["object"]["position"]
        assert poses[moment, object, :3] == pytest.approx(place, abs=1e-6)
    ghost = floats(content, shot["ghost"], len(shot["bodies"]), 7)
    assert np.array_equal(ghost, poses[-1])


def test_the_capture_set_of_a_grip_is_drawn_at_its_place_and_is_as_large():
    content = content_of(view(gripper(radius=0.015), nodes=20))
    (surface,) = content["shots"][0]["surfaces"]
    points = floats(content, surface["mesh"]["points"], -1, 3)
    assert surface["show"] == "capture set"
    assert np.ptp(points, axis=0) == pytest.approx([0.03] * 3, rel=0.05)


def test_a_task_opens_on_a_state_that_is_about_to_be_lost():
    page = view("push", nodes=200)
    assert 0.05 < page.scored[0].capture.capture < 0.9
    assert page.scored[0].way_out is not None
    assert "the trajectory fails" in content_of(page)["shots"][0]["words"]


def test_a_spring_is_fastened_to_its_bodies_where_the_scene_says():
    problem = problem_of("topple")
    (spring,) = problem.scene.springs
    content = content_of(view(problem, nodes=5))
    shot = content["shots"][0]
    poses = floats(content, shot["pose"], len(shot["bodies"]), 7).astype(float)
    ((a, point_a, b, point_b),) = shot["springs"]
    places = problem.scene.unpack(problem.state)
    for row, point, body, own in (
        (a, point_a, spring.body_a, spring.point_a),
        (b, point_b, spring.body_b, spring.point_b),
    ):
        end = poses[row, :3] + Rotation.from_quat(poses[row, 3:]).apply(point)
        turned = Rotation.from_quat(places[body]["orientation"]).apply(np.array(own))
        assert end == pytest.approx(places[body]["position"] + turned, abs=1e-6)


def test_the_scores_of_a_dataset_s_state_are_those_of_its_file(tmp_path):
    dataset = em.datasets.generate("push", trajectories=2, frames=4, seed=1)
    path = tmp_path / "push.h5"
    dataset.save(path)
    em.store.score_dataset(
        path, tmp_path / "s.db", ("capture", "success"), settings=em.SearchSettings(40, 5)
    )
    page = view(path, trajectory=1, frame=2, scores=tmp_path / "s.db")  # its settings
    live, stored = page.scored[0].capture, em.store.load(tmp_path / "s.db")
    row = stored[(stored.trajectory == 1) & (stored.frame == 2)].iloc[0]
    assert (live.capture, live.success) == (row["capture"], row["success"])
    em.datasets.generate("push", trajectories=1, frames=3, seed=2).save(path)  # it is let go of


def test_what_a_file_of_scores_says_is_text_on_the_page(tmp_path):
    dataset = em.datasets.generate("push", trajectories=1, frames=2, seed=1)
    source = {"source": "<img src=x onerror=alert()></script>"}
    em.store.add_scores(tmp_path / "s.db", dataset, {"force": [1.0, 2.0]}, settings=source)
    page = view(dataset, scores=tmp_path / "s.db")
    words = content_of(page)["shots"][0]["words"]
    assert "<img" not in words and "&lt;img src=x" in words


@pytest.mark.parametrize("name", TASKS)
def test_every_task_can_be_viewed(name):
    dataset = em.datasets.generate(name, trajectories=1, frames=3, seed=0)
    assert view(dataset, frame=1, nodes=20).scored[0].capture.nodes == 20


def test_every_so_many_frames_are_chosen_from_and_share_their_arrays():
    dataset = em.datasets.generate("push", trajectories=1, frames=5, seed=1)
    page, alone = view(dataset, frame=1, every=2, nodes=10), view(dataset, frame=1, nodes=10)
    content = content_of(page)
    assert len(content["shots"]) == len(page.scored) == 4 and content["first"] == 1  # 0, 1, 2, 4
    assert len({shot["bodies"][0]["mesh"]["points"] for shot in content["shots"]}) == 1
    assert content["shots"][1]["words"] == content_of(alone)["shots"][0]["words"]


def test_the_same_question_makes_the_same_page(problem):
    assert view(problem, nodes=20).html == view(problem, nodes=20).html


def test_a_page_needs_nothing_of_the_network_and_is_small(problem, tmp_path):
    page = view(problem, nodes=1000)
    page.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < 3_000_000
    assert not re.search(r"""(src|href)=["'](?!data:)""", page.html)
    with pytest.raises(ValueError, match=r"page\.txt', expected a name with \.html or \.htm"):
        page.save(tmp_path / "page.txt")


def test_a_notebook_shows_the_page(problem):
    shown = view(problem, nodes=5)._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "<script" not in shown


def test_an_error_of_a_set_is_said():
    def broken(states):
        raise LookupError("no such place")

    with pytest.raises(Exception, match="no such place"):
        view(ball_problem(em.regions.Predicate(broken)), nodes=20)


def test_a_page_of_grasps_has_each_once_the_best_first(ranked):
    page = view(ranked)
    content = content_of(page)
    assert isinstance(page, Page) and page.title == f"{len(ranked.grasps)} grasps"
    names = [shot["name"] for shot in content["shots"]]
    assert names == [
        f"{rank + 1}. {ranked.grasps.names[k]}: {ranked.probabilities[k]:.2f}"
        for rank, k in enumerate(ranked.ranked)
    ]
    assert any(shot["tracks"] for shot in content["shots"])
    assert "open hand" in content["shots"][-1]["words"]
