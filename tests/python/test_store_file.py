"""The file of a store: what it is, who writes it, and what happens to it meanwhile."""

import os
import re
import signal
import sqlite3
import struct
import threading
from contextlib import ExitStack

import numpy as np
import pytest
from stores import Stop, rows, same, scores, stop_after

import energymargin as em
from energymargin import datasets, scoring
from energymargin.interrupts import held_interrupts
from energymargin.searches import SearchSettings
from energymargin.store import ScoreStore, score_dataset
from energymargin.store.claims import Scorer
from energymargin.store.scoring import begin_run


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
        with Scorer(store, run) as scorer:
            scorer.claim({row.index: row.index.to_bytes(32, "big") for row in found})
            scorer.add(found[:2])
            (pages,) = store.database.execute("PRAGMA page_count").fetchone()
            store.database.execute(f"PRAGMA max_page_count = {pages}")
            with pytest.raises(OSError, match=r"the disk is full.*goes on.*s\.db"):
                for copy in range(10**4):
                    scorer.claim({10**6 + copy: copy.to_bytes(32, "little")})
            store.database.execute(f"PRAGMA max_page_count = {2**30}")
            assert run.counts() == (2, 6)
            scorer.add(found[2:])
        assert run.counts() == (6, 6)


def test_what_one_scorer_has_claimed_is_not_for_another(topple, tmp_path):
    digests = {number: number.to_bytes(32, "big") for number in range(6)}
    found = []
    scoring.score(topple.problems(), ["force"], on_rows=found.extend)
    found.sort(key=lambda row: row.index)
    with ScoreStore(tmp_path / "s.db", create=True) as store:
        run = begin_run(store, topple, ["force"], SearchSettings())
        with Scorer(store, run) as one, ScoreStore(store.path) as again:
            with Scorer(again, again.run()) as other:
                assert all(claim.metrics for claim in one.claim(digests).values())
                refused = other.claim(digests)
                assert all(claim.taken and not claim.metrics for claim in refused.values())
                one.add(found[:3])
                one.give_up([3])
                left = other.claim(digests)
                assert [n for n, claim in left.items() if claim.metrics] == [3]
                assert [n for n, claim in left.items() if claim.taken] == [4, 5]
            assert not store.database.execute(
                "SELECT * FROM claims WHERE stream = 3"
            ).fetchall()  # it has signed off


def test_each_further_scorer_begins_far_from_the_others(topple, tmp_path):
    with ScoreStore(tmp_path / "s.db", create=True) as store, ExitStack() as stack:
        run = begin_run(store, topple, ["force"], SearchSettings())
        starts = [stack.enter_context(Scorer(store, run)).start for _ in range(4)]
    assert starts == [0, 3, 1, 4]  # of 6


def test_ctrl_c_is_heard_while_another_process_holds_the_file(topple, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["force"])
    with sqlite3.connect(path, isolation_level=None) as other, ScoreStore(path) as store:
        other.execute("BEGIN IMMEDIATE")
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt), held_interrupts(), store.transaction():
            pass
        other.execute("ROLLBACK")
        with store.transaction():  # and it goes on afterwards
            pass


def test_two_scorers_at_once_share_the_work(tmp_path):
    topple = datasets.generate("topple", trajectories=20, frames=10, seed=0)
    path, settings = tmp_path / "s.db", SearchSettings(nodes=30)
    done, one = [], em.executors.Threads(1)
    both = [
        threading.Thread(
            target=lambda: done.append(score_dataset(topple, path, settings=settings, executor=one))
        )
        for _ in range(2)
    ]
    for scorer in both:
        scorer.start()
    for scorer in both:
        scorer.join()
    assert done == [True, True]
    assert rows(path, "scores") == 200 * 5 and rows(path, "runs") == 1
    assert same(scores(path), em.score(topple.problems(), nodes=30))


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


def test_a_file_without_a_checksum_of_version_5_is_read_and_gets_one(topple, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(topple, path, metrics=["force"])
    known = scores(path)["force"]
    with sqlite3.connect(path) as file:
        file.execute("DROP TABLE checksum")
        file.execute("PRAGMA user_version = 5")
    assert np.array_equal(scores(path)["force"], known) and rows(path, "checksum") == 1


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

    words = rf"was renamed to {re.escape(str(new))} while it was written"
    with pytest.raises(FileNotFoundError, match=words) as said:
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

    with pytest.raises(FileNotFoundError, match="was renamed to"):
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

    with pytest.raises(FileNotFoundError, match=r"was removed while it was written, and what"):
        score_dataset(topple, path, ["force"], progress=progress)


def test_a_process_that_changes_its_folder_goes_on(topple, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "inner").mkdir()

    def progress(_done, _total):
        monkeypatch.chdir(tmp_path / "inner")

    assert score_dataset(topple, "scores.db", ["force"], progress=progress)
