import csv
import importlib.util
import sys

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import energymargin as em
from energymargin.scenes import data_file
from energymargin_paper.paper.printed import OBJECTS, TOOLS, printed
from energymargin_paper.paper.push_real import WALL_Y, PushRealTask
from energymargin_paper.paper.table2 import COMBINATIONS

MASSES = {"rectangle": 0.048, "triangle": 0.028, "convex": 0.042, "concave": 0.043}  # kg
MASSES["irregular"] = 0.024


def recorder():
    """data/push_real/record.py, as a module."""
    path = data_file("push_real/labels.csv").with_name("record.py")
    sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location("record", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_has_its_mass_its_centre_at_its_frame_and_its_longest_edge_ahead(name):
    body = printed("objects", name)
    assert body.mass == MASSES[name] and body.height == 0.03
    assert np.abs(em.mass_properties(body.shape).center).max() < 1e-4
    hull = ConvexHull(body.points)
    edges = hull.points[hull.simplices]
    lengths = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1)
    longest = max(edges[lengths > lengths.max() - 1e-6], key=lambda edge: edge[0, 1])
    assert longest[:, 1] == pytest.approx([body.ahead, body.ahead])


@pytest.mark.parametrize("name", OBJECTS)
@pytest.mark.parametrize(
    ("yaw", "off", "success"),
    [(0, 0, True), (0.4, 0, True), (-0.5, 0, False), (0, 0.019, True), (0, 0.021, False)],
)
def test_success_is_the_longest_edge_at_the_wall(name, yaw, off, success):
    task = PushRealTask(name)
    made = task.scene({})
    y = WALL_Y - printed("objects", name).ahead - off
    state = made.pack(object={"position": (0, y, 0.015), "yaw": yaw})
    assert task.succeeded({}).contains(made, state) == success


def test_an_object_is_captured_ahead_of_the_effector_and_not_beside_or_behind_it():
    task = PushRealTask("rectangle", "round")
    made = task.scene({})
    moving = {"position": (0, 0, 0.016), "velocity": (0, 0.06, 0)}
    for at, inside in (((0, 0.05), True), ((0.06, 0.05), False), ((0, -0.02), False)):
        state = made.pack(object={"position": (*at, 0.015)}, effector=moving)
        assert task.captured(state, {}).contains(made, state) == inside


def test_simulated_pushes_begin_close_behind_the_object_and_are_the_same_for_a_seed():
    for name, tool in (("concave", "round"), ("irregular", "jaw")):
        task = PushRealTask(name, tool)
        first, again = task.rollout(3), task.rollout(3)
        assert np.array_equal(first.states, again.states)
        gap = em.World(task.scene({})).distance(first.states[0], "object", "effector")
        assert 0 < gap <= 0.005


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"object": "cube"}, "object is 'cube', expected 'rectangle' or"),
        ({"tool": "fork"}, "tool is 'fork', expected 'jaw' or 'round'"),
    ],
)
def test_wrong_parameters_are_named(parameters, message):
    with pytest.raises(ValueError, match=message):
        em.tasks.make("push-real", **parameters)


def test_the_recordings_are_there_with_a_verdict_each_and_both_verdicts_in_each_combination():
    labels = em.recordings.read_labels(data_file("push_real/labels.csv"))
    assert len(labels) == 120
    for combination in COMBINATIONS:
        own = [labels[f"{combination}-{number:02}.csv"] for number in range(12)]
        assert 0 < sum(own) < 12
    recording = em.recordings.read_csv(data_file("push_real/triangle-round-04.csv"))
    assert len(recording) == 100 and np.diff(recording.times).mean() == pytest.approx(1 / 33, 0.01)


def test_the_stand_in_records_pushes_by_an_arm_that_misses_its_commands_by_5_to_8_mm(tmp_path):
    made = recorder()
    arm = made.Arm(np.random.default_rng(1))
    missed = [np.linalg.norm(arm.reached(np.array([0.1, 0.2]))[:2] - [0.1, 0.2]) for _ in range(50)]
    assert min(missed) >= 0.005 and max(missed) <= 0.008
    body, tool = printed("objects", "convex"), printed("effectors", TOOLS[1])
    rows = made.push(body, tool, 0.01, np.random.default_rng([0, 1]))
    again = made.push(body, tool, 0.01, np.random.default_rng([0, 1]))
    assert np.array_equal(rows, again)
    made.write(tmp_path / "push.csv", made.seen(rows, np.random.default_rng(2)))
    with (tmp_path / "push.csv").open() as file:
        assert len(list(csv.reader(file))) == 101
    recording = em.recordings.read_csv(tmp_path / "push.csv")
    assert np.abs(recording.object.poses - rows[:, 1:4])[:, :2].max() < 0.002
    placed = em.recordings.placed(recording, PushRealTask("convex", "round").scene({}))
    assert placed.moved.max() < 0.004
