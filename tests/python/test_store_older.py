"""Stores of older versions are migrated, and go on."""

import json
import sqlite3
from dataclasses import replace

import numpy as np
import older_stores
import pytest
from stores import NODES, SEED, SETTINGS, Counts, Stop, changed, rows, same, scores, stop_after

import energymargin as em
from energymargin import datasets
from energymargin.scoring.settings import ALGORITHM, SearchSettings
from energymargin.store import ScoreStore, schema, score_dataset


@pytest.mark.parametrize("version", [1, 2])
def test_an_older_file_is_migrated_and_goes_on(topple, topple_scores, tmp_path, version):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED}
    older_stores.write(path, topple, topple_scores.scores, settings, states=4, version=version)
    with ScoreStore(path) as store:
        run = store.run()
        assert run.counts() == (4, 6) and run.seconds() == pytest.approx(0.25)
        assert run.settings == SETTINGS.all() and run.algorithm == ALGORITHM
        kept = run.labelled_scores().scores
        assert np.array_equal(kept["effort/est"][:4], topple_scores["effort/est"][:4])
        assert np.isnan(kept["capture"][4:]).all()
    counts = Counts()
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (4, 6)
    assert same(scores(path), topple_scores)
    longer = datasets.generate("topple", trajectories=3, frames=3, seed=0)
    with pytest.raises(Stop):  # the migrated scores are known by what was scored
        score_dataset(longer, path, settings=SETTINGS, progress=stop_after(6))
    assert rows(path, "scores") == 6 * 5


def test_a_file_with_one_problem_a_state_is_migrated_and_goes_on(topple, topple_scores, tmp_path):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED, "nodes_per_edge": 1, "rollouts": 30}
    settings |= {"least_likelihood": 0.0, "stop_at_escape": False}
    questions = {metric: SETTINGS.of(metric) for metric in topple_scores.scores}
    older_stores.write_3(path, topple, topple_scores.scores, questions, settings, states=4)
    with ScoreStore(path) as store:
        run = store.run()
        assert run.counts() == (4, 6) and run.missing() == [4, 5] and run.future is None
        assert run.settings == SETTINGS.all() and run.seconds() == pytest.approx(0.25)
        kept = run.labelled_scores().scores
        for metric, values in kept.items():
            assert (
                np.array_equal(values[:4], topple_scores[metric][:4]) and np.isnan(values[4:]).all()
            )
        assert store.database.execute("PRAGMA foreign_key_check").fetchall() == []
        assert store.database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    counts = Counts()
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (4, 6) and same(scores(path), topple_scores)
    assert rows(path, "runs") == 1 and rows(path, "scores") == 6 * 5


def test_efforts_of_a_file_that_names_no_search_are_of_the_published_one(
    topple, topple_scores, tmp_path
):
    path = tmp_path / "s.db"
    score_dataset(topple, path, ["effort/est"], settings=SETTINGS)
    unnamed = json.dumps({k: v for k, v in SETTINGS.all().items() if k != "search"})
    with sqlite3.connect(path) as file:
        assert "search" not in file.execute("SELECT settings FROM questions").fetchone()[0]
    changed(path, "UPDATE runs SET settings = ?", (unnamed,))
    improved = replace(SETTINGS, search="improved")
    for settings in (SETTINGS, improved):
        score_dataset(topple, path, ["effort/est"], settings=settings)
    with ScoreStore(path) as store:
        assert [run.settings for run in store.runs()] == [SETTINGS.all(), improved.all()]
        assert all(run.up_to_date for run in store.runs())
        old, new = (run.labelled_scores().scores["effort/est"] for run in store.runs())
    assert np.array_equal(old, topple_scores["effort/est"]) and not np.array_equal(old, new)


def test_a_probability_that_was_asked_before_its_disturbance_had_settings_is_known_again():
    assert SearchSettings().of("probability") == {"rollouts": 30, "seed": 0}


def test_a_migration_that_is_cut_short_leaves_the_older_file_as_it_was(
    topple, topple_scores, tmp_path, monkeypatch
):
    path = tmp_path / "s.db"
    questions = {metric: SETTINGS.of(metric) for metric in topple_scores.scores}
    older_stores.write_3(path, topple, topple_scores.scores, questions, SETTINGS.all(), states=6)

    def full(settings):
        raise OSError("no room")

    monkeypatch.setattr(schema, "with_those_before", full)
    with pytest.raises(OSError, match="no room"):
        ScoreStore(path)
    monkeypatch.undo()
    with sqlite3.connect(path) as file:
        assert file.execute("PRAGMA user_version").fetchone() == (3,)
        tables = file.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'")
        assert tables.fetchall() == [] and rows(path, "states") == 6
    assert same(scores(path), topple_scores)


def test_scores_of_another_algorithm_are_kept_and_not_taken_for_those_of_this_one(
    topple, topple_scores, tmp_path
):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED}
    older_stores.write(path, topple, topple_scores.scores, settings, made_by="0.5.0")
    counts = Counts()
    score_dataset(topple, path, settings=SETTINGS, progress=counts)
    assert counts[0] == (0, 6)
    with ScoreStore(path) as store:
        assert [store.run(run.number).algorithm for run in store.runs()] == ["0.5.0", ALGORITHM]
        assert [store.run(run.number).counts() for run in store.runs()] == [(6, 6), (6, 6)]


def test_equal_states_of_an_older_file_keep_a_score_each(topple, tmp_path):
    twice = replace(topple, trajectories=[topple.trajectories[0]] * 2)
    capture = em.score(twice.problems(), ["capture"], nodes=NODES, seed=SEED)["capture"]
    path, counts = tmp_path / "s.db", Counts()
    older_stores.write(path, twice, {"capture": capture}, {"nodes": NODES, "seed": SEED})
    score_dataset(twice, path, ["capture"], settings=SETTINGS, progress=counts)
    assert counts[0] == (6, 6) and scores(path)["capture"].tolist() == capture.tolist()


def test_an_older_file_of_another_dataset_keeps_its_scores(topple, topple_scores, tmp_path):
    path = tmp_path / "s.db"
    older_stores.write(path, topple, topple_scores.scores, {"nodes": NODES, "seed": SEED})
    other = datasets.generate("topple", trajectories=2, frames=3, seed=9)
    score_dataset(other, path, ["force"], settings=SETTINGS)
    assert same(scores(path, 1), topple_scores) and list(scores(path, 2)) == ["force"]
