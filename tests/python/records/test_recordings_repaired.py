"""Frames that a camera drops or sees wrong are interpolated by stated rules, and reported."""

import numpy as np
import pytest
from recorded import noisy, poses_of, push, rows_of, write

from energymargin.recordings import Repairs, read_csv
from energymargin.records.recordings.smoothing import smoothed


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.csv"


@pytest.fixture
def columns():
    return noisy(poses_of(push()))


def largest_error(recording, frames=slice(None)):
    """Of the positions and velocities [mm and mm/s] of both bodies, at these frames."""
    true = push()
    errors = []
    for body, motion in (("object", recording.object), ("effector", recording.effector)):
        for k, axis in enumerate("xy"):
            at = recording.frames[frames]
            errors.append(motion.poses[frames, k] - true[f"{body}_{axis}"][at])
    return 1e3 * np.abs(errors).max()


def test_missing_frames_are_filled_up_to_the_longest_gap(path, columns):
    rows = rows_of(columns)
    del rows[40:42], rows[60]
    recording = read_csv(write(path, columns, rows))
    assert recording.frames.tolist() == list(range(100))
    assert recording.repairs == Repairs(missing=(40, 41, 62))
    assert np.allclose(recording.times, columns["time"], atol=1e-5)
    assert largest_error(recording, [40, 41, 62]) < 1
    with pytest.raises(
        ValueError,
        match=r"line 42: the object was not seen for 0\.0909 s, from frame 39 to 42, expected",
    ):
        read_csv(path, longest_gap=0.08)


def test_a_longer_gap_is_refused_with_the_line_after_it(path, columns):
    rows = rows_of(columns)
    del rows[40:50]
    with pytest.raises(
        ValueError, match=r"a\.csv, line 42: .* from frame 39 to 50, .* 0\.1 s: cut"
    ):
        read_csv(write(path, columns, rows))


def test_two_dropped_frames_at_30_hz_are_filled_with_times_in_milliseconds(path):
    columns = poses_of(push(rate=29.97))
    columns["time"] = np.round(columns["time"], 3)
    rows = rows_of(columns)
    del rows[40:42], rows[61:63]
    assert len(read_csv(write(path, columns, rows)).repairs.missing) == 4
    del rows[20:23]
    with pytest.raises(ValueError, match=r"from frame 19 to 23, expected at most 0\.1 s"):
        read_csv(write(path, columns, rows))


@pytest.mark.parametrize("zero", ["0", "0.000000", "-0.0"])
def test_zeros_of_a_tracker_that_lost_a_body_are_poses_not_seen(path, columns, zero):
    rows = rows_of(columns)
    for row in (*rows[:5], rows[40], rows[41]):
        row[5:8] = [zero] * 3
    recording = read_csv(write(path, columns, rows))
    assert recording.repairs == Repairs(unseen={"effector": (40, 41)}, left_out=(0, 1, 2, 3, 4))
    assert largest_error(recording, [35, 36]) < 1
    for row in rows[60:90]:
        row[5:8] = [zero] * 3
    with pytest.raises(ValueError, match=r"from frame 59 to 90, expected"):
        read_csv(write(path, columns, rows))


@pytest.mark.parametrize("speed", [0.0, 0.05, 1.0])
def test_a_body_that_is_at_the_origin_is_seen_there(path, speed):
    columns = poses_of(push())
    since = np.maximum(columns["time"] - columns["time"][30], 0.0)
    columns |= {"object_x": speed * since, "object_y": 0 * since, "object_yaw": 0 * since}
    assert read_csv(write(path, columns)).repairs == Repairs()


@pytest.mark.parametrize("cell", ["", "nan", "NaN"])
def test_poses_that_were_not_seen_are_filled(path, columns, cell):
    rows = rows_of(columns)
    rows[30][2] = cell
    rows[50][5:8] = [cell] * 3
    rows[51][6] = cell
    recording = read_csv(write(path, columns, rows))
    assert recording.repairs == Repairs(unseen={"object": (30,), "effector": (50, 51)})
    assert str(recording.repairs) == (
        "1 poses of the object not seen, filled, 2 poses of the effector not seen, filled"
    )
    assert recording.repairs.frames == (30, 50, 51)
    assert largest_error(recording, [30, 50, 51]) < 1


def test_a_body_that_is_not_seen_for_long_is_refused(path, columns):
    rows = rows_of(columns)
    for row in rows[30:34]:
        row[5] = "nan"
    with pytest.raises(ValueError, match=r"line 36: the effector was not seen for 0\.152 s, from"):
        read_csv(write(path, columns, rows))


def test_frames_at_the_ends_without_both_bodies_are_left_out(path, columns):
    rows = rows_of(columns)
    for row in rows[:8]:
        row[2] = ""
    rows[99][7] = ""
    recording = read_csv(write(path, columns, rows))
    assert recording.frames.tolist() == list(range(8, 99))
    assert recording.repairs == Repairs(left_out=(*range(8), 99))


@pytest.mark.parametrize(
    ("column", "jump"),
    [("object_x", 0.02), ("effector_y", -0.3), ("object_yaw", 0.3), ("object_yaw", 3.0)],
)
@pytest.mark.parametrize("frames", [(50,), (50, 51), (0,), (20, 60, 99)])
def test_a_marker_that_jumps_is_replaced(path, columns, column, jump, frames):
    columns[column][list(frames)] += jump
    recording = read_csv(write(path, columns))
    inside = tuple(frame for frame in frames if 0 < frame < 99)
    body = column.partition("_")[0]
    assert recording.repairs.outliers == ({body: inside} if inside else {})
    assert recording.repairs.left_out == tuple(frame for frame in frames if frame in (0, 99))
    assert largest_error(recording) < 1.5
    assert (
        np.abs(recording.object.poses[:, 2] - push()["object_yaw"][recording.frames]).max() < 0.03
    )


def test_a_motion_that_starts_stops_and_bounces_has_no_outliers(path, columns):
    time = columns["time"]
    for name, bounce in (("effector_x", -1.0), ("effector_y", 0.0), ("object_y", 1.0)):
        columns[name] = 1.0 * np.clip(time - 1, 0, 0.5) + bounce * 0.5 * np.clip(time - 1.5, 0, 0.5)
    recording = read_csv(write(path, noisy(columns)))
    assert str(recording.repairs) == "nothing repaired"
    away = recording.effector.poses[:, 1] - columns["effector_y"]
    assert np.abs(away).max() < 5e-3  # smoothing does not flatten a stop from 1 m/s


def test_unequal_steps_are_taken_as_they_are(path, columns):
    columns["time"] = columns["time"] + np.random.default_rng(2).uniform(-0.01, 0.01, 100)
    recording = read_csv(write(path, columns))
    assert str(recording.repairs) == "nothing repaired"
    assert np.allclose(recording.times, columns["time"], atol=1e-6)


def test_a_camera_of_which_every_third_frame_is_kept_has_none_missing(path, columns):
    columns["frame"] = 7 + 3 * columns["frame"]
    rows = rows_of(columns)
    del rows[20]
    recording = read_csv(write(path, columns, rows))
    assert recording.repairs == Repairs(missing=(67,))


def test_numbers_that_jump_without_time_are_refused(path, columns):
    columns["frame"][50:] += 3
    with pytest.raises(
        ValueError, match=r"line 52: frame is 53 after 49, but the time rises by 0\.03"
    ):
        read_csv(write(path, columns))


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda rows: rows.__delitem__(40), 42),
        (lambda rows: rows[40].__setitem__(2, ""), 42),
        (lambda rows: rows[40].__setitem__(2, "0.3"), 42),
        (lambda rows: rows[0].__setitem__(2, ""), 2),
    ],
)
def test_nothing_is_mended_if_that_is_forbidden(path, columns, change, line):
    rows = rows_of(columns)
    change(rows)
    write(path, columns, rows)
    assert str(read_csv(path).repairs) != "nothing repaired"
    with pytest.raises(ValueError, match=f"line {line}: frame {line - 2} needs repair .* forbids"):
        read_csv(path, repair=False)


def test_a_recording_of_which_much_would_be_mended_is_refused(path, columns):
    rows = rows_of(columns)
    for row in rows[1::3]:
        row[2] = ""
    with pytest.raises(ValueError, match=r"33 of 100 frames need repair .* expected at most 25%"):
        read_csv(write(path, columns, rows))


def test_two_jumps_of_the_yaw_do_not_turn_what_follows(path, columns):
    columns["object_yaw"][[50, 51]] += (2.2, 4.4)
    columns["object_yaw"] = (columns["object_yaw"] + np.pi) % (2 * np.pi) - np.pi
    recording = read_csv(write(path, columns))
    assert recording.repairs == Repairs(outliers={"object": (50, 51)})
    assert np.abs(recording.object.poses[:, 2] - push()["object_yaw"]).max() < 0.03


def test_a_motion_that_starts_with_the_recording_has_no_outliers(path, columns):
    columns["object_y"] = 0.4 + 0.2 * np.maximum(columns["time"] - 1 / 33, 0)
    assert str(read_csv(write(path, columns)).repairs) == "nothing repaired"


def test_a_tracker_that_holds_still_or_rounds_is_smoothed_as_any():
    """Half of the third differences are then 0, which is not its noise."""
    random = np.random.default_rng(0)
    times = np.arange(100) / 33
    moving = np.maximum(0, times - times[60]) * 0.05
    held = moving + np.where(np.arange(100) < 60, 0, random.normal(0, 5e-4, 100))
    rounded = np.round((moving + random.normal(0, 2e-4, 100)) / 1e-3) * 1e-3
    for measured, most in ((held, 0.006), (rounded, 0.006)):
        smooth = smoothed(times, np.tile(measured, (3, 1)).T, times, 0.06)
        found = smooth.rates[65:95, 0]
        assert np.sqrt(np.mean((found - 0.05) ** 2)) < most


def velocities(recording):
    return np.concatenate([recording.object.velocities, recording.effector.velocities], axis=1)


def test_causal_velocities_and_poses_do_not_change_with_frames_to_come(path, columns):
    rows = rows_of(columns)
    del rows[30:32]
    whole = read_csv(write(path, columns, rows), causal=True)
    part = read_csv(write(path, columns, rows[:60]), causal=True)
    assert whole.frames[0] == 6 and whole.repairs.left_out == tuple(range(6))
    assert part.repairs.missing == (30, 31)
    for name in ("poses", "velocities", "velocity_covariances"):
        early, late = getattr(part.object, name), getattr(whole.object, name)
        assert np.array_equal(early, late[: len(part)])
    assert not np.array_equal(
        velocities(read_csv(path)), velocities(read_csv(write(path, columns, rows)))[:62]
    )


def test_a_push_that_begins_is_not_seen_before_it_does_if_velocities_are_causal(path):
    columns = poses_of(push())
    columns["object_y"] = 0.05 * np.maximum(columns["time"] - columns["time"][50], 0.0)
    columns = noisy(columns)
    write(path, columns)
    ahead, causal = read_csv(path), read_csv(path, causal=True)
    assert ahead.object.velocities[49, 1] > 0.01
    assert abs(causal.object.velocities[causal.frames.tolist().index(49), 1]) < 0.01
    assert causal.object.velocities[-1, 1] == pytest.approx(0.05, abs=0.01)


def test_a_causal_recording_may_forbid_repairs_and_keeps_velocities_of_its_own(path, columns):
    assert len(read_csv(write(path, columns), causal=True, repair=False)) == 94
    own = read_csv(write(path, push()), causal=True)
    assert np.array_equal(velocities(own), velocities(read_csv(path)))
    with pytest.raises(ValueError, match="causal is 'no', expected true or false"):
        read_csv(path, causal="no")
