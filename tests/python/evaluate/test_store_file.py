"""The file of a store: what it is, who writes it, and what happens to it meanwhile."""

import os
import sqlite3
import struct

import numpy as np
import pytest
from stores import Stop, rows, scores, stop_after

import energymargin as em
from energymargin.evaluate import scoring
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluate.store import answer_file
from energymargin.records.store.scoring import begin_run
from energymargin.store import ScoreStore, score_dataset


def test_a_file_of_another_format_is_refused(tmp_path):
    (tmp_path / "text.db").write_text("not a database " * 100)
    with pytest.raises(ValueError, match=r"text\.db is not a file of scores"):
        ScoreStore(tmp_path / "text.db")
    with sqlite3.connect(tmp_path / "other.db") as other:
        other.execute("CREATE TABLE scores (x)")
    for create in (False, True):
        with pytest.raises(ValueError, match=r"other\.db is not a file of scores"):
            ScoreStore(tmp_path / "other.db", create=create)
    with pytest.raises(FileNotFoundError):
        ScoreStore(tmp_path / "none.db")
    assert not (tmp_path / "none.db").exists()


def test_a_place_that_holds_no_file_is_said_with_its_name(topple, tmp_path):
    with pytest.raises(IsADirectoryError, match=str(tmp_path)):
        score_dataset(topple, tmp_path, ["force"])
    with pytest.raises(PermissionError, match=r"must be writable.*/proc/s\.db"):
        score_dataset(topple, "/proc/s.db", ["force"])


def test_a_file_of_a_newer_version_is_refused_with_the_advice_to_update(topple, tmp_path):
    score_dataset(topple, tmp_path / "s.db", ["force"])
    with sqlite3.connect(tmp_path / "s.db") as file:
        file.execute("PRAGMA user_version = 99")
    with pytest.raises(ValueError, match=r"version 99.*update"):
        ScoreStore(tmp_path / "s.db")


def test_a_full_disk_is_said_and_what_was_kept_before_is_safe(topple, tmp_path):
    path = tmp_path / "s.db"
    found = []
    scoring.score(topple.problems(), ["force"], on_rows=found.extend)
    with ScoreStore(path, create=True) as store:
        run = begin_run(store, topple, ["force"], SearchSettings())
        run.pose({row.index: row.index.to_bytes(32, "big") for row in found})
        run.add_rows(found[:2])
        (pages,) = store.database.execute("PRAGMA page_count").fetchone()
        store.database.execute(f"PRAGMA max_page_count = {pages}")
        with pytest.raises(OSError, match=r"the disk is full.*goes on.*s\.db"):
            for copy in range(10**4):
                run.pose({10**6 + copy: copy.to_bytes(32, "little")})
        store.database.execute(f"PRAGMA max_page_count = {2**30}")
        assert run.counts() == (2, 6)
        run.add_rows(found[2:])
        assert run.counts() == (6, 6)


def test_a_second_scorer_is_refused_with_the_process_of_the_first(topple, tmp_path):
    path = tmp_path / "s.db"
    with ScoreStore(path, create=True):
        with pytest.raises(
            ValueError, match=rf"process {os.getpid()} is scoring into .*s\.db: let"
        ):
            score_dataset(topple, path, ["force"])
        with ScoreStore(path) as reader:
            assert reader.runs() == []
    assert score_dataset(topple, path, ["force"])
    assert os.listdir(tmp_path) == ["s.db"]


def test_a_file_that_another_program_holds_is_said(topple, tmp_path, monkeypatch):
    path = tmp_path / "s.db"
    monkeypatch.setattr(answer_file, "WAIT", 0.1)
    score_dataset(topple, path, ["force"])
    with sqlite3.connect(path, isolation_level=None) as other, ScoreStore(path) as store:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(TimeoutError, match=r"s\.db was held by another"), store.transaction():
            pass
        other.execute("ROLLBACK")
        with store.transaction():  # and it goes on afterwards
            pass


def test_a_file_whose_tables_are_others_is_refused(topple, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["force"])
    with sqlite3.connect(path) as file:
        file.execute("ALTER TABLE datasets RENAME COLUMN states TO stages")
    with pytest.raises(ValueError, match=r"scores\.db is damaged: its tables are not those"):
        ScoreStore(path)


def said(path):
    """All that a file of scores says of its states."""
    with ScoreStore(path) as store:
        run = store.run()
        return run.settings, run.task, run.parameters, list(run.rows())


def test_a_bit_that_has_changed_is_refused_or_says_nothing(topple, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["capture", "force"], nodes=20)
    kept, known, random = path.read_bytes(), said(path), np.random.default_rng(0)
    fraction = next(value for value in scores(path)["force"] if value % 1.0)
    value = kept.index(struct.pack(">d", fraction))
    of_value = [(value + byte, bit) for byte in range(8) for bit in range(8)]
    anywhere = random.integers((len(kept), 8), size=(200, 2)).tolist()
    refused = []
    for place, bit in of_value + anywhere:
        other = bytearray(kept)
        other[place] ^= 1 << bit
        path.write_bytes(other)
        try:
            assert said(path) == known
        except ValueError as error:
            assert str(path) in str(error)
            refused.append((place, bit))
    assert set(of_value) <= set(refused)


def test_a_file_that_is_changed_on_purpose_is_accepted_as_the_error_says(topple, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["force"])
    with sqlite3.connect(path) as file:
        file.execute("UPDATE scores SET value = 7")
    with pytest.raises(ValueError, match=r"scores\.db is damaged.* DELETE FROM checksum in SQLite"):
        ScoreStore(path)
    with sqlite3.connect(path) as file:
        file.execute("DELETE FROM checksum")
    assert set(scores(path)["force"]) == {7.0}


def test_a_file_that_is_left_by_an_error_has_no_checksum_and_goes_on(topple, tmp_path):
    path = tmp_path / "scores.db"
    with pytest.raises(Stop):
        score_dataset(topple, path, metrics=["force"], progress=stop_after(2))
    assert rows(path, "checksum") == 0
    score_dataset(topple, path, metrics=["force"])
    assert rows(path, "checksum") == 1


def test_a_file_to_which_nothing_is_added_stays_as_it_is(topple, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["force"])
    kept = path.read_bytes()
    score_dataset(topple, path, metrics=["force"])
    assert path.read_bytes() == kept


def test_statistics_of_sqlite_are_no_damage(topple, topple_scores, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["force"])
    with sqlite3.connect(path) as file:
        file.execute("ANALYZE")
        assert file.execute("SELECT count(*) FROM sqlite_stat1").fetchone()[0] > 0
    assert score_dataset(topple, path, metrics=["force"])
    assert np.array_equal(scores(path)["force"], topple_scores["force"])


def renamed_after(count, path, new):
    """A progress that gives the file another name once so many states are scored."""

    def progress(done, _total):
        if done >= count and not new.exists():
            os.rename(path, new)

    return progress


@pytest.mark.parametrize("count", [1, 3])
def test_a_file_that_is_renamed_while_it_is_scored_is_said_and_has_all_scores(
    topple, tmp_path, count
):
    path, new = tmp_path / "scores.db", tmp_path / "new.db"
    done = 0
    rename = renamed_after(count, path, new)

    def progress(scored, total):
        nonlocal done
        done = scored
        rename(scored, total)

    with pytest.raises(FileNotFoundError, match="was renamed or removed while it") as said:
        score_dataset(
            topple, path, ["capture"], settings=SearchSettings(nodes=20), progress=progress
        )
    assert said.value.filename == str(path)
    with ScoreStore(new) as store:
        assert store.run().counts()[0] >= done >= count
    os.rename(new, path)
    assert score_dataset(topple, path, ["capture"], settings=SearchSettings(nodes=20))
    expected = em.score(topple.problems(), ["capture"], nodes=20)
    assert np.array_equal(scores(path)["capture"], expected["capture"])


def test_a_file_whose_place_another_takes_is_not_mistaken_for_it(topple, tmp_path):
    path, new = tmp_path / "scores.db", tmp_path / "new.db"
    other = tmp_path / "other.db"
    with ScoreStore(other, create=True):
        pass

    def progress(done, _total):
        if done and other.exists():
            os.rename(path, new)
            os.rename(other, path)

    with pytest.raises(FileNotFoundError, match="was renamed or removed"):
        score_dataset(topple, path, ["force"], progress=progress)
    with ScoreStore(path) as store:
        assert store.runs() == []
    with ScoreStore(new) as store:
        assert store.run().counts()[0] > 0


def test_a_file_that_is_removed_while_it_is_scored_is_said(topple, tmp_path):
    path = tmp_path / "scores.db"

    def progress(done, _total):
        if done:
            path.unlink(missing_ok=True)

    with pytest.raises(FileNotFoundError, match=r"was renamed or removed while it was written"):
        score_dataset(topple, path, ["force"], progress=progress)


def test_a_process_that_changes_its_folder_goes_on(topple, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "inner").mkdir()

    def progress(_done, _total):
        monkeypatch.chdir(tmp_path / "inner")

    assert score_dataset(topple, "scores.db", ["force"], progress=progress)
