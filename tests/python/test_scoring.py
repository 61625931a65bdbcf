import os
import signal
import threading

import numpy as np
import pytest

from energymargin import datasets, scoring


@pytest.fixture(scope="module")
def problems():
    return datasets.generate("push", trajectories=2, frames=4, seed=1).problems()


@pytest.fixture(scope="module")
def table(problems):
    return scoring.score(problems, nodes=30, seed=5, threads=1)


def same(table, other):
    return all(np.array_equal(table[metric], other[metric]) for metric in scoring.METRICS)


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
    other = scoring.score(problems, ["effort/rrt"], nodes=30, seed=6)["effort/rrt"]
    assert not np.array_equal(table["effort/rrt"], other)


def test_a_part_of_the_problems_gets_the_scores_that_it_has_in_the_whole(problems, table):
    part = scoring.score([problems[2], problems[7]], nodes=30, seed=5, indices=[2, 7])
    assert part.index.tolist() == [2, 7]
    for metric in scoring.METRICS:
        assert np.array_equal(part[metric], table[metric][[2, 7]])


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
    ],
)
def test_an_argument_out_of_range_is_refused_by_name(problems, wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        scoring.score(problems, **wrong)


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
