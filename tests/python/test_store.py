import json
import os
import re
import signal
import sqlite3
import threading
import time
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import older_stores
import pytest
from stores import rows, scores

import energymargin as em
from energymargin import datasets, scoring
from energymargin.interrupts import held_interrupts
from energymargin.metrics import METRICS, TIMED
from energymargin.settings import ALGORITHM, SearchSettings
from energymargin.store import ScoreStore, schema, score_dataset
from energymargin.store.claims import Scorer
from energymargin.store.scoring import begin_run, score_run

NODES, SEED = 20, 3
SETTINGS = SearchSettings(nodes=NODES, seed=SEED, search="published")  # as older files


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("topple", trajectories=2, frames=3, seed=0)


@pytest.fixture(scope="module")
def table(dataset):
    return scoring.score(dataset.problems(), nodes=NODES, seed=SEED, search="published")


class Stop(Exception):
    pass


def stop_after(count):
    def progress(done, _total):
        if done >= count:
            raise Stop

    return progress


def same(found, table):
    return set(found) == set(table.scores) and all(
        np.array_equal(found[metric], table[metric]) for metric in found
    )


def test_a_file_holds_every_score_and_label_to_the_last_bit(dataset, table, tmp_path):
    assert score_dataset(dataset, tmp_path / "s.db", settings=SETTINGS)
    with ScoreStore(tmp_path / "s.db") as store:
        run = store.run()
        labelled = run.labelled_scores()
        assert run.counts() == (6, 6) and run.missing() == [] and run.task == "topple"
        assert run.seconds() == pytest.approx(sum(run.times().values()) / 6) and run.seconds() > 0
    assert same(labelled.scores, table)
    assert labelled.trajectory.tolist() == [0, 0, 0, 1, 1, 1]
    assert labelled.captured.tolist() == [c for t in dataset.trajectories for c in t.captured]
    assert labelled.success.tolist() == [t.success for t in dataset.trajectories for _ in range(3)]


def test_a_run_that_was_stopped_goes_on_to_the_same_scores(dataset, table, tmp_path):
    path, one = tmp_path / "s.db", em.executors.Threads(1)
    with pytest.raises(Stop):
        score_dataset(dataset, path, settings=SETTINGS, executor=one, progress=stop_after(2))
    with ScoreStore(path) as store:
        run = store.run()
        kept, total = run.counts()
        assert 2 <= kept < total and len(run.missing()) == total - kept
        assert np.isnan(run.labelled_scores().scores["capture"]).sum() == total - kept
    assert rows(path, "claims") == rows(path, "scorers") == 0
    counts = []
    score_dataset(dataset, path, settings=SETTINGS, progress=lambda *count: counts.append(count))
    assert counts[0] == (kept, 6) and counts[-1] == (6, 6)
    assert same(scores(path), table)


def test_only_what_is_missing_is_computed(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["capture", "force"], settings=SETTINGS)
    with sqlite3.connect(path) as file:
        marked = "UPDATE scores SET value = value + 2, seconds = 0"
        file.execute(marked)
    score_dataset(dataset, path, None, settings=SETTINGS)
    found = scores(path, 2)
    for metric in ("capture", "force"):
        assert np.array_equal(found[metric], table[metric] + 2)
    for metric in ("success", "effort/est", "effort/rrt"):
        assert np.array_equal(found[metric], table[metric])


def test_other_settings_are_another_run_and_share_what_they_have_in_common(dataset, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["effort/rrt", "force"], settings=SETTINGS)
    for other in (replace(SETTINGS, nodes=200), replace(SETTINGS, seed=4)):
        score_dataset(dataset, path, ["effort/rrt", "force"], settings=other)
    with ScoreStore(path) as store:
        settings = [(run.settings["nodes"], run.settings["seed"]) for run in store.runs()]
        assert settings == [(20, 3), (200, 3), (20, 4)]
        with pytest.raises(ValueError, match=r"has 3 runs, choose one .*run 2: topple, 6 of 6"):
            store.run()
        with pytest.raises(ValueError, match=r"run is 4, and .* has run 1: topple"):
            store.run(4)
    assert rows(path, "scores") == 3 * 6 + 6  # the force score has no settings
    efforts = [scores(path, run)["effort/rrt"] for run in (1, 2, 3)]
    assert not np.array_equal(efforts[0], efforts[1])
    assert not np.array_equal(efforts[0], efforts[2])


def test_a_longer_dataset_computes_what_it_has_more(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, settings=SETTINGS)
    longer = datasets.generate("topple", trajectories=3, frames=3, seed=0)
    with pytest.raises(Stop):
        score_dataset(longer, path, settings=SETTINGS, progress=stop_after(6))
    assert rows(path, "scores") == 6 * 5
    score_dataset(longer, path, settings=SETTINGS)
    assert rows(path, "scores") == 9 * 5
    found = scores(path, 2)
    assert all(np.array_equal(found[metric][:6], table[metric]) for metric in found)


def test_a_task_whose_code_was_changed_is_scored_anew(dataset, table, tmp_path, monkeypatch):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["effort/rrt"], settings=SETTINGS)
    made = em.tasks.make("topple")
    original = type(made).problem

    def problem(self, *arguments):
        asked = original(self, *arguments)
        return em.Problem(
            asked.scene,
            asked.state,
            force=asked.force,
            torque=asked.torque,
            duration=0.9 * asked.duration,
            captured=asked.captured,
            succeeded=asked.succeeded,
        )

    monkeypatch.setattr(type(made), "problem", problem)
    score_dataset(dataset, path, ["effort/rrt"], settings=SETTINGS)
    changed = em.score(
        dataset.problems(), ["effort/rrt"], nodes=NODES, seed=SEED, search="published"
    )
    assert np.array_equal(scores(path)["effort/rrt"], changed["effort/rrt"])
    assert not np.array_equal(changed["effort/rrt"], table["effort/rrt"])
    monkeypatch.undo()
    score_dataset(dataset, path, ["effort/rrt"], settings=SETTINGS)
    assert np.array_equal(scores(path)["effort/rrt"], table["effort/rrt"])
    assert rows(path, "scores") == 12  # nothing was computed a third time


def test_the_labels_of_at_least_one_object_are_kept(tmp_path):
    several = datasets.generate("scoop", trajectories=2, frames=3, seed=0)
    score_dataset(several, tmp_path / "s.db", settings=SearchSettings(nodes=5))
    with ScoreStore(tmp_path / "s.db") as store:
        labelled = store.run().labelled_scores()
    assert set(labelled.scores) == set(METRICS) - set(TIMED)
    some = [label for t in several.trajectories for label in t.captured_any]
    assert labelled.captured_any.tolist() == some
    ends = [t.success_any for t in several.trajectories for _ in range(3)]
    assert labelled.success_any.tolist() == ends


@pytest.mark.parametrize("version", [1, 2])
def test_an_older_file_is_migrated_and_goes_on(dataset, table, tmp_path, version):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED}
    older_stores.write(path, dataset, table.scores, settings, states=4, version=version)
    with ScoreStore(path) as store:
        run = store.run()
        assert run.counts() == (4, 6) and run.seconds() == pytest.approx(0.25)
        assert run.settings == SETTINGS.all() and run.algorithm == ALGORITHM
        kept = run.labelled_scores().scores
        assert np.array_equal(kept["effort/est"][:4], table["effort/est"][:4])
        assert np.isnan(kept["capture"][4:]).all()
    counts = []
    score_dataset(dataset, path, settings=SETTINGS, progress=lambda *count: counts.append(count))
    assert counts[0] == (4, 6)
    assert same(scores(path), table)
    longer = datasets.generate("topple", trajectories=3, frames=3, seed=0)
    with pytest.raises(Stop):  # the migrated scores are known by what was scored
        score_dataset(longer, path, settings=SETTINGS, progress=stop_after(6))
    assert rows(path, "scores") == 6 * 5


def test_a_file_with_one_problem_a_state_is_migrated_and_goes_on(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED, "nodes_per_edge": 1, "rollouts": 30}
    settings |= {"least_likelihood": 0.0, "stop_at_escape": False}
    questions = {metric: SETTINGS.of(metric) for metric in table.scores}
    older_stores.write_3(path, dataset, table.scores, questions, settings, states=4)
    with ScoreStore(path) as store:
        run = store.run()
        assert run.counts() == (4, 6) and run.missing() == [4, 5] and run.future is None
        assert run.settings == SETTINGS.all() and run.seconds() == pytest.approx(0.25)
        kept = run.labelled_scores().scores
        for metric, values in kept.items():
            assert np.array_equal(values[:4], table[metric][:4]) and np.isnan(values[4:]).all()
        assert store.database.execute("PRAGMA foreign_key_check").fetchall() == []
        assert store.database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    counts = []
    score_dataset(dataset, path, settings=SETTINGS, progress=lambda *count: counts.append(count))
    assert counts[0] == (4, 6) and same(scores(path), table)
    assert rows(path, "runs") == 1 and rows(path, "scores") == 6 * 5


def test_efforts_of_a_file_that_names_no_search_are_of_the_published_one(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["effort/est"], settings=SETTINGS)
    unnamed = json.dumps({k: v for k, v in SETTINGS.all().items() if k != "search"})
    with sqlite3.connect(path) as file:
        assert "search" not in file.execute("SELECT settings FROM questions").fetchone()[0]
        file.execute("UPDATE runs SET settings = ?", (unnamed,))
    improved = replace(SETTINGS, search="improved")
    for settings in (SETTINGS, improved):
        score_dataset(dataset, path, ["effort/est"], settings=settings)
    with ScoreStore(path) as store:
        assert [run.settings for run in store.runs()] == [SETTINGS.all(), improved.all()]
        assert all(run.up_to_date for run in store.runs())
        old, new = (run.labelled_scores().scores["effort/est"] for run in store.runs())
    assert np.array_equal(old, table["effort/est"]) and not np.array_equal(old, new)


def test_a_probability_that_was_asked_before_its_disturbance_had_settings_is_known_again():
    assert SearchSettings().of("probability") == {"rollouts": 30, "seed": 0}


def test_a_migration_that_is_cut_short_leaves_the_older_file_as_it_was(
    dataset, table, tmp_path, monkeypatch
):
    path = tmp_path / "s.db"
    questions = {metric: SETTINGS.of(metric) for metric in table.scores}
    older_stores.write_3(path, dataset, table.scores, questions, SETTINGS.all(), states=6)

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
    assert same(scores(path), table)


def test_scores_of_another_algorithm_are_kept_and_not_taken_for_those_of_this_one(
    dataset, table, tmp_path
):
    path = tmp_path / "s.db"
    settings = {"nodes": NODES, "seed": SEED}
    older_stores.write(path, dataset, table.scores, settings, made_by="0.5.0")
    counts = []
    score_dataset(dataset, path, settings=SETTINGS, progress=lambda *count: counts.append(count))
    assert counts[0] == (0, 6)
    with ScoreStore(path) as store:
        assert [store.run(run.number).algorithm for run in store.runs()] == ["0.5.0", ALGORITHM]
        assert [store.run(run.number).counts() for run in store.runs()] == [(6, 6), (6, 6)]


def test_the_algorithm_of_a_run_is_the_newest_and_not_the_last_of_the_alphabet(dataset, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["capture", "force"], settings=SearchSettings(nodes=1))
    with sqlite3.connect(path) as file:
        file.execute("UPDATE questions SET algorithm = '0.10.0' WHERE metric = 'force'")
    with ScoreStore(path) as store:
        assert store.run().algorithm == "0.10.0"


def test_an_infinite_effort_survives_the_file(dataset, tmp_path):
    expected = em.score(dataset.problems(), ["effort/est"], nodes=1)["effort/est"]
    assert np.isinf(expected).any()
    score_dataset(dataset, tmp_path / "s.db", ["effort/est"], settings=SearchSettings(nodes=1))
    assert scores(tmp_path / "s.db")["effort/est"].tolist() == expected.tolist()


def test_a_problem_that_cannot_be_written_down_is_known_by_where_it_stands(
    dataset, tmp_path, monkeypatch
):
    task = type(em.tasks.make("topple"))
    original = task.problem

    def problem(self, *arguments):
        asked = original(self, *arguments)
        inside = em.regions.Predicate(lambda z: np.ones(len(z), dtype=bool))
        return em.Problem(
            asked.scene,
            asked.state,
            force=asked.force,
            torque=asked.torque,
            duration=asked.duration,
            captured=inside,
        )

    monkeypatch.setattr(task, "problem", problem)
    assert score_dataset(dataset, tmp_path / "s.db", ["capture"], settings=SearchSettings(nodes=5))
    assert scores(tmp_path / "s.db")["capture"].tolist() == [1.0] * 6
    with pytest.raises(ValueError, match=r"problem 0 cannot be sent .*: use threads"):
        score_dataset(
            dataset,
            tmp_path / "p.db",
            ["capture"],
            settings=SearchSettings(nodes=5),
            executor=em.executors.Processes(1),
        )


def test_the_same_settings_in_other_types_are_the_same_run(dataset, tmp_path):
    for nodes, least_likelihood in ((1, 0.0), (np.int64(1), 0), (1, np.float32(-0.0))):
        settings = SearchSettings(nodes, least_likelihood=least_likelihood)
        score_dataset(dataset, tmp_path / "s.db", ["capture"], settings=settings)
    assert rows(tmp_path / "s.db", "runs") == rows(tmp_path / "s.db", "questions") == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"least_likelihood": "much"},
        {"least_likelihood": None},
        {"least_likelihood": float("nan")},
        {"stop_at_escape": "yes"},
        {"search": "ours"},
        {"strength": -0.1},
        {"strength": float("inf")},
        {"strength": True},
        {"objects": 0},
        {"objects": 1.5},
        {"common_random_numbers": 1},
    ],
)
def test_settings_of_another_kind_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SearchSettings(**wrong)


def test_a_state_that_makes_no_problem_leaves_the_others_their_scores(
    dataset, table, tmp_path, monkeypatch
):
    task, bad = type(em.tasks.make("topple")), dataset.trajectories[0].states[2]
    original = task.problem

    def problem(self, state, *arguments):
        if np.array_equal(state, bad):
            raise ValueError("state is no good")
        return original(self, state, *arguments)

    monkeypatch.setattr(task, "problem", problem)
    words = r"1 of 6 problems .*problem 2: trajectory 0, frame 2: state is no good"
    for _ in range(2):
        with pytest.raises(em.ScoreError, match=words):
            score_dataset(dataset, tmp_path / "s.db", settings=SETTINGS)
    for metric, found in scores(tmp_path / "s.db").items():
        assert np.array_equal(np.delete(found, 2), np.delete(table[metric], 2))
    one = em.datasets.Dataset("topple", dataset.parameters, 0, [dataset.trajectories[0]])
    monkeypatch.setattr(task, "problem", lambda self, *arguments: problem(self, bad))
    with pytest.raises(ValueError, match="trajectory 0, frame 0: state is no good"):
        score_dataset(one, tmp_path / "n.db", settings=SETTINGS)
    assert not (tmp_path / "n.db").exists()


def test_bad_settings_leave_no_file(dataset, tmp_path):
    with pytest.raises(ValueError, match="nodes"):
        score_dataset(dataset, tmp_path / "s.db", settings=SearchSettings(nodes=0))
    with pytest.raises(ValueError, match=r"settings is \{\}, expected SearchSettings"):
        score_dataset(dataset, tmp_path / "s.db", settings={})
    with pytest.raises(ValueError, match="executor is 0, expected Threads"):
        score_dataset(dataset, tmp_path / "s.db", executor=0)
    with pytest.raises(ValueError, match="capture/any"):
        score_dataset(dataset, tmp_path / "s.db", ["capture/any"])
    with pytest.raises(ValueError, match="beauty"):
        score_dataset(dataset, tmp_path / "s.db", ["beauty"])
    assert list(tmp_path.iterdir()) == []


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


def test_a_place_that_holds_no_file_is_said_with_its_name(dataset, tmp_path):
    with pytest.raises(IsADirectoryError, match=str(tmp_path)):
        score_dataset(dataset, tmp_path, ["force"])
    with pytest.raises(PermissionError, match=r"must be writable.*/proc/s\.db"):
        score_dataset(dataset, "/proc/s.db", ["force"])


def test_a_file_of_a_newer_version_is_refused_with_the_advice_to_update(dataset, tmp_path):
    score_dataset(dataset, tmp_path / "s.db", ["force"])
    with sqlite3.connect(tmp_path / "s.db") as file:
        file.execute("PRAGMA user_version = 99")
    with pytest.raises(ValueError, match=r"version 99.*update"):
        ScoreStore(tmp_path / "s.db")


def test_a_full_disk_is_said_and_what_was_kept_before_is_safe(dataset, tmp_path):
    path = tmp_path / "s.db"
    found = []
    scoring.score(dataset.problems(), ["force"], on_rows=found.extend)
    with ScoreStore(path, create=True) as store:
        run = begin_run(store, dataset, ["force"], SearchSettings())
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


def test_what_one_scorer_has_claimed_is_not_for_another(dataset, tmp_path):
    digests = {number: number.to_bytes(32, "big") for number in range(6)}
    found = []
    scoring.score(dataset.problems(), ["force"], on_rows=found.extend)
    found.sort(key=lambda row: row.index)
    with ScoreStore(tmp_path / "s.db", create=True) as store:
        run = begin_run(store, dataset, ["force"], SearchSettings())
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


def test_each_further_scorer_begins_far_from_the_others(dataset, tmp_path):
    with ScoreStore(tmp_path / "s.db", create=True) as store, ExitStack() as stack:
        run = begin_run(store, dataset, ["force"], SearchSettings())
        starts = [stack.enter_context(Scorer(store, run)).start for _ in range(4)]
    assert starts == [0, 3, 1, 4]  # of 6


def test_ctrl_c_is_heard_while_another_process_holds_the_file(dataset, tmp_path):
    path = tmp_path / "s.db"
    score_dataset(dataset, path, ["force"])
    with sqlite3.connect(path, isolation_level=None) as other, ScoreStore(path) as store:
        other.execute("BEGIN IMMEDIATE")
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt), held_interrupts(), store.transaction():
            pass
        assert time.monotonic() - start < 10  # PATIENCE is 600 s
        other.execute("ROLLBACK")
        with store.transaction():  # and it goes on afterwards
            pass


def test_two_scorers_at_once_share_the_work(tmp_path):
    dataset = datasets.generate("topple", trajectories=20, frames=10, seed=0)
    path, settings = tmp_path / "s.db", SearchSettings(nodes=30)
    done, one = [], em.executors.Threads(1)
    both = [
        threading.Thread(
            target=lambda: done.append(
                score_dataset(dataset, path, settings=settings, executor=one)
            )
        )
        for _ in range(2)
    ]
    for scorer in both:
        scorer.start()
    for scorer in both:
        scorer.join()
    assert done == [True, True]
    assert rows(path, "scores") == 200 * 5 and rows(path, "runs") == 1
    assert same(scores(path), em.score(dataset.problems(), nodes=30))


def test_equal_states_of_an_older_file_keep_a_score_each(dataset, tmp_path):
    twice = replace(dataset, trajectories=[dataset.trajectories[0]] * 2)
    capture = em.score(twice.problems(), ["capture"], nodes=NODES, seed=SEED)["capture"]
    path, counts = tmp_path / "s.db", []
    older_stores.write(path, twice, {"capture": capture}, {"nodes": NODES, "seed": SEED})
    progress = lambda *count: counts.append(count)  # noqa: E731
    score_dataset(twice, path, ["capture"], settings=SETTINGS, progress=progress)
    assert counts[0] == (6, 6) and scores(path)["capture"].tolist() == capture.tolist()


def test_an_older_file_of_another_dataset_keeps_its_scores(dataset, table, tmp_path):
    path = tmp_path / "s.db"
    older_stores.write(path, dataset, table.scores, {"nodes": NODES, "seed": SEED})
    other = datasets.generate("topple", trajectories=2, frames=3, seed=9)
    score_dataset(other, path, ["force"], settings=SETTINGS)
    assert same(scores(path, 1), table) and list(scores(path, 2)) == ["force"]


def test_a_state_that_lacks_a_success_set_is_an_error_and_keeps_its_other_scores(
    dataset, table, tmp_path, monkeypatch
):
    task = type(em.tasks.make("topple"))
    monkeypatch.setattr(task, "succeeded", lambda *_: None)
    with ScoreStore(tmp_path / "s.db", create=True) as store:
        run = begin_run(store, dataset, ["capture", "success"], SETTINGS)
        with pytest.raises(em.ScoreError, match=r"6 of 6 .*no score of success: it lacks the set"):
            score_run(dataset, run)
    assert scores(tmp_path / "s.db")["capture"].tolist() == table["capture"].tolist()


def test_a_score_that_is_no_number_is_an_error_of_its_state(dataset, tmp_path):
    first = dataset.trajectories[0]
    one = next(contact for frame in first.contacts for contact in frame)
    names = ("body_a", "body_b", "position", "normal", "distance", "tangential_force")
    of_one = {name: getattr(one, name) for name in names}
    huge = em.Contact(**of_one, normal_force=1e308, friction=1e308)
    broken = replace(first, contacts=[[huge] * 3, *first.contacts[1:]])
    with pytest.raises(em.ScoreError, match=r"1 of 3 .*problem 0: no score of force"):
        score_dataset(replace(dataset, trajectories=[broken]), tmp_path / "s.db", ["force"])
    assert np.isnan(scores(tmp_path / "s.db")["force"]).tolist() == [True, False, False]


def test_a_file_whose_tables_are_others_is_refused(dataset, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(dataset, path, metrics=["force"])
    with sqlite3.connect(path) as file:
        file.execute("ALTER TABLE datasets RENAME COLUMN states TO stages")
    with pytest.raises(ValueError, match=r"scores\.db is damaged: its tables are not those"):
        ScoreStore(path)


def test_statistics_of_sqlite_are_no_damage(dataset, table, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(dataset, path, metrics=["force"])
    with sqlite3.connect(path) as file:
        file.execute("ANALYZE")
        assert file.execute("SELECT count(*) FROM sqlite_stat1").fetchone()[0] > 0
    assert score_dataset(dataset, path, metrics=["force"])
    assert np.array_equal(scores(path)["force"], table["force"])


def renamed_after(count, path, new):
    """A progress that gives the file another name once so many states are scored."""

    def progress(done, _total):
        if done >= count and not new.exists():
            os.rename(path, new)

    return progress


@pytest.mark.parametrize("count", [1, 3])
def test_a_file_that_is_renamed_while_it_is_scored_is_said_and_has_all_scores(
    dataset, tmp_path, count
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
            dataset, path, ["capture"], settings=SearchSettings(nodes=20), progress=progress
        )
    assert said.value.filename == str(path)
    with ScoreStore(new) as store:
        assert store.run().counts()[0] >= done >= count
    os.rename(new, path)
    assert score_dataset(dataset, path, ["capture"], settings=SearchSettings(nodes=20))
    expected = em.score(dataset.problems(), ["capture"], nodes=20)
    assert np.array_equal(scores(path)["capture"], expected["capture"])


def test_a_file_whose_place_another_takes_is_not_mistaken_for_it(dataset, tmp_path):
    path, new = tmp_path / "scores.db", tmp_path / "new.db"
    other = tmp_path / "other.db"
    with ScoreStore(other, create=True):
        pass

    def progress(done, _total):
        if done and other.exists():
            os.rename(path, new)
            os.rename(other, path)

    with pytest.raises(FileNotFoundError, match="was renamed to"):
        score_dataset(dataset, path, ["force"], progress=progress)
    with ScoreStore(path) as store:
        assert store.runs() == []
    with ScoreStore(new) as store:
        assert store.run().counts()[0] > 0


def test_a_file_that_is_removed_while_it_is_scored_is_said(dataset, tmp_path):
    path = tmp_path / "scores.db"

    def progress(done, _total):
        if done:
            path.unlink(missing_ok=True)

    with pytest.raises(FileNotFoundError, match=r"was removed while it was written, and what"):
        score_dataset(dataset, path, ["force"], progress=progress)


def test_a_process_that_changes_its_folder_goes_on(dataset, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "inner").mkdir()

    def progress(_done, _total):
        monkeypatch.chdir(tmp_path / "inner")

    assert score_dataset(dataset, "scores.db", ["force"], progress=progress)
