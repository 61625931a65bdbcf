import csv

import numpy as np
import pandas as pd
import pytest
from command_line import invoke

import energymargin as em
from energymargin_paper.evidence.ceiling import ceiling_dataset


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A store with two runs, of one object and of four."""
    path = tmp_path_factory.mktemp("export") / "s.db"
    for task, nodes in (("topple", 1), ("scoop", 5)):
        dataset = em.datasets.generate(task, trajectories=2, frames=3, seed=0)
        em.store.score_dataset(dataset, path, settings=em.SearchSettings(nodes, seed=4))
    return path


def test_a_data_frame_has_a_row_a_state_with_labels_settings_and_scores(stored):
    frame = em.store.load(stored)
    assert frame["run"].tolist() == [1] * 6 + [2] * 6
    assert frame["task"].tolist() == ["topple"] * 6 + ["scoop"] * 6
    assert frame["frame"].tolist() == [0, 1, 2] * 4
    assert frame["nodes"].tolist() == [1] * 6 + [5] * 6 and set(frame["seed"]) == {4}
    dataset = em.datasets.generate("topple", trajectories=2, frames=3, seed=0)
    first = frame[frame["run"] == 1]
    assert first["captured"].tolist() == [c for t in dataset.trajectories for c in t.captured]
    assert first["succeeded"].tolist() == [t.success for t in dataset.trajectories for _ in "123"]
    assert first["captured_any"].isna().all() and frame["captured_any"].notna().sum() == 6
    table = em.score(dataset.problems(), nodes=1, seed=4)
    for metric in table.scores:
        assert np.array_equal(first[metric], table[metric])
    assert np.isinf(frame["effort/est"]).any()
    assert frame["capture/any"].isna().tolist() == [True] * 6 + [False] * 6
    assert (frame["seconds"] > 0).all()


def test_one_run_has_its_own_columns_alone(stored):
    frame = em.store.load(stored, run=1)
    assert len(frame) == 6 and "capture/any" not in frame and "captured_any" not in frame
    with pytest.raises(ValueError, match="run is 3"):
        em.store.load(stored, run=3)


def test_parquet_and_csv_hold_the_same_bits(stored, tmp_path):
    frame = em.store.load(stored)
    for name in ("s.parquet", "s.csv"):
        done = invoke(["export", str(stored), "-o", str(tmp_path / name)])
        assert done.exit_code == 0 and "Wrote 12 rows" in done.output
    parquet = pd.read_parquet(tmp_path / "s.parquet").astype(frame.dtypes)
    pd.testing.assert_frame_equal(parquet, frame, check_exact=True)
    with (tmp_path / "s.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(frame) and len(rows) == 12
    for metric in ("capture", "effort/est", "force"):
        assert [float(row[metric]) for row in rows] == frame[metric].tolist()
    assert rows[0]["captured_any"] == ""


def test_without_a_file_the_runs_are_listed(stored):
    done = invoke(["export", str(stored)])
    first, second = done.output.splitlines()
    assert first.startswith("run 1: topple, 6 of 6 states, capture, success, effort, effort/est")
    assert "nodes 5" in second and second.startswith("run 2: scoop")


def test_another_suffix_and_an_unwritable_folder_leave_nothing(stored, tmp_path):
    with pytest.raises(ValueError, match=r"output is 's\.xls', expected .*\.csv or \.parquet"):
        em.store.export(stored, "s.xls")
    with pytest.raises(OSError, match=r"no such folder: .*/none'$"):
        em.store.export(stored, tmp_path / "none" / "s.csv")
    assert not list(tmp_path.iterdir())


def test_runs_of_any_settings_are_below_one_another(tmp_path):
    path = tmp_path / "s.db"
    dataset = em.datasets.generate("topple", trajectories=1, frames=2, seed=0)
    for seed in (2**64 - 1, 2**60 + 1):
        em.store.score_dataset(
            dataset, path, ["capture"], settings=em.SearchSettings(nodes=1, seed=seed)
        )
    ceiling_dataset(dataset, path, continuations=1)
    frame = em.store.load(path)
    assert frame["seed"].tolist() == [*[str(2**64 - 1)] * 2, *[str(2**60 + 1)] * 2, "0", "0"]
    assert frame["nodes"].tolist() == [1, 1, 1, 1, pd.NA, pd.NA]
    assert frame["least_likelihood"].isna().tolist() == [False] * 4 + [True] * 2
    em.store.export(path, tmp_path / "s.parquet")
    parquet = pd.read_parquet(tmp_path / "s.parquet").astype(frame.dtypes)
    pd.testing.assert_frame_equal(parquet, frame, check_exact=True)
