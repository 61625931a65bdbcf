"""A recording is placed into a task's scene and scored as any other trajectory."""

import re

import numpy as np
import pytest
from command_line import run, run_here
from recorded import noisy, push, rows_of, write

import energymargin as em
from energymargin.recordings import (
    Motion,
    Recording,
    Repairs,
    dataset,
    placed,
    read_csv,
    read_frame_labels,
    read_labels,
)
from energymargin_paper.paper.push_real import PushRealTask

FRICTION = 0.3
FRAMES = 84  # of 2.5 s: 33 Hz
OVERLAP = 0.03  # m; of a box of 1.2 m by a camera's error of its yaw


@pytest.fixture(scope="module")
def task():
    return em.tasks.make("push", friction=FRICTION)


@pytest.fixture(scope="module")
def trajectories(task):
    return [task.rollout(seed, FRAMES) for seed in range(4)]


@pytest.fixture(scope="module")
def folder(task, trajectories, tmp_path_factory):
    """What a camera would record of simulated pushes, two frames dropped, and their labels."""
    folder = tmp_path_factory.mktemp("recordings")
    scene = task.scene({"friction": FRICTION})
    for number, trajectory in enumerate(trajectories):
        columns = {"frame": np.arange(FRAMES), "time": trajectory.times}
        for body in ("object", "effector"):
            place = trajectory.states[:, scene.slice(body)]
            columns[f"{body}_x"], columns[f"{body}_y"] = place[:, 0], place[:, 1]
            columns[f"{body}_yaw"] = 2 * np.arctan2(place[:, 5], place[:, 6])
        rows = rows_of(noisy(columns, number))
        del rows[20], rows[50]
        write(folder / f"{number}.csv", columns, rows)
    labels = [f"{k}.csv,{int(t.success)}\n" for k, t in enumerate(trajectories)]
    (folder / "labels.csv").write_text("recording,success\n" + "".join(labels))
    return folder


@pytest.fixture(scope="module")
def recordings(folder):
    return [read_csv(folder / f"{number}.csv") for number in range(4)]


@pytest.fixture(scope="module")
def recorded(task, recordings, folder):
    return dataset(task, recordings, read_labels(folder / "labels.csv"), most_overlap=OVERLAP)


def test_a_push_that_was_recorded_is_near_the_true_one(task, trajectories, recorded):
    scene = task.scene({"friction": FRICTION})
    for true, found in zip(trajectories, recorded.trajectories, strict=True):
        assert found.states.shape == true.states.shape
        for body in ("object", "effector"):
            place = scene.slice(body).start
            away = np.abs(found.states - true.states)[:, place : place + 13]
            assert np.median(away[:, :2]) < 5e-4 and np.percentile(away[:, :2], 95) < 5e-3
            assert np.median(away[:, 7:9]) < 0.02  # m/s, of pushes at 0.5 to 1.5 m/s


def test_labels_and_scores_of_a_recorded_push_are_those_of_the_true_one(trajectories, recorded):
    true = em.datasets.Dataset("push", {"friction": FRICTION}, 0, trajectories)
    same = [
        np.mean(a.captured == b.captured)
        for a, b in zip(trajectories, recorded.trajectories, strict=True)
    ]
    assert min(same) > 0.95
    assert recorded.successes.tolist() == true.successes.tolist()
    numbers = [t * FRAMES + k for t in range(4) for k in range(5, FRAMES, 13)]
    found, wanted = (
        em.score(one.problems(numbers), metrics=("capture",), nodes=100, seed=0)["capture"]
        for one in (recorded, true)
    )
    assert np.ptp(wanted) > 0.5
    assert np.mean(np.abs(found - wanted)) < 0.06 and np.corrcoef(found, wanted)[0, 1] > 0.95


def as_measured(recording, scene):
    """The state of each frame, whose bodies may overlap."""
    states = placed(recording, scene, most_overlap=OVERLAP).states
    for name, motion in (("object", recording.object), ("effector", recording.effector)):
        first = scene.slice(name).start
        states[:, first : first + 2] = motion.poses[:, :2]
    return states


def test_bodies_do_not_overlap_once_they_are_placed(task, recordings):
    scene = task.scene({"friction": FRICTION})
    world = em.World(scene)

    def deepest(states):
        pairs = (("object", "effector"), ("object", "wall"))
        return min(world.distance(state, *pair) for state in states for pair in pairs)

    parted = placed(recordings[0], scene, most_overlap=OVERLAP)
    assert deepest(as_measured(recordings[0], scene)) < -5e-4 and deepest(parted.states) > -1e-5
    assert parted.moved.max() > 5e-4


def test_a_large_overlap_is_refused_with_its_frame(task, recordings):
    scene = task.scene({"friction": FRICTION})
    with pytest.raises(
        ValueError, match=r"0\.csv, frame \d+: '\w+' overlaps others by .* = 1e-06 m"
    ):
        placed(recordings[0], scene, most_overlap=1e-6)


class Gap:
    """A task with two walls, 2 mm nearer to each other than a cube needs."""

    name = "gap"
    parameters = {}  # noqa: RUF012

    def scene(self, params):
        scene = em.Scene()
        for x in (0.901, 1.099):
            scene.add_body(f"wall {x}", em.Box((0.1, 1, 1)), mass=0, position=(x, 0, 0.5))
        for name in ("object", "effector"):
            scene.add_body(name, em.Box((0.1,) * 3), mass=1, position=(0, 0, 0.05), role=name)
        return scene

    def captured(self, state, params):
        return em.regions.HalfSpace("object", (1.0, 0, 0), 2.0)


def in_gap(*places):
    """A recording of a cube at these places along x; its tool is far away."""
    frames = len(places)
    poses = np.zeros((2, frames, 3))
    poses[0, :, 0], poses[1, :, 0] = places, -1.0
    motions = [Motion(own, np.zeros((frames, 3))) for own in poses]
    return Recording(
        "a.csv",
        np.arange(frames),
        np.arange(frames) / 30,
        dict(zip(("object", "effector"), motions, strict=True)),
        Repairs(),
    )


def test_a_frame_without_a_place_stays_as_measured_and_is_counted():
    recording, told = in_gap(0.0, 1.0, 0.5), []
    found = placed(recording, Gap().scene({}))
    assert found.stuck.tolist() == [False, True, False] and not found.moved.any()
    assert found.states[1, 0] == 1.0
    made = dataset(Gap(), [recording], {"a.csv": True}, notice=told.append)
    assert made.size == 3
    assert told == [
        "a.csv: in 0 of 3 frames bodies overlapped and were moved apart, by at most 0 mm; "
        "1 found no place and stay as measured"
    ]
    with pytest.raises(ValueError, match=r"a.csv, frame 0: .*so it is in every frame: do the sha"):
        placed(in_gap(1.0, 1.0), Gap().scene({}))


def test_bodies_that_are_none_of_the_scene_are_refused(task, recordings):
    scene = task.scene({"friction": FRICTION})
    for body, message in (("box", "box"), ("wall", "'wall' is fixed"), ("effector", "both 'eff")):
        with pytest.raises(ValueError, match=message):
            placed(recordings[0], scene, object=body)
    tilted = em.Scene()
    tilted.add_body("object", em.Box((1, 1, 1)), mass=1, orientation=(0.6, 0, 0, 0.8))
    tilted.add_body("effector", em.Sphere(0.1), mass=1)
    with pytest.raises(ValueError, match="'object' is tilted in the scene"):
        placed(recordings[0], tilted)


def test_heights_are_those_of_the_scene_and_rates_those_of_the_recording(tmp_path):
    scene = em.Scene()
    scene.add_body("part", em.Box((0.05, 0.05, 0.03)), mass=0.04, position=(0, 0, 0.015))
    scene.add_body("tool", em.Sphere(0.01), mass=0.03, position=(0, 0, 0.02))
    recording = read_csv(write(tmp_path / "a.csv", push()))
    state = scene.unpack(placed(recording, scene, object="part", effector="tool").states[10])
    true = {name: values[10] for name, values in push().items()}
    part = state["part"]
    assert np.allclose(part["position"], (true["object_x"], true["object_y"], 0.015), atol=1e-6)
    assert np.cos(part["yaw"] - true["object_yaw"]) == pytest.approx(1)
    assert np.allclose(part["velocity"], (true["object_vx"], true["object_vy"], 0), atol=1e-6)
    assert np.allclose(part["angular_velocity"], (0, 0, true["object_yaw_rate"]), atol=1e-6)
    assert state["tool"]["position"][2] == 0.02


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "labels.csv: is empty; expected a CSV file"),
        ("recording,success\n", "has no labels"),
        ("name,success\na.csv,1\n", "line 1: the header is name,success, expected recording,succ"),
        (
            "recording,success\na.csv,1\n\nb.csv,maybe\n",
            "line 4: has 'b.csv,maybe', expected",
        ),
        (
            "recording,success\na.csv,1\na.csv,0\n",
            "line 3: has 'a.csv,0', expected",
        ),
        ("recording,success\na.csv\n", "line 2: has 1 cells, expected 2"),
        ("recording,success\n,1\n", "line 2: has ',1', expected"),
    ],
)
def test_wrong_labels_are_refused_with_their_line(tmp_path, text, message):
    path = tmp_path / "labels.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=re.escape(message)):
        read_labels(path)


def test_labels_are_words_or_digits(tmp_path):
    (tmp_path / "labels.csv").write_text("recording,success\na,1\nb,No\nc,true\nd,FALSE\n")
    assert read_labels(tmp_path / "labels.csv") == {"a": True, "b": False, "c": True, "d": False}


def test_each_recording_has_a_label_and_a_name_of_its_own(task, recordings):
    labels = {f"{number}.csv": True for number in range(4)}
    with pytest.raises(ValueError, match=r"lacks '2\.csv', expected each"):
        dataset(task, recordings, {k: v for k, v in labels.items() if k != "2.csv"})
    with pytest.raises(ValueError, match=r"two recordings are named '0\.csv'"):
        dataset(task, [*recordings, recordings[0]], labels)


def test_labels_of_frames_come_from_a_file(task, recordings, tmp_path):
    path = tmp_path / "captured.csv"
    seen = [k for k in range(FRAMES) if k not in (20, 51)]
    lines = [f"0.csv,{k},{int(k < 21)}" for k in seen]
    path.write_text("\n".join(["recording,frame,captured", *lines]))
    labelled = dataset(
        task,
        recordings[:1],
        {"0.csv": True},
        captured=read_frame_labels(path),
        most_overlap=OVERLAP,
    )
    assert labelled.trajectories[0].captured.tolist() == [k < 21 for k in range(FRAMES)]
    for change, message in (
        (lines[1:], r"captured lacks frame 0 of '0\.csv'"),
        ([*lines, "0.csv,3,1"], "line 84: has '0.csv,3,1', expected"),
        ([*lines, "0.csv,x,1"], "line 84: has '0.csv,x,1', expected"),
    ):
        path.write_text("\n".join(["recording,frame,captured", *change]))
        with pytest.raises(ValueError, match=message):
            dataset(
                task,
                recordings[:1],
                {"0.csv": True},
                captured=read_frame_labels(path),
                most_overlap=OVERLAP,
            )


def test_a_task_without_what_recordings_need_is_refused(recordings):
    labels = {"0.csv": True}
    with pytest.raises(ValueError, match=r"'push' draws its friction for each .* friction=0\.3"):
        dataset("push", recordings[:1], labels)
    made = dataset("push", recordings[:1], labels, params={"friction": 0.3}, most_overlap=OVERLAP)
    assert made.trajectories[0].params == {"friction": 0.3}
    with pytest.raises(ValueError, match=r"no 'object': object=NAME .* one of table, disc_0"):
        dataset("push-multi", recordings[:1], labels, params={"friction": 0.3})


def test_the_commands_lead_from_recordings_to_a_table(folder):
    options = ("--task", "push", "-p", "friction=0.3", "--labels", "labels.csv")
    files = [f"{number}.csv" for number in range(4)]
    wide = ("--most-overlap", OVERLAP)
    done = run("import", *files, *options, *wide, "-o", "recorded.h5", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "0.csv: 84 frames, 2.5 s; 2 missing frames filled" in done.stderr
    assert re.search(r"0\.csv: in \d+ of 84 frames bodies overlapped .* at most \d", done.stderr)
    assert "Wrote 4 trajectories" in done.stderr
    assert "Next: energymargin score recorded.h5" in done.stderr
    done = run_here("score", "recorded.h5", "--metrics", "force,success", "--nodes", 2, cwd=folder)
    assert done.returncode == 0 and "336 states are scored" in done.stderr, done.stderr
    assert run_here("evaluate", "recorded-scores.db", cwd=folder).returncode == 0

    again = run_here("import", *files, *options, "-o", "recorded.h5", cwd=folder)
    assert again.returncode == 2 and "recorded.h5 exists" in again.stderr
    fewer = run_here("import", "1.csv", *options, *wide, "-o", "one.h5", cwd=folder)
    assert fewer.returncode == 0, fewer.stderr  # labels of other recordings do not count
    strict = run_here("import", *files, *options, "--no-repair", "-o", "b.h5", cwd=folder)
    assert strict.returncode == 2 and "0.csv, line 22: frame 20 needs repair" in strict.stderr
    assert not (folder / "b.h5").exists()


def test_small_hulls_in_one_another_have_no_contact_deeper_than_they_overlap():
    """Where a jaw grips a corner: Bullet tilts small hulls so far that it finds 11 mm there."""
    task = PushRealTask("triangle", "jaw")
    recording = read_csv(em.scenes.data_file("push_real/triangle-jaw-10.csv"))
    scene = task.scene({})
    world = em.World(scene)
    for measured in as_measured(recording, scene)[73:76]:
        overlap = -world.distance(measured, "object", "effector")
        depths = [
            -contact.distance
            for contact in world.contacts(measured)
            if {contact.body_a, contact.body_b} == {"object", "effector"}
        ]
        assert overlap > 1e-4 and overlap == pytest.approx(max(depths), rel=0.1)
    assert placed(recording, scene).moved.max() < 0.003


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "has the body 'object', and the scene has no 'object': object=NAME says"),
        ({"object": "mog"}, "has no 'mog': object=NAME says how it is called there, one of mug"),
        ({"object": "mug"}, "has the body 'effector', .* effector=NAME says .* one of mug"),
    ],
)
def test_a_body_that_the_scene_calls_otherwise_is_named_with_its_argument(
    recordings, given, message
):
    scene = em.Scene()
    scene.add_body("mug", em.Box((0.1, 0.1, 0.1)), mass=0.2, role="object")
    with pytest.raises(ValueError, match=message):
        placed(recordings[0], scene, **given)
