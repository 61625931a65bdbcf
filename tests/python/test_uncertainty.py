"""What a few trees know: intervals, the tolerance, and the experiment that checks both."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import energymargin as em
from energymargin.cli import app
from energymargin_paper.evidence import uncertainty


@pytest.fixture(scope="module")
def problem():
    return uncertainty.puck(0.1)


@pytest.fixture(scope="module")
def many(problem):
    """Scores of 200 small trees."""
    return em.capture_score(problem, nodes=30, trees=200, threads=2)


@pytest.mark.parametrize("which", ["capture", "success"])
@pytest.mark.parametrize("k", [4, 8, 20])
def test_nineteen_of_twenty_intervals_hold_the_truth(many, which, k):
    scores = getattr(many, f"{which}_by_tree")
    assert scores.std() > many.resolution  # the trees differ
    share = uncertainty.coverage(scores, many.resolution, k, draws=1000, seed=0)
    assert 0.9 <= share <= 0.99


def test_trees_that_stop_at_the_tolerance_hold_it_as_often(many):
    scores = np.array([many.capture_by_tree, many.success_by_tree])
    stops = uncertainty.stopping(scores, many.resolution, 0.02, draws=300, seed=0)
    shares, grown = stops[uncertainty.FEWEST_TREES]
    assert np.all(shares >= 0.9) and uncertainty.FEWEST_TREES < grown < 200


def test_the_interval_of_a_score_is_that_of_its_trees(many):
    low, high = many.interval()
    assert (low, high) == many.interval("capture", 0.95)
    assert low < many.capture < high
    wide = many.interval("capture", confidence=0.999)
    assert wide[0] < low and high < wide[1]
    assert high - low == pytest.approx(2 * 1.972 * many.capture_stderr, rel=0.01)


def test_a_tolerance_takes_as_many_trees_as_the_rule_says_on_any_number_of_threads(problem, many):
    scores = np.array([many.capture_by_tree, many.success_by_tree])
    expected = uncertainty.stopped_at(scores, 0.02)
    assert uncertainty.FEWEST_TREES < expected < 200
    for threads in (1, 2, 3):
        score = em.capture_score(problem, nodes=30, tolerance=0.02, threads=threads)
        assert score.complete and len(score.trees) == expected
        assert np.array_equal(score.capture_by_tree, many.capture_by_tree[:expected])
        assert max(score.capture_stderr, score.success_stderr) <= 0.02


def test_a_tolerance_that_is_not_met_is_not_complete(problem):
    score = em.capture_score(problem, nodes=10, tolerance=1e-9, trees=9)
    assert not score.complete and len(score.trees) == 9
    assert not em.capture_score(problem, nodes=10, tolerance=1e-9, timeout=0.2).complete


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"tolerance": 0}, "tolerance is 0, expected"),
        ({"tolerance": -0.1}, "tolerance is -0.1, expected"),
        ({"tolerance": "low"}, "tolerance is 'low', expected"),
        ({"tolerance": 0.1, "trees": 3}, "trees with a tolerance is 3, expected .* at least 8"),
    ],
)
def test_a_tolerance_that_cannot_be_is_refused_by_value(problem, wrong, words):
    with pytest.raises(ValueError, match=words):
        em.capture_score(problem, **wrong)


def test_one_tree_and_a_set_that_is_not_there_have_no_interval(problem):
    with pytest.raises(ValueError, match="trees is 1, expected two or more"):
        em.capture_score(problem, nodes=5).interval()
    score = em.capture_score(problem, nodes=5, trees=2)
    with pytest.raises(ValueError, match="which is 'capture_any', expected a set that"):
        score.interval("capture_any")
    with pytest.raises(ValueError, match="confidence is 1, expected"):
        score.interval(confidence=1)


SMALL = ["--tasks", "puck,topple", "--states", "1", "--nodes", "10", "--trees", "20"]


def test_the_experiment_keeps_its_trees_and_goes_on_to_the_same_tables(tmp_path):
    command = ["reproduce", "uncertainty", *SMALL, "-o", str(tmp_path)]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    table = (tmp_path / "uncertainty.csv").read_text()
    assert len(table.splitlines()) == 1 + 4  # capture and success of two states
    assert "| puck" in (tmp_path / "uncertainty.md").read_text()
    (tmp_path / "uncertainty.csv").unlink()
    (kept,) = (tmp_path / "trees").glob("puck-*")
    (tmp_path / "trees" / "topple-0-1-10.json").unlink()
    before = kept.stat().st_mtime_ns
    assert CliRunner().invoke(app, command).exit_code == 0
    assert (tmp_path / "uncertainty.csv").read_text() == table
    assert kept.stat().st_mtime_ns == before
    own = json.loads(kept.read_text())
    assert len(own["scores"]["capture"]) == 20


def test_the_experiment_refuses_a_folder_of_other_trees(tmp_path):
    command = ["reproduce", "uncertainty", *SMALL, "-o", str(tmp_path)]
    assert CliRunner().invoke(app, command).exit_code == 0
    other = CliRunner().invoke(app, [*command, "--seed", "1"])
    assert other.exit_code == 2 and "holds other trees" in other.output
