"""Datasets of LeRobot, version 3: episodes become recordings, and scores columns of a copy."""

import json

import numpy as np
import pyarrow
import pytest
from command_line import run_here
from pyarrow import parquet
from recorded import noisy, poses_of, push
from test_recordings_problem import own_problem

import energymargin as em
from energymargin.recordings import read_lerobot
from energymargin.store import export_lerobot

FRAMES = (60, 100, 80)  # of each episode
COLUMNS = {  # of a dataset that tells no turns of the effector, and lengths in mm
    "columns": {
        **{"time": "timestamp", "effector_yaw": 0.0},
        **{"object_x": "observation.environment_state/box_x"},
        **{"object_y": "observation.environment_state/1"},
        **{"object_yaw": "observation.environment_state/2"},
        **{"effector_x": "observation.state/0", "effector_y": "observation.state/1"},
    },
    "units": {"length": "mm"},
}


def vector(*columns):
    """A column of lists, as LeRobot has them."""
    flat = np.stack(columns, axis=1).astype(np.float32)
    return pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(flat.ravel()), len(columns))


def write_lerobot(folder, scale=1000.0):
    """A small dataset as LeRobot 3 lays it out: two files of frames, the first with two episodes in
    a row group each. Returns the columns of each episode in SI units."""
    episodes, tables, begin = [], [], 0
    for number, frames in enumerate(FRAMES):
        own = noisy(poses_of(push(frames)), seed=number)
        episodes.append(own)
        x, y, yaw = (own[f"object_{axis}"] for axis in ("x", "y", "yaw"))
        tables.append(
            pyarrow.table(
                {
                    "observation.environment_state": vector(scale * x, scale * y, yaw),
                    "observation.state": vector(
                        scale * own["effector_x"], scale * own["effector_y"]
                    ),
                    "timestamp": pyarrow.array(own["time"].astype(np.float32)),
                    "frame_index": np.arange(frames),
                    "episode_index": np.full(frames, number),
                    "index": begin + np.arange(frames),
                    "task_index": np.zeros(frames, dtype=int),
                    "next.success": np.arange(frames) == (frames - 1 if number else frames),
                }
            )
        )
        begin += frames
    data, meta = folder / "data" / "chunk-000", folder / "meta"
    for place in (data, meta / "episodes" / "chunk-000", folder / "videos"):
        place.mkdir(parents=True)
    (folder / "videos" / "top.mp4").write_bytes(b"frames")
    kept = {"info": {"features": {"index": {"dtype": "int64", "_type": "Value"}}}}
    schema = tables[0].schema.with_metadata({"huggingface": json.dumps(kept)})
    for file, own in (("file-000", tables[:2]), ("file-001", tables[2:])):
        with parquet.ParquetWriter(data / f"{file}.parquet", schema) as writer:
            for table in own:
                writer.write_table(table.cast(schema))
    lengths = pyarrow.table({"episode_index": [0, 1, 2], "length": list(FRAMES)})
    parquet.write_table(lengths, meta / "episodes" / "chunk-000" / "file-000.parquet")

    def feature(shape, names=None, dtype="float32"):
        return {"dtype": dtype, "shape": [shape], "names": names}

    features = {
        "observation.environment_state": feature(3, ["box_x", "box_y", "box_yaw"]),
        "observation.state": feature(2, {"motors": ["motor_0", "motor_1"]}),
        **{name: feature(1) for name in ("timestamp", "next.success")},
        **{n: feature(1, dtype="int64") for n in ("frame_index", "episode_index", "index")},
    }
    info = {"codebase_version": "v3.0", "fps": 33, "features": features}
    (meta / "info.json").write_text(json.dumps(info))
    return episodes


@pytest.fixture
def folder(tmp_path):
    """A folder with a LeRobot dataset, its columns and a problem."""
    write_lerobot(tmp_path / "pusht")
    own_problem().save(tmp_path / "P.json")
    (tmp_path / "columns.json").write_text(json.dumps(COLUMNS))
    return tmp_path


def test_episodes_are_recordings_with_the_poses_and_times_of_their_frames(tmp_path):
    episodes = write_lerobot(tmp_path / "pusht")
    found = read_lerobot(tmp_path / "pusht", COLUMNS, smooth_poses=False)
    assert [one.name for one in found] == ["pusht:0", "pusht:1", "pusht:2"]
    for recording, own in zip(found, episodes, strict=True):
        assert np.allclose(recording.times, own["time"], atol=1e-6)
        assert np.allclose(recording.object.poses[:, 0], own["object_x"], atol=2e-3)
        assert np.allclose(recording.effector.poses[:, 1], own["effector_y"], atol=2e-3)
        assert np.all(recording.effector.poses[:, 2] == 0.0)


def test_elements_that_have_the_documented_names_need_no_columns(tmp_path):
    write_lerobot(tmp_path / "own", scale=1.0)
    info = tmp_path / "own" / "meta" / "info.json"
    text = info.read_text().replace("box_", "object_")
    info.write_text(text.replace("motor_0", "effector_x").replace("motor_1", "effector_y"))
    with pytest.raises(ValueError, match=r"info\.json: the header lacks 'effector_yaw'.*; it has"):
        read_lerobot(tmp_path / "own")


def test_times_that_are_not_those_of_the_frames_a_second_are_told(tmp_path):
    write_lerobot(tmp_path / "pusht")
    info = tmp_path / "pusht" / "meta" / "info.json"
    info.write_text(info.read_text().replace('"fps": 33', '"fps": 10'))
    with pytest.warns(em.PlausibilityWarning, match=r"33.* frames a second, and .* says fps 10"):
        read_lerobot(tmp_path / "pusht", COLUMNS)


def test_times_in_single_precision_since_1970_are_refused_as_such(tmp_path):
    write_lerobot(tmp_path / "pusht")
    for file in (tmp_path / "pusht" / "data").glob("*/*.parquet"):
        table = parquet.read_table(file)
        late = (table["timestamp"].to_numpy() + 1.7e9).astype(np.float32)
        place = table.column_names.index("timestamp")
        parquet.write_table(table.set_column(place, "timestamp", pyarrow.array(late)), file)
    with pytest.raises(ValueError, match=r"in single precision, which at 17\d+ s has steps of 128"):
        read_lerobot(tmp_path / "pusht", COLUMNS)


def test_what_one_of_two_says_of_success_is_not_dropped(folder):
    write_lerobot(folder / "silent")
    info = folder / "silent" / "meta" / "info.json"
    info.write_text(info.read_text().replace("next.success", "next.done"))
    words = ("--problem", "P.json", "--columns", "columns.json", "-o", "D.h5")
    done = run_here("import", "pusht", "silent", *words, cwd=folder)
    assert done.returncode == 2, done.stderr
    said = " ".join(done.stderr.split())
    assert "pusht has next.success and silent does not" in said and "--labels" in said


def test_the_scores_of_an_import_become_columns_of_a_copy(folder):
    words = ("--problem", "P.json", "--columns", "columns.json", "-o", "D.h5")
    done = run_here("import", "pusht", *words, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "pusht: 3 episodes, 240 frames" in done.stderr
    assert "3 trajectories (2 successful by next.success), 240 states" in done.stderr
    asked = ("--metrics", "probability,force", "--frames", 3, "--rollouts", 2)
    done = run_here("score", "D.h5", *asked, cwd=folder)
    assert done.returncode == 0, done.stderr
    before = {file: file.read_bytes() for file in (folder / "pusht").rglob("*.*")}
    inside = run_here("export", "D-scores.db", "--lerobot", "pusht", "-o", "pusht/x", cwd=folder)
    assert inside.returncode == 2 and "inside of pusht" in inside.stderr
    export = ("export", "D-scores.db", "--lerobot", "pusht", "-o", "scored")
    done = run_here(*export, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "scored, a copy with energymargin.probability, energymargin.force" in done.stderr
    assert {file: file.read_bytes() for file in before} == before
    assert (folder / "scored" / "videos" / "top.mp4").read_bytes() == b"frames"
    table = parquet.read_table(sorted((folder / "scored" / "data").glob("*/*.parquet")))
    source = parquet.read_table(sorted((folder / "pusht" / "data").glob("*/*.parquet")))
    assert table.select(source.column_names).equals(source)
    with em.store.ScoreStore(folder / "D-scores.db") as store:
        ahead, now = (run.labelled_scores().scores for run in store.runs())
    for name, values in {**ahead, **now}.items():
        written = table[f"energymargin.{name}"].to_numpy()
        assert np.array_equal(written, values.astype(np.float32), equal_nan=True), name
    info = json.loads((folder / "scored" / "meta" / "info.json").read_text())
    feature = {"dtype": "float32", "shape": [1], "names": None}
    assert info["features"]["energymargin.probability"] == feature
    (first, _) = sorted((folder / "scored" / "data").glob("*/*.parquet"))
    told = json.loads(parquet.read_schema(first).metadata[b"huggingface"])
    assert "energymargin.force" in told["info"]["features"]
    assert parquet.ParquetFile(first).num_row_groups == 2
    again = run_here(*export, cwd=folder)
    assert again.returncode == 2 and "scored exists" in again.stderr
    twice = run_here(*export[:-3], "scored", "-o", "twice", cwd=folder)
    assert twice.returncode == 2 and "has energymargin.probability already" in twice.stderr


def test_frames_that_were_left_out_of_the_import_have_no_score(folder):
    words = ("--problem", "P.json", "--columns", "columns.json", "-o", "D.h5", "--causal")
    assert run_here("import", "pusht", *words, cwd=folder).returncode == 0
    em.store.score_dataset(folder / "D.h5", folder / "s.db", ["force"])
    export_lerobot(folder / "s.db", folder / "D.h5", folder / "pusht", folder / "scored")
    table = parquet.read_table(sorted((folder / "scored" / "data").glob("*/*.parquet")))
    missing = np.isnan(table["energymargin.force"].to_numpy())
    assert np.array_equal(missing, table["frame_index"].to_numpy() < 6)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("meta/info.json", '"v3.0"', '"v2.1"', "version v2.1, expected v3: .*convert_dataset_v21"),
        ("meta/info.json", "codebase_version", "version", "expected that of a LeRobot dataset"),
        ("meta/info.json", "box_x", "bx", "expected one column .*environment_state/box_x"),
    ],
)
def test_what_is_no_such_dataset_is_refused_with_a_way_out(folder, file, old, new, words):
    path = folder / "pusht" / file
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ValueError, match=words):
        read_lerobot(folder / "pusht", COLUMNS)


def test_a_dataset_that_lacks_a_file_of_frames_is_refused(folder):
    (folder / "pusht" / "data" / "chunk-000" / "file-001.parquet").unlink()
    with pytest.raises(ValueError, match="episode 2 has 0 frames, expected 80, as meta/episodes"):
        read_lerobot(folder / "pusht", COLUMNS)


def test_scores_of_another_dataset_are_refused_and_leave_nothing(folder):
    trajectory = em.datasets.generate("push", trajectories=3, frames=20, seed=0)
    trajectory.save(folder / "other.h5")
    em.store.score_dataset(folder / "other.h5", folder / "s.db", ["force"])
    with pytest.raises(ValueError, match="has other times than its trajectory"):
        export_lerobot(folder / "s.db", folder / "other.h5", folder / "pusht", folder / "scored")
    assert not (folder / "scored").exists()
