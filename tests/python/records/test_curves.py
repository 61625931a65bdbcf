"""Curves of scores against labels; the small ones are computed by hand."""

import numpy as np
import pytest
from sklearn.metrics import auc

from energymargin.evaluation import LabelledScores, evaluate
from energymargin.records.evaluation.curves import (
    OneLabelError,
    metrics_against,
    precision_recall,
    roc,
    target_name,
)


@pytest.fixture
def four():
    """Scores 3, 1, 2, 2 of two trajectories; the first and the third state are captured."""
    return LabelledScores(
        task="push",
        trajectory=np.array([0, 0, 1, 1]),
        captured=np.array([True, False, True, False]),
        success=np.array([True, True, False, False]),
        scores={"capture": np.array([3.0, 1.0, 2.0, 2.0])},
    )


@pytest.fixture
def many():
    """Forty trajectories with ties, infinite efforts, missing scores, and several objects."""
    random = np.random.default_rng(0)
    captured = random.random(400) < 0.8
    success = np.repeat(random.random(40) < 0.5, 10)
    effort = np.round(random.exponential(1.0, 400) + captured, 1)
    capture = random.random(400) + 0.5 * captured
    capture[::50] = np.nan
    return LabelledScores(
        task="scoop",
        trajectory=np.repeat(np.arange(40), 10),
        captured=captured,
        success=success,
        scores={
            "capture": capture,
            "effort/est": np.where(random.random(400) < 0.3, np.inf, effort),
            "force": random.normal(size=400),
            "success": random.random(400) + 0.3 * success,
            "capture/any": random.random(400) + 0.2 * captured,
            "success/any": random.random(400),
        },
        captured_any=captured | (random.random(400) < 0.3),
        success_any=success | np.repeat(random.random(40) < 0.3, 10),
    )


def test_the_roc_is_that_of_a_table_computed_by_hand(four):
    # At 3 one of two captured states counts; at 2 three of all four; then all.
    curve = roc(four, "capture", frames=0)
    assert curve.true_positive_rate.tolist() == [0, 0.5, 1, 1]
    assert curve.false_positive_rate.tolist() == [0, 0, 0.5, 1]
    assert curve.threshold[1:].tolist() == [3, 2, 1]
    assert np.isnan(curve.threshold[0])
    assert (curve.auc, curve.count, curve.positives) == (3.5 / 4, 4, 2)


def test_precision_over_recall_ends_at_the_threshold_that_has_all_recall(four):
    curve = precision_recall(four, "capture", frames=0)
    assert curve.recall.tolist() == [0, 0.5, 1]
    assert curve.precision.tolist() == pytest.approx([1, 1, 2 / 3])
    assert curve.threshold[1:].tolist() == [3, 2]
    assert (curve.ap, curve.count, curve.positives) == (pytest.approx(5 / 6), 4, 2)


def test_a_threshold_may_be_an_infinite_effort(four):
    four.scores["effort/est"] = np.array([np.inf, 5.0, 1.0, np.inf])
    curve = roc(four, "effort/est", frames=0)
    assert curve.threshold[1:].tolist() == [np.inf, 5, 1]
    assert curve.true_positive_rate.tolist() == [0, 0.5, 0.5, 1]


def test_auc_and_ap_are_the_very_numbers_of_evaluate_for_every_metric_and_horizon(many):
    result = evaluate(many, draws=2)
    assert metrics_against(many) == [*result.states]
    for metric, cells in result.states.items():
        for horizon, cell in cells.items():
            curve = roc(many, metric, frames=horizon)
            found = (curve.auc, precision_recall(many, metric, frames=horizon).ap)
            assert found == (cell.auc, cell.ap)
            assert (curve.count, curve.positives) == (cell.count, cell.positives)


@pytest.mark.parametrize("last", [1, 5])
def test_against_success_auc_and_ap_are_those_of_the_trajectory_scores_of_evaluate(many, last):
    result = evaluate(many, draws=2, last=last)
    assert metrics_against(many, "success") == ["success", "success/any"]
    cells = {"success": result.success, "success/any": result.success_any}
    for metric, cell in cells.items():
        assert roc(many, metric, target="success", last=last).auc == cell.auc
        assert precision_recall(many, metric, target="success", last=last).ap == cell.ap


def test_the_area_below_the_curves_is_auc_and_ap(many):
    curve = roc(many, "effort/est")
    area = auc(curve.false_positive_rate, curve.true_positive_rate)
    assert area == pytest.approx(curve.auc)
    steps = precision_recall(many, "effort/est")
    assert np.diff(steps.recall) @ steps.precision[1:] == pytest.approx(steps.ap)


def test_each_point_is_what_its_threshold_gives(many):
    curve = roc(many, "effort/est", frames=0)
    scores, captured = many.scores["effort/est"], many.captured
    for k in range(1, len(curve.threshold)):
        counts = scores >= curve.threshold[k]
        assert curve.true_positive_rate[k] == pytest.approx(counts[captured].mean())
        assert curve.false_positive_rate[k] == pytest.approx(counts[~captured].mean())
    steps = precision_recall(many, "effort/est", frames=0)
    for k in range(1, len(steps.threshold)):
        counts = scores >= steps.threshold[k]
        assert steps.recall[k] == pytest.approx(counts[captured].mean())
        assert steps.precision[k] == pytest.approx(captured[counts].mean())


def test_labels_of_one_kind_are_refused_with_what_they_are(four):
    four.captured[:] = True
    with pytest.raises(
        OneLabelError, match=r"all of the 2 states .* label 'captured over the next 1"
    ):
        roc(four, "capture", frames=1)
    four.captured[:] = False
    with pytest.raises(OneLabelError, match="none of the 4 states"):
        precision_recall(four, "capture", frames=0)
    with pytest.raises(OneLabelError, match="none of the states has a score of 'capture'"):
        roc(four, "capture", among="captured")


def test_scores_that_are_all_missing_are_refused(four):
    four.scores["capture"][:] = np.nan
    with pytest.raises(OneLabelError, match="none of the trajectories has a score of 'capture'"):
        roc(four, "capture", target="success")
    with pytest.raises(OneLabelError) as raised:
        roc(four, "capture")
    assert raised.value.brief == "no scores yet"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"metric": "grip"}, "metric is 'grip', expected one that has scores: capture"),
        ({"target": "luck"}, "target is 'luck', expected 'captured' or 'success'"),
        ({"frames": -1}, "frames is -1, expected a whole number of at least 0"),
        ({"frames": 1.5}, "frames is 1.5"),
        ({"last": 0}, "last is 0"),
    ],
)
def test_a_bad_argument_is_named_with_what_was_expected(four, arguments, message):
    for curve in (roc, precision_recall):
        with pytest.raises(ValueError, match=message):
            curve(four, **{"metric": "capture", **arguments})


def test_a_target_is_said_in_words():
    assert target_name(frames=1) == "captured over the next 1 frame"
    assert target_name(frames=0) == "captured"
    assert target_name("success") == "success of a trajectory, by its last 5 frames"
