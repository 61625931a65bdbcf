"""A recording of several bodies in space: one table, from a file or from pandas."""

import numpy as np
import pandas as pd
import pytest
from bags import EPOCH, header, write_bag
from command_line import run_here
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.recordings import dataset, from_table, placed, read_bag, read_csv
from energymargin.tasks.from_problem import ProblemTask

FRAMES, RATE = 60, 60.0
RATES = {"cup": (0.3, 2.0, -1.0), "plate": (0.0, 0.0, 0.8), "tool": (-1.5, 0.4, 0.6)}  # rad/s
SPEEDS = {"cup": (0.05, 0.0, 0.02), "plate": (0.0, 0.0, 0.0), "tool": (0.0, -0.1, 0.05)}  # m/s
STARTS = {"cup": (0.0, 0.0, 0.5), "plate": (0.3, 0.0, 0.2), "tool": (0.0, 0.4, 0.6)}
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
TURN = [f"cup_q{axis}" for axis in "xyzw"]


def moving():
    """By column: three bodies with steady velocities, each turning about an axis of its own; their
    quaternions change their sign now and then, as those of trackers do."""
    time = np.arange(FRAMES) / RATE
    columns = {"time": time}
    for k, body in enumerate(RATES):
        turns = Rotation.from_rotvec(time[:, None] * RATES[body]) * Rotation.from_euler("y", k)
        signs = np.where(np.arange(FRAMES) % 7 < 3, -1.0, 1.0)[:, None]
        places = np.array(STARTS[body]) + time[:, None] * SPEEDS[body]
        poses = np.hstack([places, signs * turns.as_quat()])
        columns |= {f"{body}_{axis}": own for axis, own in zip(POSE, poses.T, strict=True)}
    return columns


def scene():
    made = em.Scene(gravity=(0, 0, 0))
    for body, role in (("cup", "object"), ("plate", "object"), ("tool", "effector")):
        shape = em.Box((0.05, 0.04, 0.03))
        made.add_body(body, shape, mass=0.1, position=STARTS[body], role=role)
    return made


def own_problem():
    made, cup = scene(), em.regions.HalfSpace("cup", (1, 0, 0), 0.06)
    bounds = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1}
    return em.Problem(made, made.pack(), captured=cup, **bounds)


@pytest.fixture
def path(tmp_path):
    pd.DataFrame(moving()).to_csv(tmp_path / "a.csv", index=False)
    return tmp_path / "a.csv"


def require_the_motion(states, times):
    """States of the scene have the poses that were recorded, and the velocities behind them."""
    columns = moving()
    for k, time in enumerate(times):
        row = int(np.argmin(np.abs(columns["time"] - time)))
        for body, own in scene().unpack(states[k]).items():
            wanted = [columns[f"{body}_{axis}"][row] for axis in POSE]
            assert own["position"] == pytest.approx(wanted[:3], abs=1e-6)
            turn = Rotation.from_quat(own["orientation"]) * Rotation.from_quat(wanted[3:]).inv()
            assert turn.magnitude() < 1e-3
            assert own["velocity"] == pytest.approx(SPEEDS[body], abs=1e-6)
            assert own["angular_velocity"] == pytest.approx(RATES[body], abs=5e-3)


def test_three_bodies_in_space_become_states_with_their_poses_and_velocities_and_a_score(
    path, tmp_path
):
    own_problem().save(tmp_path / "P.json")
    recording = read_csv(path)
    assert list(recording.bodies) == ["cup", "plate", "tool"]
    made = dataset(ProblemTask(str(tmp_path / "P.json")), [recording], {"a.csv": True})
    (trajectory,) = made.trajectories
    require_the_motion(trajectory.states[5:-5], trajectory.times[5:-5])
    chosen = made.problems([30])[0].replace(horizon=0.3)
    found = em.capture_probability(chosen, rollouts=20, seed=0)
    assert 0.0 <= found.captured <= 1.0
    still = chosen.replace(state=scene().pack())
    assert em.capture_probability(still, rollouts=20, seed=0).captured > found.captured


def test_angular_velocities_are_the_finite_differences_of_the_rotations(path):
    motion = read_csv(path).bodies["tool"]
    turns = Rotation.from_quat(motion.poses[:, 3:])
    between = (turns[2:] * turns[:-2].inv()).as_rotvec() * RATE / 2
    assert motion.velocities[1:-1, 3:] == pytest.approx(between, abs=1e-3)


def test_a_table_of_pandas_is_the_recording_of_its_file(path):
    read, same = read_csv(path), from_table(pd.read_csv(path), name="a.csv")
    assert same.name == "a.csv"
    for body, motion in read.bodies.items():
        assert np.array_equal(motion.poses, same.bodies[body].poses)
        assert np.array_equal(motion.velocities, same.bodies[body].velocities)
    table = pd.read_csv(path)
    table.loc[20, "cup_qw"] += 0.1
    with pytest.raises(ValueError, match=r"table, row 20: the cup at .* no unit quaternion"):
        from_table(table)


def test_a_planar_body_beside_bodies_in_space_keeps_its_height(path):
    table = pd.read_csv(path)
    table = table.drop(columns=[f"plate_{axis}" for axis in ("z", "qx", "qy", "qz", "qw")])
    recording = from_table(table.assign(plate_yaw=0.8 * table["time"]))
    assert recording.bodies["plate"].poses.shape == (FRAMES, 3)
    state = scene().unpack(placed(recording, scene()).states[30])
    assert state["plate"]["position"] == pytest.approx((0.3, 0.0, 0.2))
    assert state["plate"]["angular_velocity"] == pytest.approx((0, 0, 0.8), abs=1e-6)


def test_markers_that_jump_or_are_lost_in_space_are_replaced(path):
    table = pd.read_csv(path)
    turned = Rotation.from_euler("x", 0.5) * Rotation.from_quat(table.loc[20, TURN])
    table.loc[20, TURN] = turned.as_quat()
    table.loc[30, ["plate_z"]] += 0.05
    table.loc[40, [f"tool_{axis}" for axis in POSE]] = (0, 0, 0, 0, 0, 0, 1)
    recording = from_table(table)
    assert recording.repairs.outliers == {"cup": (20,), "plate": (30,)}
    assert recording.repairs.unseen == {"tool": (40,)}
    states = placed(recording, scene()).states
    require_the_motion(states[5:-5], recording.times[5:-5])


def test_velocities_in_the_file_are_taken_or_contradict_the_rotations(path):
    table = pd.read_csv(path)
    for letter, given in (("v", SPEEDS), ("w", RATES)):
        for body, own in given.items():
            table[[f"{body}_{letter}{axis}" for axis in "xyz"]] = own
    motion = from_table(table).bodies["cup"]
    assert np.array_equal(motion.velocities[7], (*SPEEDS["cup"], *RATES["cup"]))
    table["tool_wx"] *= -1
    with pytest.raises(ValueError, match="tool_wx, tool_wy, tool_wz contradict the poses"):
        from_table(table)


def test_the_camera_s_frame_turns_poses_and_velocities_in_space(path):
    plain = read_csv(path).bodies["tool"]
    turned = read_csv(path, origin=(1, 2, np.pi / 2)).bodies["tool"]
    assert turned.poses[:, 0] == pytest.approx(1 - plain.poses[:, 1])
    assert turned.velocities[:, 3] == pytest.approx(-plain.velocities[:, 4])
    for name in ("pose_covariances", "velocity_covariances"):
        before, after = getattr(plain, name), getattr(turned, name)
        assert after[:, 3, 3] == pytest.approx(before[:, 4, 4])
    known = read_csv(path).uncertainty(30)
    assert known.pose["tool"] == pytest.approx(plain.pose_covariances[30])


def test_a_header_that_lacks_a_number_of_a_pose_in_space_is_refused(path):
    table = pd.read_csv(path).drop(columns="cup_z")
    table.to_csv(path, index=False)
    with pytest.raises(ValueError, match="line 1: the header lacks 'cup_z'"):
        read_csv(path)


def test_a_bag_has_bodies_in_space_by_their_topics(tmp_path):
    pytest.importorskip("rosbags")
    columns, kind = moving(), "geometry_msgs/msg/PoseStamped"
    bag = []
    for body in RATES:
        for k, time in enumerate(columns["time"].tolist()):
            x, y, z, *turn = (float(columns[f"{body}_{axis}"][k]) for axis in POSE)
            pose = {
                "position": {"x": x, "y": y, "z": z},
                "orientation": dict(zip("xyzw", turn, strict=True)),
            }
            message = {"header": header(EPOCH + time), "pose": pose}
            bag.append((f"/{body}", kind, EPOCH + time, message))
    write_bag(tmp_path / "a.mcap", bag)
    recording = read_bag(tmp_path / "a.mcap", bodies={body: f"/{body}" for body in RATES})
    states = placed(recording, scene()).states
    require_the_motion(states[5:-5], recording.times[5:-5])
    own_problem().save(tmp_path / "P.json")
    topics = [word for body in RATES for word in ("--topic", f"{body}=/{body}")]
    done = run_here("import", "a.mcap", "--problem", "P.json", *topics, cwd=tmp_path)
    assert done.returncode == 0 and "60 frames, 0.983 s; nothing repaired" in done.stderr
    (trajectory,) = em.datasets.load(tmp_path / "P-recorded.h5").trajectories
    assert np.array_equal(trajectory.states, states)
    wrong = run_here("import", "a.mcap", "--problem", "P.json", "--topic", "cup", cwd=tmp_path)
    assert wrong.returncode == 2


def test_of_several_objects_labels_say_whether_all_and_whether_any_are_captured(path):
    class Two:
        """The cup stays below 0.51 m, the plate anywhere."""

        name, parameters = "two", {}

        def scene(self, params):
            return scene()

        def captured(self, state, params):
            heights = {"cup": 0.51, "plate": 9.0}
            return {b: em.regions.HalfSpace(b, (0, 0, 1), most) for b, most in heights.items()}

        succeeded = captured

    (trajectory,) = dataset(Two(), [read_csv(path, causal=True)], {"a.csv": True}).trajectories
    assert len(trajectory) == FRAMES - 6 and trajectory.captured_any.all()
    assert trajectory.captured[0] and not trajectory.captured[-1]
