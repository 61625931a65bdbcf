"""Bags of ROS: their poses are those of the recording, or are refused with what is there."""

import re

import numpy as np
import pytest
from bags import EPOCH, header, message, turned, write_bag
from command_line import run_here
from recorded import poses_of, push, write

import energymargin as em
from energymargin import datasets
from energymargin.recordings import bag_topics, read_bag, read_csv

pytest.importorskip("rosbags")

POSE = "geometry_msgs/msg/PoseStamped"
TRANSFORM = "geometry_msgs/msg/TransformStamped"
TF = "tf2_msgs/msg/TFMessage"
ODOMETRY = "nav_msgs/msg/Odometry"
TOPICS = {"object": "/box/pose", "effector": "/tool/pose"}


def at(columns, body, k):
    return [float(columns[f"{body}_{axis}"][k]) for axis in ("x", "y", "yaw")]


def messages(columns, body, topic, kind=POSE, *, delay=0.0, **how):
    """Of a body's poses, logged `delay` after their stamps [s]."""
    return [
        (topic, kind, EPOCH + t + delay, message(kind, EPOCH + t, *at(columns, body, k), **how))
        for k, t in enumerate(columns["time"].tolist())
    ]


def both(columns, **how):
    return [
        *messages(columns, "object", TOPICS["object"], **how),
        *messages(columns, "effector", TOPICS["effector"], **how),
    ]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.mcap"


@pytest.fixture
def columns():
    return poses_of(push(frames=60))


def motion(recording):
    """Poses and velocities of both bodies, shape (K, 12); angles within a turn."""
    own = [a for b in (recording.object, recording.effector) for a in (b.poses, b.velocities)]
    table = np.concatenate(own, axis=1)
    table[:, [2, 8]] = np.unwrap(table[:, [2, 8]], axis=0)
    return table


def test_a_bag_and_a_csv_file_of_the_same_poses_are_the_same_recording(path, columns, tmp_path):
    recording = read_bag(write_bag(path, both(columns)), **TOPICS)
    same = read_csv(write(tmp_path / "a.csv", columns))
    assert recording.name == "a.mcap" and str(recording.repairs) == "nothing repaired"
    assert np.allclose(recording.times, columns["time"], atol=1e-8)
    assert np.allclose(motion(recording)[:, [0, 1, 6, 7]], motion(same)[:, [0, 1, 6, 7]], atol=1e-5)
    assert np.allclose(motion(recording)[:, 2] % (2 * np.pi), columns["object_yaw"], atol=1e-3)
    assert np.allclose(recording.object.velocities, same.object.velocities, atol=1e-3)


@pytest.mark.parametrize(
    "kind", [POSE, "geometry_msgs/msg/PoseWithCovarianceStamped", TRANSFORM, TF, ODOMETRY]
)
def test_every_type_with_a_pose_is_read(path, columns, kind):
    bag = [
        *messages(columns, "object", "/object", kind, child="box"),
        *messages(columns, "effector", "/effector"),
    ]
    recording = read_bag(
        write_bag(path, bag), object="/object", effector="/effector", smooth_poses=False
    )
    assert np.allclose(recording.object.poses[:, 0], columns["object_x"], atol=1e-9)


@pytest.mark.parametrize("name", ["a.db3", "a.bag", "folder"])
def test_sqlite3_and_ros_1_and_folders_are_read_as_mcap_is(path, columns, name):
    wanted = read_bag(write_bag(path, both(columns)), **TOPICS)
    read = read_bag(write_bag(path.with_name(name), both(columns)), **TOPICS)
    assert read.name == name and bag_topics(path.with_name(name)) == bag_topics(path)
    assert np.array_equal(motion(read), motion(wanted))
    assert np.array_equal(read.times, wanted.times)


def test_frames_of_one_topic_are_told_apart_by_their_names(path, columns):
    bag = [
        *messages(columns, "object", "/tf", TF, child="box"),
        *messages(columns, "effector", "/tf", TF, child="tool0"),
        *messages(columns, "effector", "/tf", TF, child="tool0"),  # again, as /tf does
    ]
    write_bag(path, bag)
    recording = read_bag(path, object="/tf:box", effector="/tf:tool0", smooth_poses=False)
    assert np.allclose(recording.object.poses[:, 1], columns["object_y"], atol=1e-9)
    assert np.allclose(recording.effector.poses[:, 1], columns["effector_y"], atol=1e-9)
    with pytest.raises(ValueError, match=r"topic '/tf' has the frames box, tool0, .* '/tf:box'"):
        read_bag(path, object="/tf", effector="/tf:tool0")
    with pytest.raises(ValueError, match="has the frames box, tool0, expected one of them"):
        read_bag(path, object="/tf:cup", effector="/tf:tool0")


def test_the_frames_are_those_of_the_slower_body_and_the_other_is_interpolated(path):
    slow, fast = push(frames=40, rate=20.0), push(frames=1000, rate=500.0)
    bag = [
        *messages(slow, "object", TOPICS["object"]),
        *messages(fast, "effector", TOPICS["effector"], delay=0.01),
    ]
    recording = read_bag(write_bag(path, bag), **TOPICS, smooth_poses=False)
    assert np.allclose(recording.times, slow["time"][: len(recording)], atol=1e-8)
    ours = slow["effector_x"][: len(recording)]
    assert np.allclose(recording.effector.poses[:, 0], ours, atol=1e-8)


def test_a_body_without_messages_for_a_while_is_not_interpolated_beyond_the_longest_gap(
    path, columns
):
    gap = [
        m for m in both(columns) if not (m[0] == TOPICS["effector"] and 0.5 < m[2] - EPOCH < 0.9)
    ]
    write_bag(path, gap)
    with pytest.raises(ValueError, match=r"the effector was not seen for 0.4\d+ s"):
        read_bag(path, **TOPICS)
    filled = read_bag(path, **TOPICS, longest_gap=0.5)
    assert len(filled) == len(columns["time"])


def test_a_tool_that_points_down_turns_as_its_heading_does(path, columns):
    bag = [
        *messages(columns, "object", TOPICS["object"]),
        *messages(columns, "effector", TOPICS["effector"], hanging=True),
    ]
    recording = read_bag(write_bag(path, bag), **TOPICS, smooth_poses=False)
    assert np.allclose(recording.effector.poses[:, 2], columns["effector_yaw"], atol=1e-9)


def test_messages_without_a_stamp_have_the_time_of_the_log(path, columns):
    bag = both(columns)
    for *_, content in bag:
        content["header"] = header(0.0)
    recording = read_bag(write_bag(path, bag), **TOPICS)
    assert np.allclose(recording.times, columns["time"], atol=1e-6)


def test_the_folder_of_a_bag_is_read_file_by_file(tmp_path, columns):
    folder = tmp_path / "run_1"
    folder.mkdir()
    bag = sorted(both(columns), key=lambda one: one[2])
    for k in range(12):  # run_1_10 comes after run_1_9
        write_bag(folder / f"run_1_{k}.mcap", bag[10 * k : 10 * k + 10])
    recording = read_bag(folder, **TOPICS)
    assert recording.name == "run_1" and len(recording) == len(columns["time"])
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(ValueError, match=r"no metadata.yaml and no file of a bag"):
        read_bag(empty, **TOPICS)


def test_the_poses_frame_is_turned_into_the_scene_s(path, columns):
    write_bag(path, both(columns))
    recording = read_bag(path, **TOPICS, origin=(1, 2, np.pi / 2), smooth_poses=False)
    assert np.allclose(recording.object.poses[:, 0], 1 - columns["object_y"], atol=1e-9)


def test_a_topic_that_is_not_there_is_refused_with_those_that_are(path, columns):
    bag = [*both(columns), ("/note", "std_msgs/msg/String", EPOCH, {"data": "hello"})]
    write_bag(path, bag)
    assert list(bag_topics(path)) == ["/box/pose", "/tool/pose", "/note"]
    listed = re.escape(f"/box/pose ({POSE}), /tool/pose ({POSE}), /note (std_msgs/msg/String)")
    with pytest.raises(ValueError, match=f"there is no topic '/cup', .*; its topics are {listed}"):
        read_bag(path, object="/cup", effector="/tool/pose")
    with pytest.raises(ValueError, match=r"topic '/note' is of std_msgs/msg/String, expected one"):
        read_bag(path, object="/note", effector="/tool/pose")
    with pytest.raises(ValueError, match=r"topic '/box/pose' has the frames none, expected"):
        read_bag(path, object="/box/pose:box", effector="/tool/pose")
    with pytest.raises(ValueError, match="object is '', expected a topic"):
        read_bag(path, object="", effector="/tool/pose")
    with pytest.raises(ValueError, match="object and effector are both '/box/pose'"):
        read_bag(path, object="/box/pose", effector="/box/pose")


def changed(k, change):
    """Changes the pose of the object's message k, from 0 on."""

    def apply(bag):
        change(bag[k][3]["pose"])

    return apply


def refer(frame):
    def apply(bag):
        for topic, *_, content in bag:
            if topic == TOPICS["object"]:
                content["header"]["frame_id"] = frame

    return apply


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            changed(4, lambda pose: pose["orientation"].update(w=3.0)),
            r", message 5: the object at \(.*\) has an orientation that is no unit quaternion",
        ),
        (
            changed(7, lambda pose: pose.update(orientation={"x": 1, "y": 0, "z": 0, "w": 0})),
            r", message 8: the object at \(.*\) tilts by more than 11 deg",
        ),
        (
            changed(9, lambda pose: pose["position"].update(z=0.2)),
            r", message 10: the object at \(.*, 0\.2, .*\) is more than 0\.05 m above or below",
        ),
        (
            changed(3, lambda pose: pose["position"].update(x=80.0)),
            r", message 4: object_x is 80 m, .*\. Poses are in m and quaternions",
        ),
        (
            refer("camera"),
            ": its poses are in the frames 'camera', 'world', expected those of both",
        ),
        (
            lambda bag: bag[5][3]["header"].update(frame_id="map"),
            ": its poses are in the frames 'map', 'world', expected those of both",
        ),
        (lambda bag: bag.__delitem__(slice(3, 60)), ": has 3 rows, expected at least 7"),
    ],
)
def test_what_is_no_motion_in_a_plane_is_refused_with_its_message(path, columns, change, words):
    bag = both(columns)
    change(bag)
    with pytest.raises(ValueError, match=f"{re.escape(str(path))}{words}"):
        read_bag(write_bag(path, bag), **TOPICS)


def test_poses_of_nan_were_not_seen_and_are_filled(path, columns):
    bag = both(columns)
    for k in (20, 21):
        bag[k][3]["pose"]["position"]["x"] = float("nan")
    recording = read_bag(write_bag(path, bag), **TOPICS)
    assert recording.repairs.unseen == {"object": (20, 21)}
    assert np.allclose(recording.object.poses[:, 0], columns["object_x"], atol=1e-3)


def test_a_file_that_is_no_bag_or_was_cut_is_refused(path, columns):
    path.write_text("frame,time\n")
    with pytest.raises(ValueError, match=r"a.mcap: .*expected a whole bag"):
        read_bag(path, **TOPICS)
    write_bag(path, both(columns))
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ValueError, match=r"a.mcap: .*expected a whole bag"):
        read_bag(path, **TOPICS)
    with pytest.raises(FileNotFoundError):
        read_bag(path.with_name("absent.mcap"), **TOPICS)


@pytest.mark.parametrize("every", [1, 2])
def test_zeros_of_a_tracker_that_lost_a_body_are_not_seen(path, columns, every):
    """Of the body that gives the frames, and of the one that is interpolated between them."""
    nothing = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": turned(0.0)}
    object_bag = messages(columns, "object", TOPICS["object"])[::every]
    effector_bag = messages(columns, "effector", TOPICS["effector"])
    for own in (object_bag[20], effector_bag[30], effector_bag[31]):
        own[3]["pose"] = nothing
    read = read_bag(write_bag(path, [*object_bag, *effector_bag]), **TOPICS, longest_gap=0.2)
    assert read.repairs.unseen == {"object": (20,)}
    for body, motion in (("object", read.object), ("effector", read.effector)):
        assert np.allclose(motion.poses[:, 1], columns[f"{body}_y"][::every], atol=1e-3)


def test_lengths_that_no_file_has_are_refused_by_the_file_s_name_or_are_not_read(path, columns):
    """Of records at the end, which are read first: 2^64 - 1 bytes."""
    raw = write_bag(path, both(columns)).read_bytes()
    whole = read_bag(path, **TOPICS)
    refused = 0
    for k in range(len(raw) - 120, len(raw) - 8):
        path.write_bytes(raw[:k] + b"\xff" * 8 + raw[k + 8 :])
        try:
            read = read_bag(path, **TOPICS)
        except ValueError as error:
            assert str(path) in str(error)
            refused += 1
        else:
            assert np.array_equal(motion(read), motion(whole))
    assert refused > 10


def test_a_clock_that_is_set_back_is_refused_with_its_message(path, columns):
    bag = both(columns)
    for k in range(40, len(columns["time"])):
        stamp = bag[k][3]["header"]["stamp"]
        stamp["sec"] -= 1
    with pytest.raises(
        ValueError, match=r", message 41: the time of the object is .* expected it to rise"
    ):
        read_bag(write_bag(path, bag), **TOPICS)


def scalar_first(turn):
    """The numbers of a quaternion in the order w, x, y, z, read as x, y, z, w."""
    return {"x": turn["w"], "y": turn["x"], "z": turn["y"], "w": turn["z"]}


def test_quaternions_with_w_first_that_turn_are_refused_with_the_reason(path, columns):
    columns["object_yaw"] = np.linspace(0.0, 1.0, len(columns["time"]))
    bag = both(columns)
    for k in range(len(columns["time"])):
        own = bag[k][3]["pose"]
        own["orientation"] = scalar_first(own["orientation"])
    with pytest.raises(
        ValueError, match=r"the object at .* tilts .* is w first in its quaternions\?"
    ):
        read_bag(write_bag(path, bag), **TOPICS)


def test_the_command_makes_a_dataset_of_bags(tmp_path, columns):
    """A push of the task push-real, whose object is far from the wall."""
    far = {**columns, "object_y": columns["object_y"], "effector_y": columns["effector_y"] - 0.05}
    write_bag(tmp_path / "a.mcap", both(far))
    (tmp_path / "labels.csv").write_text("recording,success\na.mcap,1\n")
    words = ("import", "a.mcap", "--task", "push-real", "--labels", "labels.csv", "-o", "a.h5")
    done = run_here(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert "expected --object-topic and --effector-topic" in " ".join(done.stderr.split())
    assert "/box/pose (geometry_msgs/msg/PoseStamped)" in " ".join(done.stderr.split())
    topics = ("--object-topic", "/box/pose", "--effector-topic", "/tool/pose")
    done = run_here(*words, *topics, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (made,) = datasets.load(tmp_path / "a.h5").trajectories
    assert made.success and len(made) == 60
    (tmp_path / "columns.json").write_text('{"units": {"length": "mm"}}')
    done = run_here(*words, *topics, "--columns", "columns.json", "--overwrite", cwd=tmp_path)
    assert done.returncode == 2 and "expected the origin alone" in " ".join(done.stderr.split())


def test_a_turn_of_a_tool_that_hangs_is_that_of_its_x_axis():
    quaternion = turned(0.3, hanging=True)
    x, y, z, w = (quaternion[name] for name in "xyzw")
    axis = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]
    assert np.allclose(axis, [np.cos(0.3), np.sin(0.3), 0.0])


def stamped(columns, clocks):
    """Messages of both bodies, logged at the wall's time, stamped by a clock of their own."""
    found = []
    for body, clock in clocks.items():
        for k, t in enumerate((columns["time"] - columns["time"][0]).tolist()):
            own = message(POSE, clock(t), *at(columns, body, k))
            found.append((TOPICS[body], POSE, EPOCH + t, own))
    return found


def test_a_stamp_of_0_that_the_others_go_on_from_is_a_time(path, columns):
    write_bag(path, stamped(columns, {body: lambda t: t for body in TOPICS}))
    recording = read_bag(path, **TOPICS)
    assert len(recording.times) == 60


def test_stamps_of_0_before_a_simulations_clock_begins_are_left_out_and_told(path, columns):
    write_bag(
        path, stamped(columns, {body: lambda t: t + 10 if t > 0.2 else 0.0 for body in TOPICS})
    )
    with pytest.warns(em.PlausibilityWarning, match=r"7 messages of '/box/pose' have a stamp of 0"):
        recording = read_bag(path, **TOPICS)
    assert len(recording.times) == 53
    with pytest.raises(ValueError, match=r"stamp of 0, .* repair=False forbids"):
        read_bag(path, **TOPICS, repair=False)


def test_topics_whose_times_have_nothing_in_common_are_refused(path, columns):
    write_bag(path, stamped(columns, {"object": lambda t: t + 10, "effector": lambda t: EPOCH + t}))
    with pytest.raises(ValueError, match=r"nothing in common, .* is one of them in simulated time"):
        read_bag(path, **TOPICS)


def test_topics_whose_clocks_differ_are_told(path, columns):
    write_bag(
        path,
        stamped(columns, {"object": lambda t: EPOCH + t, "effector": lambda t: EPOCH + t - 0.7}),
    )
    with pytest.warns(em.PlausibilityWarning, match=r"0 s after .* 0\.7 s: do their clocks differ"):
        read_bag(path, **TOPICS)
