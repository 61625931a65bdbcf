"""What stands in a recording's file is what is read, or is refused with its line."""

import json
import re
import sys

import numpy as np
import pytest
from anything import damaged, finite
from hypothesis import given, strategies as st
from recorded import CELLS, HEADER, POSES, noisy, one_folder, poses_of, push, rows_of, write

from energymargin.recordings import (
    Columns,
    Recording,
    bag_topics,
    read_bag,
    read_csv,
    read_lerobot,
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.csv"


def motions(recording):
    """Poses and velocities of both bodies, shape (K, 12)."""
    both = (recording.object, recording.effector)
    return np.concatenate([array for body in both for array in (body.poses, body.velocities)], 1)


def expected(columns):
    return np.stack([columns[name] for name in HEADER[2:]], axis=1)


def test_a_file_with_velocities_is_read_as_it_is(path):
    columns = push()
    recording = read_csv(write(path, columns))
    assert recording.name == "a.csv" and str(recording.repairs) == "nothing repaired"
    assert recording.frames.tolist() == list(range(100))
    assert np.allclose(recording.times, columns["time"], atol=1e-6)
    assert np.allclose(motions(recording), expected(columns), atol=1e-6)


def test_velocities_that_are_missing_are_those_of_the_motion(path):
    columns = push()
    recording = read_csv(write(path, poses_of(columns)))
    assert np.abs(motions(recording) - expected(columns))[5:-5].max() < 2e-3


def test_velocities_from_noisy_poses_at_unequal_times_are_within_a_tenth_of_the_speed(path):
    random = np.random.default_rng(1)
    jitter = random.normal(0, 2e-3, 100)
    true = push(rate=33.0)
    true["time"] = true["time"] + jitter
    for body in ("object", "effector"):  # where they are at these times, to first order
        for axis, rate in (("x", "vx"), ("y", "vy"), ("yaw", "yaw_rate")):
            true[f"{body}_{axis}"] = true[f"{body}_{axis}"] + true[f"{body}_{rate}"] * jitter
    recording = read_csv(write(path, poses_of(noisy(true))))
    error = np.sqrt(np.mean(np.square(motions(recording) - expected(true)), axis=0))
    poses, rates = error[[0, 1, 2, 6, 7, 8]], error[[3, 4, 5, 9, 10, 11]]
    assert (rates[[0, 1, 3, 4]] < 5e-3).all() and (rates[[2, 5]] < np.radians(4)).all()
    assert (poses[[0, 1, 3, 4]] < 3e-4).all() and (poses[[2, 5]] < np.radians(0.3)).all()
    measured = read_csv(path, smooth_poses=False)
    assert np.allclose(measured.object.velocities, recording.object.velocities)
    assert measured.object.poses[:, 0].tolist() == [
        float(f"{x:.6f}") for x in noisy(true)["object_x"]
    ]


def test_a_yaw_that_wraps_goes_on(path):
    columns = push()
    wrapped = {**columns, "object_yaw": (columns["object_yaw"] + np.pi) % (2 * np.pi) - np.pi}
    assert np.ptp(wrapped["object_yaw"]) > 6
    recording = read_csv(write(path, wrapped))
    assert np.allclose(recording.object.poses[:, 2], columns["object_yaw"], atol=1e-6)


def test_units_stand_in_the_header(path):
    columns = push()
    changed = {
        {"object_x": "object_x_mm", "object_yaw": "object_yaw_deg", "time": "time_ms"}.get(
            name, "effector_vy_cm_s" if name == "effector_vy" else name
        ): values
        * {
            "object_x": 1e3,
            "object_yaw": np.degrees(1),
            "time": 1e3,
            "effector_vy": 1e2,
        }.get(name, 1)
        for name, values in columns.items()
    }
    assert np.allclose(motions(read_csv(write(path, changed))), expected(columns), atol=1e-5)


@pytest.mark.parametrize(("unit", "size"), [("us", 1e-6), ("ns", 1e-9)])
def test_time_stamps_may_count_from_1970_in_small_units(path, unit, size):
    columns = push()
    stamped = {
        f"time_{unit}" if name == "time" else name: (1.7e9 + v) / size if name == "time" else v
        for name, v in columns.items()
    }
    recording = read_csv(write(path, stamped))
    assert np.allclose(motions(recording), expected(columns), atol=1e-5)


def test_a_mapping_file_says_which_column_is_what_and_in_which_units(path, tmp_path):
    columns = poses_of(push())
    names = {name: f"marker {k}" for k, name in enumerate(columns)}
    other = {"note": np.zeros(100), **{names[name]: columns[name] for name in reversed(columns)}}
    for name in columns:
        factor = 1 if name == "frame" else np.degrees(1) if "yaw" in name else 1e3
        other[names[name]] = other[names[name]] * factor
    mapping = {
        "columns": names,
        "units": {"length": "mm", "angle": "deg", "time": "ms"},
        "delimiter": ";",
    }
    (tmp_path / "columns.json").write_text(json.dumps(mapping))
    plain = read_csv(write(tmp_path / "plain.csv", columns))
    mapped = read_csv(write(path, other, delimiter=";"), tmp_path / "columns.json")
    assert np.allclose(motions(mapped), motions(plain), atol=1e-3)


def test_a_file_without_a_header_has_its_columns_by_number(path):
    columns = push()
    numbers = {name: k for k, name in enumerate(HEADER)}
    recording = read_csv(write(path, columns, header=()), {"columns": numbers})
    assert np.allclose(motions(recording), expected(columns), atol=1e-6)


def test_the_camera_s_frame_is_turned_into_the_scene_s(path):
    columns = push()
    write(path, columns)
    recording = read_csv(path, {"origin": [1, 2, np.pi / 2]})
    assert np.allclose(recording.object.poses[:, 0], 1 - columns["object_y"], atol=1e-6)
    assert np.allclose(recording.object.poses[:, 1], 2 + columns["object_x"], atol=1e-6)
    assert np.allclose(recording.object.velocities[:, 0], -columns["object_vy"], atol=1e-6)
    assert np.allclose(recording.object.poses[:, 2], columns["object_yaw"] + np.pi / 2, atol=1e-6)
    again = read_csv(path, origin=(1, 2, np.pi / 2))
    assert np.array_equal(again.object.poses, recording.object.poses)


def cell(row, name, text):
    """A change of one cell; the row's line is two more."""

    def change(rows):
        rows[row][HEADER.index(name)] = text

    return change


def test_a_file_of_several_episodes_says_so(path):
    rows = rows_of(push())
    with pytest.raises(ValueError, match=r"line 102: frame is 0 after 99, .* these 3 episodes"):
        read_csv(write(path, push(), 3 * rows))


def test_a_clock_that_was_set_back_is_refused_with_its_line(path):
    columns = push()
    columns["time"][60:] -= 0.5
    with pytest.raises(
        ValueError, match=r"line 62: time is .* expected it to rise\. .* was the clock set"
    ):
        read_csv(write(path, columns))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (cell(3, "object_x", "left"), "line 5: object_x is 'left', expected a number"),
        (cell(3, "object_x", "1_0"), "line 5: object_x is '1_0', expected a number"),
        (cell(3, "object_x", "inf"), "line 5: object_x is 'inf', expected a number"),
        (cell(4, "time", "nan"), "line 6: time is 'nan', expected a number in each row"),
        (cell(4, "frame", "4.5"), "line 6: frame is '4.5', expected a whole number"),
        (cell(4, "time", "0.05"), "line 6: time is 0.05 after 0.090909, expected it to rise"),
        (cell(4, "frame", "3"), "line 6: frame is 3 after 3, expected it to rise"),
        (lambda rows: rows[7].pop(), "line 9: has 13 cells, expected 14"),
        (lambda rows: rows[7].append("1"), "line 9: has 15 cells, expected 14"),
        (cell(8, "object_yaw", "200"), r"line 10: object_yaw is 200 rad, .* or units others"),
        (
            cell(8, "effector_y", "350"),
            r"line 10: effector_y is 350 m, .* or units others",
        ),
        (lambda rows: rows.clear(), "has 0 rows, expected at least 7"),
        (lambda rows: rows.__delitem__(slice(5, None)), "has 5 rows, expected at least 7"),
    ],
)
def test_a_wrong_cell_is_refused_with_its_line(path, change, message):
    columns = push()
    rows = rows_of(columns)
    change(rows)
    with pytest.raises(ValueError, match=f"{re.escape(str(path))}(, |: ){message}"):
        read_csv(write(path, columns, rows))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"object_x": "box_x"}, "line 1: the header has 'box_x', expected frame, time, object_x"),
        ({"object_x": "object_y"}, "line 1: the header has 'object_y' more than once"),
        ({"object_x": "object_y_mm"}, "line 1: the header has 'object_y' more than once"),
        ({"object_x": ""}, "line 1: the header has ''"),
    ],
)
def test_a_wrong_header_is_refused(path, header, message):
    columns = push()
    with pytest.raises(ValueError, match=message):
        read_csv(write(path, columns, header=[header.get(name, name) for name in columns]))


def test_without_frame_numbers_rows_are_frames(path):
    columns = push()
    whole = read_csv(write(path, columns))
    del columns["frame"]
    assert np.array_equal(read_csv(write(path, columns)).times, whole.times)


@pytest.mark.parametrize("lost", ["time", "effector_yaw", "object_vx"])
def test_a_header_that_lacks_a_column_is_refused(path, lost):
    columns = push()
    del columns[lost]
    with pytest.raises(ValueError, match=f"line 1: the header lacks '{lost}'"):
        read_csv(write(path, columns))


def test_a_file_without_a_header_or_text_is_refused(path):
    with pytest.raises(ValueError, match="line 1: the header has '0', expected frame, time"):
        read_csv(write(path, push(), header=()))
    path.write_bytes(b"frame,time\n1,\xff\n")
    with pytest.raises(ValueError, match="expected a CSV file in UTF-8"):
        read_csv(path)
    path.write_bytes(b"\n\n")
    with pytest.raises(ValueError, match="a CSV file"):
        read_csv(path)
    with pytest.raises(FileNotFoundError):
        read_csv(path.with_name("b.csv"))


def swapped(first, second):
    return {first: second, second: first}


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            swapped("object_x", "object_y"),
            "object_vx, object_vy contradict .* Are columns swapped",
        ),
        (
            swapped("object_yaw", "effector_yaw"),
            "object_yaw_rate contradict .* Are columns swapped",
        ),
    ],
)
def test_swapped_columns_contradict_the_velocities(path, columns, message):
    true = push()
    with pytest.raises(ValueError, match=message):
        read_csv(write(path, {name: true[columns.get(name, name)] for name in true}))


@pytest.mark.parametrize(
    ("names", "factor", "message"),
    [
        (["object_yaw"], np.degrees(1), "object_yaw is .* rad, .* or units others"),
        (["effector_yaw"], np.degrees(1), "NONE"),
        (["object_yaw_rate"], np.degrees(1), "object_yaw_rate contradict .* or units others"),
        (["object_vx", "object_vy"], 1e3, "object_vx, object_vy contradict .* or units others"),
        (["object_x", "object_y"], 1e3, "object_x is 100 m, .* or units others"),
        (["object_x", "object_y"], 1e2, "object_vx, object_vy contradict .* or units others"),
        (["time"], 1e3, "its frames are 30.3 s apart, .* or units others"),
        (["time"], 1e6, r"its frames are 3.03e\+04 s apart, .* or units others"),
        (["time"], 1e9, r"its frames are 3.03e\+07 s apart, .* or units others"),
        (["time"], 1e13, r"its frames are 3.03e\+11 s apart, .* or units others"),
        (["time"], 1e-3, "its frames are 3e-05 s apart, .* or units others"),
        (["time"], 0.1, "contradict"),
    ],
)
def test_other_units_than_said_are_refused(path, names, factor, message):
    columns = push()
    columns = {name: v * factor if name in names else v for name, v in columns.items()}
    if message == "NONE":  # of a body that does not turn, nothing tells
        assert read_csv(write(path, columns)).effector.poses[0, 2] == pytest.approx(5.73, abs=1e-2)
        return
    with pytest.raises(ValueError, match=message):
        read_csv(write(path, columns))


def test_degrees_said_to_be_radians_are_seen_by_their_noise(path):
    columns = noisy(poses_of(push()))
    columns["object_yaw"] = np.degrees(columns["object_yaw"] - 3.1) / 2
    with pytest.raises(ValueError, match=r"object_yaw changes by .* rad/s, .* or units others"):
        read_csv(write(path, columns))


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({"column": {}}, "the layout is {'column': {}}, expected an object with columns, units"),
        ({"columns": {"box_x": 1}}, "columns is {'box_x': 1}, expected an object with frame, time"),
        ({"columns": {"time": 0, "object_x": 1}}, "columns lacks 'object_y'"),
        (
            {"columns": {"time": -1}},
            "columns has -1 for 'time', expected a name or a number from 0 on",
        ),
        ({"columns": {"time": None}}, "columns has None for 'time'"),
        (
            {"units": {"length": "inch"}},
            "the unit of length is 'inch', expected 'm' or 'cm' or 'mm'",
        ),
        ({"units": []}, r"units is \[\], expected an object"),
        ({"delimiter": ", "}, "delimiter is ', ', expected one character"),
        ({"origin": [0, 0]}, r"origin is \[0, 0\], expected x, y \[m\] and yaw \[rad\]"),
        ([], r"the layout is \[\], expected an object"),
    ],
)
def test_a_wrong_mapping_is_refused_with_its_file(tmp_path, mapping, message):
    path = tmp_path / "columns.json"
    path.write_text(json.dumps(mapping))
    with pytest.raises(ValueError, match=f"columns.json: .*{message}"):
        Columns.of(path)


def test_a_mapping_that_fits_another_file_is_refused(path):
    write(path, push())
    names = dict(zip(["time", *POSES], ["time", *POSES], strict=True))
    with pytest.raises(ValueError, match="line 1: expected one column 'box', the header is frame"):
        read_csv(path, {"columns": {**names, "object_x": "box"}})
    with pytest.raises(ValueError, match=r"there is no column 14 \(object_x\), expected 0 to 13"):
        read_csv(path, {"columns": {**names, "object_x": 14}})
    with pytest.raises(ValueError, match=r"columns has 'time' for .*that no other field has"):
        read_csv(path, {"columns": {**names, "object_x": "time"}})
    without = read_csv(path, {"columns": names})
    assert without.frames.tolist() == list(range(100))


def test_a_float_in_the_mapping_is_the_value_in_each_row_in_its_unit(path):
    write(path, poses_of(push()))
    names = dict(zip(["time", *POSES], ["time", *POSES], strict=True))
    round_tool = {"columns": {**names, "effector_yaw": 90.0}, "units": {"angle": "deg"}}
    assert np.allclose(read_csv(path, round_tool).effector.poses[:, 2], np.pi / 2)
    with pytest.raises(ValueError, match=r"columns has 0\.5 for 'time', expected a name"):
        read_csv(path, {"columns": {**names, "time": 0.5}})


@pytest.mark.parametrize("name", ["longest_gap", "least_jump", "least_turn", "smoothing"])
def test_wrong_arguments_are_named(path, name):
    write(path, push())
    with pytest.raises(ValueError, match=f"{name} is nan, expected a positive number"):
        read_csv(path, **{name: float("nan")})
    with pytest.raises(ValueError, match="repair is 1, expected true or false"):
        read_csv(path, repair=1)


def require_recording_or_refusal(path, text, columns=None):
    path.write_bytes(text)
    try:
        recording = read_csv(path, columns)
    except ValueError as error:
        assert str(error)
    else:
        assert isinstance(recording, Recording)
        assert finite(recording.times, motions(recording))


TEXT = "".join(",".join(row) + "\n" for row in [HEADER, *rows_of(push(12))])


@one_folder
@given(damaged(TEXT.encode()))
def test_a_damaged_file_is_a_recording_or_refused(tmp_path, text):
    require_recording_or_refusal(tmp_path / "a.csv", text)


@one_folder
@given(st.data())
def test_a_file_with_other_cells_is_a_recording_or_refused(tmp_path, data):
    without = data.draw(st.booleans())
    rows = [[*HEADER], *rows_of(push(12))]
    if without:
        kept = [k for k, name in enumerate(HEADER) if name in poses_of(push(12))]
        rows = [[row[k] for k in kept] for row in rows]
    for _ in range(data.draw(st.integers(1, 5))):
        row = data.draw(st.sampled_from(rows[data.draw(st.integers(0, 1)) :]))
        row[data.draw(st.integers(0, len(row) - 1))] = data.draw(CELLS)
    text = "".join(",".join(row) + "\n" for row in rows)
    require_recording_or_refusal(tmp_path / "a.csv", text.encode("utf-8", "surrogatepass"))


@one_folder
@given(
    st.dictionaries(
        st.sampled_from(["columns", "units", "delimiter", "header", "origin", "x"]),
        st.one_of(
            st.none(),
            st.text(max_size=2),
            st.booleans(),
            st.lists(st.one_of(st.floats(), st.text(max_size=2)), max_size=4),
            st.dictionaries(
                st.sampled_from([*HEADER, "length", "angle"]),
                st.one_of(st.integers(-2, 15), st.sampled_from([*HEADER, "mm", "deg", ""])),
            ),
            st.just({name: k for k, name in enumerate(HEADER)}),
        ),
    )
)
def test_any_mapping_leads_to_a_recording_or_is_refused(tmp_path, mapping):
    (tmp_path / "columns.json").write_text(json.dumps(mapping))
    require_recording_or_refusal(tmp_path / "a.csv", TEXT.encode(), tmp_path / "columns.json")


def test_a_hundred_thousand_columns_are_refused_in_one_line(path):
    path.write_text(",".join(f"c{n}" for n in range(100_000)))
    with pytest.raises(ValueError, match=r"line 1: the header has 'c0', expected frame") as refused:
        read_csv(path)
    assert len(str(refused.value)) < 1000


def test_a_missing_extra_is_named_with_the_command_that_installs_it(path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[recordings\]'"):
        read_csv(write(path, push()))
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(ImportError, match=r"pip install 'energymargin\[ros\]'"):
        read_bag(path, object="/box", effector="/tool")


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("a.npz", "arrays of numpy"),
        ("demo.hdf5", "HDF5, as of robomimic"),
        ("a-train.tfrecord-00000-of-00010", "TFRecord, as of RLDS"),
        ("1.0.0/features.json", "TFRecord, as of RLDS"),
        ("replay.zarr/.zgroup", "zarr"),
        ("replay/zarr.json", "zarr"),
        ("a.parquet", "Parquet"),
        ("a.pkl", "a pickle, which can run code"),
    ],
)
def test_a_format_that_is_not_read_is_named_with_the_way_out(name, what, tmp_path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(b"{}")
    given = file if file.parent == tmp_path else file.parent
    for read in (read_csv, read_lerobot, bag_topics):
        with pytest.raises(ValueError, match=f"is {what}, which is not read: em.recordings.from_t"):
            read(given)
