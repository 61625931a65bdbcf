"""Stores of versions 5 and 6 are read and go on; older ones are refused, older scores stay."""

import sqlite3

import pytest
from stores import SETTINGS, Counts, changed, same, scores

from energymargin.evaluate.searches import ALGORITHM
from energymargin.store import ScoreStore, score_dataset

OF_VERSION_6 = """
ALTER TABLE datasets ADD COLUMN digest_2 TEXT;
CREATE TABLE scorers (id INTEGER PRIMARY KEY, host TEXT, process INTEGER, until REAL);
CREATE TABLE claims (problem INTEGER, stream INTEGER, question INTEGER, scorer INTEGER);
INSERT INTO scorers VALUES (1, 'here', 1, 0);
INSERT INTO claims VALUES (1, 0, 1, 1);
DELETE FROM checksum;
PRAGMA user_version = 6;
"""
OF_VERSION_5 = OF_VERSION_6 + "DROP TABLE checksum; PRAGMA user_version = 5;"


@pytest.mark.parametrize("older", [OF_VERSION_5, OF_VERSION_6])
def test_a_store_of_version_5_or_6_is_read_and_goes_on(topple, topple_scores, tmp_path, older):
    path, counts = tmp_path / "s.db", Counts()
    score_dataset(topple, path, settings=SETTINGS)
    with sqlite3.connect(path) as file:
        file.executescript(older)
    assert same(scores(path), topple_scores)
    with sqlite3.connect(path) as file:
        assert file.execute("PRAGMA user_version").fetchone() == (7,)
        assert file.execute("SELECT count(*) FROM checksum").fetchone() == (1,)
        tables = [name for (name,) in file.execute("SELECT name FROM sqlite_master")]
        assert not {"claims", "scorers"} & set(tables)
    changed(path, "DELETE FROM scores WHERE stream < 3")
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (3, 6) and same(scores(path), topple_scores)


@pytest.mark.parametrize("version", [1, 4])
def test_an_older_store_is_refused_and_stays_as_it_was(topple, tmp_path, version):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["force"], settings=SETTINGS)
    with sqlite3.connect(path) as file:
        file.execute(f"PRAGMA user_version = {version}")
    before = path.read_bytes()
    with pytest.raises(ValueError, match=rf"version {version} of .* reads versions 5 to 7: open"):
        ScoreStore(path)
    assert path.read_bytes() == before


def test_scores_of_another_algorithm_are_kept_and_not_taken_for_those_of_this_one(
    topple, topple_scores, tmp_path
):
    path, counts = tmp_path / "s.db", Counts()
    score_dataset(topple, path, settings=SETTINGS)
    changed(path, "UPDATE questions SET algorithm = '0.5.0'")
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (0, 6) and same(scores(path, 2), topple_scores)
    with ScoreStore(path) as store:
        assert [store.run(run.number).algorithm for run in store.runs()] == ["0.5.0", ALGORITHM]
        assert [store.run(run.number).counts() for run in store.runs()] == [(6, 6), (6, 6)]
