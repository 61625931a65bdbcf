import sqlite3

import numpy as np
import pytest

from energymargin import datasets, scoring
from energymargin.store import ScoreStore, score_dataset

NODES, SEED = 20, 3


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("push", trajectories=2, frames=3, seed=0)


@pytest.fixture(scope="module")
def table(dataset):
    return scoring.score(dataset.problems(), nodes=NODES, seed=SEED)


class Stop(Exception):
    pass


def stop_after(count):
    def progress(done, _total):
        if done >= count:
            raise Stop

    return progress


def test_a_file_holds_every_score_and_label_to_the_last_bit(dataset, table, tmp_path):
    score_dataset(dataset, tmp_path / "s.db", nodes=NODES, seed=SEED)
    with ScoreStore(tmp_path / "s.db") as store:
        labelled = store.labelled_scores()
        assert store.counts() == (6, 6) and store.seconds() > 0
    for metric in table.scores:
        assert np.array_equal(labelled.scores[metric], table[metric])
    assert labelled.trajectory.tolist() == [0, 0, 0, 1, 1, 1]
    assert labelled.captured.tolist() == [c for t in dataset.trajectories for c in t.captured]
    assert labelled.success.tolist() == [t.success for t in dataset.trajectories for _ in range(3)]


def test_a_run_that_was_stopped_goes_on_to_the_same_scores(dataset, table, tmp_path):
    with pytest.raises(Stop):
        score_dataset(
            dataset, tmp_path / "s.db", nodes=NODES, seed=SEED, threads=1, progress=stop_after(2)
        )
    with ScoreStore(tmp_path / "s.db") as store:
        kept, total = store.counts()
        assert 2 <= kept < total and len(store.missing()) == total - kept
        assert np.isnan(store.labelled_scores().scores["capture"]).sum() == total - kept
    counts = []
    score_dataset(
        dataset,
        tmp_path / "s.db",
        nodes=NODES,
        seed=SEED,
        progress=lambda *count: counts.append(count),
    )
    assert counts[0] == (kept, 6) and counts[-1] == (6, 6)
    with ScoreStore(tmp_path / "s.db") as store:
        for metric in table.scores:
            assert np.array_equal(store.labelled_scores().scores[metric], table[metric])


def test_the_labels_of_at_least_one_object_are_kept(tmp_path):
    several = datasets.generate("scoop", trajectories=2, frames=3, seed=0)
    score_dataset(several, tmp_path / "s.db", nodes=5)
    with ScoreStore(tmp_path / "s.db") as store:
        labelled = store.labelled_scores()
    assert set(labelled.scores) == set(scoring.METRICS)
    some = [label for t in several.trajectories for label in t.captured_any]
    assert labelled.captured_any.tolist() == some
    ends = [t.success_any for t in several.trajectories for _ in range(3)]
    assert labelled.success_any.tolist() == ends


def test_a_file_of_version_1_is_read_and_goes_on(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    ScoreStore.for_dataset(path, dataset, list(table.scores), NODES, SEED).close()
    with sqlite3.connect(path) as file:
        for column in ("captured_any", "success_any"):
            file.execute(f"ALTER TABLE states DROP COLUMN {column}")
        file.execute("PRAGMA user_version = 1")
    score_dataset(dataset, path, nodes=NODES, seed=SEED)
    with ScoreStore(path) as store:
        labelled = store.labelled_scores()
    assert labelled.captured_any is None and labelled.success_any is None
    assert np.array_equal(labelled.scores["capture"], table["capture"])


def test_an_infinite_effort_survives_the_file(dataset, tmp_path):
    with ScoreStore.for_dataset(tmp_path / "s.db", dataset, ["effort/est"], NODES, SEED) as store:
        rows = []
        scoring.score(dataset.problems(), ["effort/est"], nodes=1, on_rows=rows.extend)
        assert any(np.isinf(row.scores["effort/est"]) for row in rows)
        store.add(rows)
        expected = [row.scores["effort/est"] for row in sorted(rows, key=lambda row: row.index)]
        assert store.labelled_scores().scores["effort/est"].tolist() == expected


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nodes": 21}, "nodes: 20 there, 21 now"),
        ({"seed": 4}, "seed: 3 there, 4 now"),
        ({"metrics": ["force"]}, "metrics"),
    ],
)
def test_other_settings_are_refused_with_what_differs(dataset, tmp_path, change, message):
    settings = {"metrics": ["capture"], "nodes": NODES, "seed": SEED}
    score_dataset(dataset, tmp_path / "s.db", **settings)
    with pytest.raises(ValueError, match=message):
        score_dataset(dataset, tmp_path / "s.db", **{**settings, **change})


def test_another_dataset_is_refused(dataset, tmp_path):
    score_dataset(dataset, tmp_path / "s.db", ["force"])
    other = datasets.generate("push", trajectories=2, frames=3, seed=1)
    with pytest.raises(ValueError, match=r"s\.db holds other scores.*dataset"):
        score_dataset(other, tmp_path / "s.db", ["force"])


def test_bad_settings_leave_no_file(dataset, tmp_path):
    with pytest.raises(ValueError, match="nodes"):
        score_dataset(dataset, tmp_path / "s.db", nodes=0)
    with pytest.raises(ValueError, match="capture/any"):
        score_dataset(dataset, tmp_path / "s.db", ["capture/any"])
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_another_format_is_refused(tmp_path):
    (tmp_path / "text.db").write_text("not a database " * 100)
    with pytest.raises(ValueError, match=r"text\.db is not a file of scores"):
        ScoreStore(tmp_path / "text.db")
    with sqlite3.connect(tmp_path / "other.db") as other:
        other.execute("CREATE TABLE scores (x)")
    with pytest.raises(ValueError, match=r"other\.db is not a file of scores"):
        ScoreStore(tmp_path / "other.db")
    with pytest.raises(FileNotFoundError):
        ScoreStore(tmp_path / "none.db")
    assert not (tmp_path / "none.db").exists()


def test_a_file_of_a_newer_version_is_refused_with_the_advice_to_update(dataset, tmp_path):
    ScoreStore.for_dataset(tmp_path / "s.db", dataset, ["force"], NODES, SEED).close()
    with sqlite3.connect(tmp_path / "s.db") as file:
        file.execute("PRAGMA user_version = 99")
    with pytest.raises(ValueError, match=r"version 99.*update"):
        ScoreStore(tmp_path / "s.db")


def test_a_batch_is_kept_whole_or_not_at_all(dataset, tmp_path):
    rows = []
    scoring.score(dataset.problems(), ["force"], on_rows=rows.extend)
    with ScoreStore.for_dataset(tmp_path / "s.db", dataset, ["force"], NODES, SEED) as store:
        with sqlite3.connect(tmp_path / "s.db") as other:
            full = "BEGIN SELECT RAISE(ABORT, 'disk full'); END"
            other.execute(f"CREATE TRIGGER full BEFORE UPDATE ON states {full}")
        with pytest.raises(sqlite3.Error, match="disk full"):
            store.add(rows)
        assert store.counts() == (0, 6)
        assert np.isnan(store.labelled_scores().scores["force"]).all()
