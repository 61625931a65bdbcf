import dataclasses
import os
import signal
import threading

import numpy as np
import pytest

from energymargin import Problem, datasets
from energymargin.base.metrics import METRICS, TIMED
from energymargin.evaluate import scoring
from energymargin.evaluate.executors.rows import Row, Work
from energymargin.evaluate.searches import LooseSettings, SearchSettings, metrics_of
from energymargin.store import ScoreStore, score_dataset


@pytest.fixture(scope="module")
def problems():
    return datasets.generate("push", trajectories=2, frames=4, seed=1).problems()


@pytest.fixture(scope="module")
def table(problems):
    return scoring.score(problems, nodes=30, seed=5, threads=1)


def same(table, other):
    return all(np.array_equal(table[metric], other.scores[metric]) for metric in table.scores)


def test_a_table_has_a_row_a_problem_and_a_column_a_metric(table):
    assert len(table) == 8 and table.index.tolist() == list(range(8))
    assert np.all((table["capture"] >= 0) & (table["capture"] <= 1))
    assert np.all(table["effort/est"] >= 0) and np.all(table.seconds > 0)
    row = table.to_rows()[3]
    assert row["index"] == 3 and row["force"] == table["force"][3]
    with pytest.raises(KeyError, match=r"escape.*there are: capture"):
        table["escape"]


def test_scores_are_the_same_bits_for_one_thread_and_for_two(problems, table):
    assert same(table, scoring.score(problems, nodes=30, seed=5, threads=2))


def test_another_seed_gives_other_scores(problems, table):
    other = scoring.score(problems, ["capture"], nodes=30, seed=6)["capture"]
    assert not np.array_equal(table["capture"], other)


def test_a_part_of_the_problems_gets_the_scores_that_it_has_in_the_whole(problems, table):
    part = scoring.score([problems[2], problems[7]], nodes=30, seed=5, indices=[2, 7])
    assert part.index.tolist() == [2, 7]
    for metric in table.scores:
        assert np.array_equal(part[metric], table[metric][[2, 7]])


@pytest.fixture(scope="module")
def several():
    """Problems with four objects."""
    return datasets.generate("scoop", trajectories=1, frames=3, seed=0).problems()


def test_with_one_object_there_are_the_effort_and_the_five_metrics_of_the_paper(problems, table):
    own = ("capture", "success", "effort", "effort/est", "effort/rrt", "force")
    assert metrics_of(problems) == tuple(table.scores) == own


def test_with_several_objects_there_are_also_those_of_at_least_one(several):
    clockless = tuple(metric for metric in METRICS if metric not in TIMED)
    assert metrics_of(several) == clockless
    table = scoring.score(several, nodes=20, seed=0)
    assert set(table.scores) == set(clockless)
    assert np.all(table["capture/any"] >= table["capture"])
    assert np.all(table["success/any"] >= table["success"])


def test_a_metric_that_not_every_problem_has_is_refused_with_what_it_needs(problems, several):
    mixed = [*several, problems[0]]
    assert metrics_of(mixed) == metrics_of(problems)
    for metric, need in {
        "capture/any": "a capture set for each object",
        "effort/est/any": "a capture set for each object",
        "success/any": "a success set for each object",
    }.items():
        with pytest.raises(ValueError, match=f"metrics has '{metric}', but not .* {need}"):
            scoring.score(mixed, [metric], nodes=5)


def test_a_problem_without_a_success_set_is_scored_by_all_the_other_metrics(problems):
    first = problems[0]
    problem = Problem(
        first.scene,
        first.state,
        force=first.force,
        torque=first.torque,
        duration=first.duration,
        captured=first.captured,
    )
    table = scoring.score([problem], nodes=5)
    assert list(table.scores) == ["capture", "effort", "effort/est", "effort/rrt", "force"]
    with pytest.raises(ValueError, match=r"metrics has 'success', but not .* a success set"):
        scoring.score([problem], ["success"])


def test_searches_of_one_problem_run_side_by_side_with_the_same_bits(problems, monkeypatch):
    rows = {}
    for few in (0, scoring.FEW):
        monkeypatch.setattr(scoring, "FEW", few)
        rows[few] = []
        scoring.score(problems[:2], nodes=20, threads=2, on_rows=rows[few].extend)
    whole, split = (sorted(found, key=lambda row: row.index) for found in rows.values())
    for one, other in zip(whole, split, strict=True):
        assert (one.scores, one.steps) == (other.scores, other.steps)
        assert one.times.keys() == other.times.keys() and one.warnings == other.warnings


def test_a_problem_that_fails_in_one_search_is_an_error_once(problems):
    work = Work(3, problems[0], ("capture", "effort", "force"))
    rows = [Row(3, {"capture": 0.5, "force": 1.0}, steps=4), Row(3, error="it broke")]
    assert [one.metrics for one in next(work.searches())] == [("capture", "force"), ("effort",)]
    assert len(work) == 2
    assert work.row(rows).error == "it broke"
    assert work.row([rows[0], Row(3, {"effort": 0.1}, steps=5)]).steps == 9


def test_rows_and_progress_arrive_as_they_are_finished(problems):
    rows, counts = [], []
    scoring.score(
        problems,
        ["force"],
        nodes=1,
        on_rows=rows.extend,
        progress=lambda done, total: counts.append((done, total)),
    )
    assert sorted(row.index for row in rows) == list(range(8))
    assert counts[-1] == (8, 8) and counts == sorted(counts)


@pytest.mark.parametrize(
    "wrong",
    [
        {"nodes": 0},
        {"seed": -1},
        {"threads": 0},
        {"metrics": ["capture", "beauty"]},
        {"metrics": []},
        {"metrics": "force"},
    ],
)
def test_an_argument_out_of_range_is_refused_by_name(problems, wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        scoring.score(problems, **wrong)


def test_an_interrupt_at_the_last_row_is_an_interrupt(problems):
    def interrupt(done, total):
        if done == total:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        scoring.score(problems, ["force"], progress=interrupt)


def test_what_is_no_problem_is_refused(problems):
    with pytest.raises(ValueError, match="problems has 1, expected Problems"):
        scoring.score([problems[0], 1])


def test_an_interrupt_hands_over_all_that_was_finished_and_then_raises(problems):
    many = problems * 500
    rows = []
    interrupt = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    interrupt.start()
    with pytest.raises(KeyboardInterrupt):
        scoring.score(many, ["capture"], nodes=30, seed=5, on_rows=rows.extend)
    assert 0 < len(rows) < len(many)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    kept = sorted(rows, key=lambda row: row.index)[:5]
    indices = [row.index for row in kept]
    again = scoring.score(
        [many[i] for i in indices], ["capture"], nodes=30, seed=5, indices=indices
    )
    assert [row.scores["capture"] for row in kept] == again["capture"].tolist()


def test_settings_are_given_one_by_one_or_as_one(problems, tmp_path):
    settings = SearchSettings(nodes=20, seed=3)
    loose = scoring.score(problems, ["capture"], nodes=20, seed=3)
    assert same(loose, scoring.score(problems, ["capture"], settings=settings))
    dataset = datasets.generate("push", trajectories=2, frames=4, seed=1)
    score_dataset(dataset, tmp_path / "s.db", ["capture"], nodes=20, seed=3)
    score_dataset(dataset, tmp_path / "s.db", ["capture"], settings=settings)
    with ScoreStore(tmp_path / "s.db") as store:
        (run,) = store.runs()  # the same question
        assert same(loose, run.labelled_scores())


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"settings": SearchSettings(), "nodes": 5}, ValueError, "settings and nodes are given"),
        ({"settings": {"nodes": 5}}, ValueError, r"settings is \{'nodes': 5\}, expected Search"),
        ({"seeds": 5}, TypeError, "seeds"),
    ],
)
def test_settings_that_cannot_be_are_refused(problems, tmp_path, given, error, message):
    with pytest.raises(error, match=message):
        scoring.score(problems, ["capture"], **given)
    dataset = datasets.generate("push", trajectories=1, frames=2, seed=1)
    with pytest.raises(error, match=message):
        score_dataset(dataset, tmp_path / "s.db", ["capture"], **given)
    assert not list(tmp_path.iterdir())


def test_loose_settings_are_the_fields_of_search_settings():
    fields = {field.name: field.type for field in dataclasses.fields(SearchSettings)}
    assert {n: t.__forward_arg__ for n, t in LooseSettings.__annotations__.items()} == fields
