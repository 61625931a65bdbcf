"""What the viewer computes before a browser draws it."""

import asyncio
import dataclasses
import io
import json
import socket
import struct
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from grippers import gripper
from scipy.spatial.transform import Rotation
from viser import _messages

import energymargin as em
from energymargin.evaluate.searches import SearchSettings
from energymargin.look.viewer import Viewer, view
from energymargin.look.viewer.bodies import shape_surface
from energymargin.look.viewer.page import Page
from energymargin.look.viewer.search import (
    replay,
    score_state,
    tree_cache,
)
from energymargin.look.viewer.sources import first_frame, source_of
from energymargin.look.viewer.stage import View, region_surface, view_around
from energymargin.look.viewer.trees import MOST_POINTS, lines_glb, one_a_spot

TASKS = ("balance", "grasp", "push", "push-multi", "push-real", "scoop", "topple")


def problem_of(name, seed=1, frame=3):
    task = em.tasks.make(name)
    trajectory = task.rollout(seed)
    return task.problem(trajectory.states[frame], trajectory.params, trajectory.contacts[frame])


@pytest.fixture(scope="module")
def problem():
    return problem_of("push")


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


@pytest.mark.parametrize("name", TASKS)
def test_a_tree_answers_for_fewer_nodes_and_any_lambda(name):
    problem = problem_of(name)
    scored = score_state(problem, SearchSettings(nodes=200, seed=3))
    for nodes, share in ((200, 1.0), (60, 0.3), (17, 3.0)):
        rate = share * problem.rate
        scores = scored.values(nodes, rate)
        searched = em.capture_score(problem, nodes=nodes, seed=3, rate=rate)
        again = {name: getattr(searched, name.replace("/", "_")) for name in scores}
        assert scores == pytest.approx(again)
        assert ("success" in scores) == (problem.succeeded is not None)


def drawn(viewer, path):
    """What is drawn at a path of the browser's scene; None if there is nothing."""
    return viewer._server.scene._handle_from_node_name.get(path)


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
    surface = region_surface(problem, ball, view)
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


def test_a_set_within_an_object_and_the_object_around_it_never_hide_each_other():
    """Their materials are blended, so that browsers do not note their depth."""
    with view(gripper(radius=0.015)) as viewer:
        stage = viewer.page._stage
        viewer.page.wait()
        assert stage.draw_sets() == {"capture set"}
        of_cube, of_set = stage._bodies._moving["cube"], drawn(viewer, "/capture_set/surface")
        for solid, size in ((of_cube, 0.04), (of_set, 0.03)):
            content = trimesh.load(io.BytesIO(solid.glb_data), file_type="glb")
            (mesh,) = content.geometry.values()
            assert mesh.visual.material.alphaMode == "BLEND"
            assert mesh.extents == pytest.approx([size] * 3, rel=0.05)


def test_a_task_opens_on_a_state_that_is_about_to_be_lost():
    with view("push", nodes=200) as viewer:
        page = viewer.page
        captured = page._frames.captured
        assert captured[page._frame] and not captured[-1]
        assert np.flatnonzero(captured)[-1] - page._frame == pytest.approx(len(captured) / 4, abs=2)
        page.score()
        page.wait()
        assert 0.05 < page.scored.capture.capture < 0.9 and page.scored.way_out is not None


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


def test_a_spring_goes_from_point_to_point_of_its_bodies():
    problem = problem_of("topple")
    (spring,) = problem.scene.springs
    with view(problem) as viewer:
        ends = viewer.page._stage._bodies._springs.points
    places = problem.scene.unpack(problem.state)
    assert ends.shape == (1, 2, 3)
    for end, body, point in zip(
        ends[0], (spring.body_a, spring.body_b), (spring.point_a, spring.point_b), strict=True
    ):
        turned = Rotation.from_quat(places[body]["orientation"]).apply(np.array(point))
        assert end == pytest.approx(places[body]["position"] + turned, abs=1e-6)


def test_a_flat_set_is_a_slab_on_the_ground(problem):
    disc = em.regions.Disc("object", center=(1, 0.5), radius=0.8)
    view = View(np.array([-1.0, -1.0, 0.0]), np.array([3.0, 3.0, 0.1]), floor=0.0)
    solid = region_surface(problem, disc, view, flat=True)
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
    one = shape_surface(shape)
    two = shape_surface(moved)
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


def test_lines_are_a_glb_file_of_both_ends_of_each():
    segments = np.random.default_rng(0).uniform(size=(7, 2, 3))
    data = lines_glb(segments, np.full((7, 3), (255, 0, 188), np.uint8))
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    document = json.loads(data[20 : 20 + size])
    assert kind == b"JSON" and len(data) % 4 == 0
    (primitive,) = document["meshes"][0]["primitives"]
    assert primitive["mode"] == 1
    binary = data[28 + size :]
    points = np.frombuffer(binary[: 14 * 12], "<f4").reshape(7, 2, 3)
    assert points == pytest.approx(segments, abs=1e-6)
    colors = np.frombuffer(binary[14 * 12 :], np.uint8).reshape(14, 4)
    assert np.all(colors == (255, 0, 128, 255))  # 188 of 255 on a screen is half the light


def test_the_trees_that_were_not_looked_at_go_when_there_are_too_many_nodes(problem):
    small = score_state(problem, SearchSettings(nodes=20))
    cache = tree_cache(3 * small.size)
    for frame in range(5):
        cache.get((0, 1))
        cache[0, frame] = small
    assert list(cache) == [(0, 1), (0, 3), (0, 4)]


def test_a_tree_that_is_larger_than_all_may_be_is_cached_alone(problem):
    small, large = (score_state(problem, SearchSettings(nodes=nodes)) for nodes in (5, 50))
    cache = tree_cache(2 * small.size)
    cache[0, 0] = small
    cache[0, 1] = large
    assert large.size > 2 * small.size
    assert list(cache) == [(0, 1)]


def test_a_state_without_effector_is_scored_but_for_the_force():
    ball = em.regions.Ball("ball", center=(0, 0, 1), radius=0.5)
    scored = score_state(ball_problem(ball), SearchSettings(nodes=30))
    assert scored.force is None
    assert scored.capture.nodes == 30


def test_live_scores_are_those_of_the_dataset(tmp_path):
    dataset = em.datasets.generate("push", trajectories=2, frames=4, seed=1)
    path = tmp_path / "push.h5"
    dataset.save(path)
    em.store.score_dataset(
        path, tmp_path / "s.db", ("capture", "success"), settings=em.SearchSettings(40, 5)
    )
    with view(path, trajectory=1, frame=2, scores=tmp_path / "s.db") as viewer:  # its settings
        viewer.page.score()
        viewer.page.wait()
        live = viewer.page.scored.capture
        stored = em.store.load(tmp_path / "s.db")
        row = stored[(stored.trajectory == 1) & (stored.frame == 2)].iloc[0]
        assert (live.capture, live.success) == (row["capture"], row["success"])


def test_live_scores_of_a_problem_are_those_of_its_own(problem, tmp_path):
    problem.save(tmp_path / "p.json")
    with view(tmp_path / "p.json", nodes=50, seed=7) as viewer:
        viewer.page.score()
        viewer.page.wait()
        assert (
            viewer.page.scored.capture.capture
            == em.capture_score(problem, nodes=50, seed=7).capture
        )


def test_scores_of_another_dataset_are_refused(tmp_path):
    for seed, name in ((1, "a.h5"), (2, "b.h5")):
        em.datasets.generate("push", trajectories=1, frames=3, seed=seed).save(tmp_path / name)
    em.store.score_dataset(tmp_path / "a.h5", tmp_path / "a.db", ("force",))
    with pytest.raises(ValueError, match=r"b\.h5 is not the dataset that run 1 of .*a\.db scored"):
        view(tmp_path / "b.h5", scores=tmp_path / "a.db")


def test_what_a_file_of_scores_says_is_text_on_the_page(tmp_path):
    dataset = em.datasets.generate("push", trajectories=1, frames=2, seed=1)
    em.store.add_scores(
        tmp_path / "s.db",
        dataset,
        {"force": [1.0, 2.0]},
        settings={"source": "<img src=x onerror=alert()>"},
    )
    with view(dataset, scores=tmp_path / "s.db") as viewer:
        shown = viewer.page._panel.scores.content
    assert "<img" not in shown and "&lt;img src=x" in shown


def test_viewers_side_by_side_take_ports_of_their_own(problem):
    with view(problem) as first, view(problem) as second:
        assert first.port != second.port
    with view(problem, port=first.port) as third:  # free again
        assert third.url == f"http://127.0.0.1:{first.port}/"


def test_only_this_machine_reaches_the_page(problem):
    with view(problem) as viewer:
        socket.create_connection(("127.0.0.1", viewer.port), timeout=5).close()
        with pytest.raises(ConnectionRefusedError):  # another of its addresses
            socket.create_connection(("127.0.0.2", viewer.port), timeout=5)


def test_no_browser_can_ask_for_a_public_tunnel(problem):
    with view(problem) as viewer:
        server = viewer._server
        (ask,) = server._websock_server._incoming_handlers[_messages.ShareUrlRequest]
        ask(0, _messages.ShareUrlRequest())
        server._thread_executor.shutdown(wait=True)
        assert server._share_tunnel is None


def test_a_search_ends_when_its_viewer_does(problem):
    viewer = view(problem, nodes=10**8)
    viewer.page.score()
    begin = time.monotonic()
    viewer.close()
    assert time.monotonic() - begin < 2.0  # 0.1 s, or more on a busy machine


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
        ({"port": 70000}, "port is 70000, expected a whole number from 1 to 65535"),
    ],
)
def test_options_that_cannot_be_are_refused(options, message):
    dataset = em.datasets.generate("push", trajectories=1, frames=4, seed=1)
    with pytest.raises(ValueError, match=message):
        view(dataset, **options)


def test_a_problem_has_no_stored_scores(problem):
    with pytest.raises(ValueError, match="of no use with a problem alone"):
        view(problem, scores="scores.db")


@pytest.mark.parametrize("name", TASKS)
def test_every_task_can_be_viewed(name):
    source = source_of(name, trajectories=1, frames=3)
    settings = SearchSettings(nodes=20)
    with Viewer(source, frame=1, settings=settings) as viewer:
        assert isinstance(viewer.page, Page)
        viewer.page.score()
        viewer.page.wait()
        assert viewer.page.scored.capture.nodes == 20


def scored_page(viewer):
    viewer.page.score()
    viewer.page.wait()
    return viewer.page


@pytest.mark.parametrize("nodes", [1, 5, 1005])
def test_any_number_of_nodes_will_do(problem, nodes):
    with view(problem, nodes=nodes) as viewer:
        assert scored_page(viewer).scored.capture.nodes == nodes


def test_a_lambda_of_0_will_do():
    ball = em.regions.Ball("ball", center=(0, 0, 1), radius=0.5)
    still = ball_problem(ball)
    flat = em.Problem(
        still.scene,
        still.state,
        force=(1, 1, 1),
        torque=(0, 0, 0),
        duration=0.2,
        captured=ball,
        rate=0,
    )
    with view(flat, nodes=10) as viewer:
        assert scored_page(viewer).scored is not None


def test_a_search_that_is_stopped_at_once_leaves_the_page_whole(problem):
    cancel = em.Cancel()
    cancel.set()
    with view(problem, nodes=50) as viewer:
        page = viewer.page
        page._keep(0, 0, score_state(problem, SearchSettings(nodes=50), None, cancel))
        assert page.scored is None  # nothing was searched, so nothing is said
        scored_page(viewer)
        whole = page.scored
        page._keep(0, 0, score_state(problem, SearchSettings(nodes=50), None, cancel))
        assert page.scored is whole  # what is complete is not given up for it


def test_more_nodes_than_the_slider_has_may_be_typed(problem):
    with view(problem, nodes=20) as viewer:
        panel = viewer.page._panel
        for typed, asked in ((5000, 5000), (10**9, 10**6), (0, 1)):
            panel.nodes.value = typed
            assert panel.asked_nodes() == asked == panel.nodes.value
            viewer.page.wait()


def test_the_sets_of_another_frame_are_not_shown_while_those_of_this_one_are_computed(
    monkeypatch,
):
    dataset = em.datasets.generate("push", trajectories=1, frames=3, seed=1)
    with view(dataset, nodes=10) as viewer:
        page, later = viewer.page, []
        page._start()  # all frames: trees are drawn at once
        page.wait()
        sets = ("/capture_set/surface", "/success_set/surface")
        assert all(drawn(viewer, path) for path in sets)
        monkeypatch.setattr(page._sets_later, "start", later.append)
        page._panel.frame.value = 2
        end = time.monotonic() + 30
        while not later and time.monotonic() < end:
            time.sleep(0.01)
        assert not any(drawn(viewer, path) for path in sets)
        later[-1](em.Cancel())
        assert all(drawn(viewer, path) for path in sets)


def test_what_ends_a_search_with_an_error_is_said():
    def broken(states):
        raise LookupError("no such place")

    ball = ball_problem(em.regions.Predicate(broken))
    with view(ball, nodes=20) as viewer:
        viewer.page.score()
        with pytest.raises(Exception, match="no such place"):
            viewer.page.wait()
        assert not viewer.page._searching.running


def test_only_one_search_runs_however_many_are_started(problem):
    with view(problem, nodes=10**7) as viewer:
        threads = [threading.Thread(target=viewer.page.score) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        viewer.page._searching.stop()
        viewer.page._searching.join()
        assert not viewer.page._searching.running


def test_a_frame_that_makes_no_problem_leaves_the_one_before():
    dataset = em.datasets.generate("push", trajectories=1, frames=4, seed=1)
    recorded = dataset.trajectories[0]
    states = recorded.states.copy()
    states[2] = np.nan
    damaged = dataclasses.replace(recorded, states=states)
    with view(dataclasses.replace(dataset, trajectories=[damaged]), frame=0, nodes=10) as viewer:
        page = viewer.page
        page._panel.frame.value = 2
        end = time.monotonic() + 5.0
        while page._panel.frame.value != 0 and time.monotonic() < end:
            time.sleep(0.01)
        assert page._panel.frame.value == page._frame == 0


def test_an_object_is_drawn_as_lost_when_it_is_out_of_its_own_set():
    problem = problem_of("push-multi")
    scored = score_state(problem, SearchSettings(nodes=60))
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    assert scored.lost.shape == (61, objects)
    all_in = problem.captured.contains(problem.scene, scored.capture.tree.states)
    assert np.array_equal(~scored.lost.any(axis=1), all_in)


def test_a_closed_viewer_lets_go_of_its_dataset(tmp_path):
    path = tmp_path / "push.h5"
    em.datasets.generate("push", trajectories=1, frames=3, seed=1).save(path)
    view(path).close()
    with pytest.raises(ValueError, match="frame is 9"):
        view(path, frame=9)
    em.datasets.generate("push", trajectories=1, frames=3, seed=2).save(path)
    import h5py

    with h5py.File(path, "a"):
        pass


def test_a_replay_is_stopped_by_its_button_by_a_hand_and_by_other_moments(problem):
    """However long a moment is; without a browser, whose moves have the number of a client."""
    with view(problem, nodes=10) as viewer:
        player, shown = viewer.page._panel.escape, []
        player.connect(shown.append)
        long = 1e6 * np.arange(4.0)
        hand = SimpleNamespace(client_id=0)
        for stop, at in (
            (player.press, 0),
            (
                lambda: asyncio.run_coroutine_threadsafe(player._take(hand), player._loop).result(),
                0,
            ),
            (lambda: player.set_up(long), 0),
        ):
            player.set_up(long)
            player.press()
            until(lambda: shown, "it begins")
            assert player.playing and player.button.label == "Stop"
            stop()
            player.join()
            assert not player.playing and player.button.label == "Replay the escape"
            assert player.slider.value == at
            shown.clear()
        player.set_up(np.arange(4) / 100)
        player.press()
        player.join()
        assert shown == [0, 1, 2, 3] and player.slider.value == 3
        player.press()
        player.join()
        assert shown[4:] == [0, 1, 2, 3]


def until(true, what):
    """Waits for it."""
    end = time.monotonic() + 30
    while not true():
        assert time.monotonic() < end, what
        time.sleep(0.01)
