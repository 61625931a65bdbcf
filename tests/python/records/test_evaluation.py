"""The answers here are computed by hand, or by scikit-learn one draw at a time."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from sklearn.metrics import average_precision_score, roc_auc_score

from energymargin.evaluation import LabelledScores, evaluate
from energymargin.records.evaluation.bootstrap import thresholds, weighted_auc_ap
from energymargin.records.evaluation.labelled import captured_labels, trajectory_score
from energymargin.summary import summary


def labelled(trajectory, captured, success=None, task="push", **scores):
    n = len(trajectory)
    return LabelledScores(
        task=task,
        trajectory=np.array(trajectory),
        captured=np.array(captured, dtype=bool),
        success=np.zeros(n, dtype=bool) if success is None else np.array(success, dtype=bool),
        scores={name: np.array(values, dtype=float) for name, values in scores.items()},
    )


@pytest.mark.parametrize(
    ("horizon", "labels"),
    [(0, [1, 1, 0, 1, 1, 1]), (1, [1, 0, 0, 1, 1, 1]), (5, [0, 0, 0, 1, 1, 1])],
)
def test_a_state_is_captured_if_all_frames_of_its_horizon_are_and_the_horizon_ends_with_the_frames(
    horizon, labels
):
    captured = np.array([1, 1, 0, 1, 1, 1], dtype=bool)
    assert captured_labels(captured, horizon).tolist() == [bool(label) for label in labels]


def test_the_trajectory_score_weighs_the_last_five_frames_from_1_to_5():
    scores = np.array([9.0, 9.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert trajectory_score(scores) == pytest.approx(
        (0.1 + 2 * 0.2 + 3 * 0.3 + 4 * 0.4 + 5 * 0.5) / 15
    )


def test_auc_and_ap_are_those_of_a_table_computed_by_hand():
    # Pairs 3>1, 3>2, 2>1 and the tie 2=2: AUC 3.5/4. Thresholds 3 (P 1, R 1/2) and 2 (P 2/3, R 1):
    # AP 1/2 + 1/3.
    cell = evaluate(labelled([0, 0, 1, 1], [1, 0, 1, 0], capture=[3, 1, 2, 2]), frames=[0]).states[
        "capture"
    ][0]
    assert (cell.auc, cell.ap) == pytest.approx((3.5 / 4, 5 / 6))
    assert (cell.count, cell.positives) == (4, 2)


def test_an_infinite_effort_ranks_above_every_finite_one():
    # The pairs are inf>5 and 1<5: AUC 1/2. Were inf left out or ranked last, it would be 0.
    data = labelled([0, 0, 1], [1, 0, 1], **{"effort/est": [np.inf, 5, 1]})
    cell = evaluate(data, frames=[0]).states["effort/est"][0]
    assert (cell.auc, cell.ap) == pytest.approx((1 / 2, 1 / 2 + 1 / 3))


def test_success_is_judged_once_a_trajectory():
    # Trajectory scores by hand: (1*0 + 2*3)/3 = 2, (1*3 + 2*0)/3 = 1, (1*1 + 2*1.5)/3 = 4/3; the
    # second succeeded.
    data = labelled(
        [0, 0, 1, 1, 2, 2], [1] * 6, success=[0, 0, 1, 1, 0, 0], success_=[0, 3, 3, 0, 1, 1.5]
    )
    data.scores["success"] = data.scores.pop("success_")
    cell = evaluate(data).success
    assert (cell.auc, cell.ap, cell.count) == pytest.approx((0.0, 1 / 3, 3))


@pytest.fixture
def several():
    """Four states, of which two are captured with all objects, and three with at least one."""
    data = labelled(
        [0, 0, 1, 1],
        [1, 0, 1, 0],
        success=[1, 1, 0, 0],
        task="lift",
        capture=[4, 3, 2, 1],
        force=[4, 3, 2, 1],
        success_=[1, 1, 0, 0],
    )
    scores = {**data.scores, "capture/any": np.array([1.0, 2.0, 3.0, 4.0])}
    scores["success"] = scores.pop("success_")
    scores["success/any"] = 1 - scores["success"]
    return replace(
        data,
        scores=scores,
        captured_any=np.array([True, True, True, False]),
        success_any=np.array([False, False, True, True]),
    )


def test_a_score_of_at_least_one_object_is_held_against_the_label_of_at_least_one(several):
    result = evaluate(several, frames=[0, 1])
    # Of all: pairs 4>3, 4>1, 2<3, 2>1. Of at least one: the one that is lost ranks first.
    assert result.states["capture"][0].auc == pytest.approx(3 / 4)
    assert result.states["capture/any"][0].auc == 0.0
    # Over the next frame state 0 stays with at least one, and 2 does not.
    cell = result.states["capture/any"][1]
    assert (cell.positives, cell.count) == (1, 2)
    assert (result.success.auc, result.success_any.auc) == (1.0, 1.0)
    assert result.success_any.positives == 1


def test_the_force_score_is_held_against_both_labels(several):
    states = evaluate(several, frames=[0]).states
    assert states["force"][0].auc == pytest.approx(3 / 4)
    assert states["force/any"][0].auc == 1.0


def test_tables_of_several_objects_say_which_rows_are_of_all_and_which_of_at_least_one(several):
    result = evaluate(several)
    console = Console(file=io.StringIO(), width=80)
    console.print(summary(result))
    for text in (console.file.getvalue(), result.to_markdown()):
        of_all, of_any = text.index("All objects"), text.index("At least one object")
        for name in ("capture", "force", "success"):
            assert of_all < text.index(f"{name} ", of_all) < of_any < text.index(f"{name}/any")
    scores = {row["score"] for row in csv.DictReader(io.StringIO(result.to_csv()))}
    assert scores == {f"{s}{a}" for s in ("capture", "force", "success") for a in ("", "/any")}


def test_a_table_of_one_object_does_not_speak_of_several():
    result = evaluate(labelled([0, 0, 1, 1], [1, 0, 1, 0], capture=[3, 1, 2, 2]))
    assert "object" not in result.to_markdown() and "any" not in result.to_csv()


def test_a_score_of_at_least_one_object_without_such_labels_is_refused(several):
    with pytest.raises(ValueError, match=r"'capture/any', but no labels of at least one object"):
        evaluate(replace(several, captured_any=None))


def test_labels_of_one_class_make_a_dash_and_no_nan_anywhere():
    result = evaluate(
        labelled([0, 0, 1, 1], [1, 1, 1, 1], capture=[1, 2, 3, 4], success=[0, 0, 0, 0])
    )
    assert result.states["capture"][0] is None and result.success is None
    console = Console(file=io.StringIO(), width=100)
    console.print(summary(result))
    for text in (console.file.getvalue(), result.to_markdown(), result.to_csv()):
        assert "nan" not in text.lower()
    assert "| capture | — | — | — | — | — | — |" in result.to_markdown()
    assert "last frame alone" not in result.to_markdown()  # no success is told


@pytest.fixture
def pushes():
    """Two trajectories of four states; of the first the last is lost, of the second the first."""
    return labelled(
        np.repeat([0, 1], 4), [1, 1, 1, 0, 0, 1, 1, 1], capture=[4, 3, 2, 1, 0, 5, 6, 7]
    )


def test_states_count_that_have_the_whole_horizon_left(pushes):
    cells = evaluate(pushes, frames=[0, 1, 2, 3, 4]).states["capture"]
    assert [(c.count, c.positives) if c else None for c in cells.values()] == [
        *((8, 6), (6, 4), (4, 2)),
        *(None, None),  # at 3 each trajectory has one state, and neither stays; at 4 none is left
    ]


def test_clipped_a_horizon_ends_with_its_trajectory_and_every_state_counts(pushes):
    result = evaluate(pushes, frames=[1, 3], clipped=True)
    cells = result.states["capture"]
    assert [(c.count, c.positives) for c in cells.values()] == [(8, 5), (8, 3)]
    assert "ends with its trajectory (clipped)" in result.to_markdown()
    assert "those with as many frames left" in evaluate(pushes).to_markdown()


def test_scores_with_a_clock_have_no_clipped_reading(pushes):
    asked = replace(pushes, asks="horizon 2 frames, plan hold")
    assert evaluate(asked, frames=[1]).states["capture"][1].count == 6
    with pytest.raises(ValueError, match=r"clipped is True, .*horizon 2 frames, plan hold.*False"):
        evaluate(asked, clipped=True)


def test_among_states_that_are_captured_now_there_is_nothing_to_tell_at_horizon_0(pushes):
    with_success = replace(pushes, scores={**pushes.scores, "success": np.arange(8.0)})
    result = evaluate(with_success, frames=[0, 1, 2], among="captured")
    assert result.frames == (1, 2) and result.success is None
    assert [(c.count, c.positives) for c in result.states["capture"].values()] == [(5, 4), (3, 2)]
    text = result.to_markdown()
    assert "States that are captured now" in text
    assert evaluate(pushes).to_csv().split("\n")[0] == result.to_csv().split("\n")[0]
    rows = list(csv.DictReader(io.StringIO(result.to_csv())))
    assert {(row["score"], row["among"]) for row in rows} == {("capture", "captured")}
    # of at least one object those count of which at least one is captured now
    any_one = replace(
        pushes,
        scores={"capture/any": pushes.scores["capture"]},
        captured_any=np.array([True, False] * 4),
        success_any=pushes.success,
    )
    cells = evaluate(any_one, frames=[0, 2], among="captured", draws=10).states["capture/any"]
    assert cells == {2: None}  # states 0 and 4, of which both are lost within two frames


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"last": 0}, "last is 0, expected a whole number of at least 1"),
        ({"draws": 0}, "draws is 0, expected a whole number of at least 1"),
        ({"frames": [-1]}, "frames is -1, expected a whole number of at least 0"),
        ({"among": "lost"}, "among is 'lost', expected 'all' or 'captured'"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(pushes, change, words):
    with pytest.raises(ValueError, match=words):
        evaluate(pushes, **change)
    with pytest.raises(ValueError, match="last is 0"):
        trajectory_score(np.ones(3), last=0)


def test_states_out_of_order_or_of_another_number_are_refused(pushes):
    order = np.random.default_rng(0).permutation(8)
    with pytest.raises(ValueError, match=r"states of trajectory \d are not in a row"):
        replace(pushes, trajectory=pushes.trajectory[order])
    with pytest.raises(ValueError, match=r"capture has shape \(7,\), expected \(8,\)"):
        replace(pushes, scores={"capture": np.zeros(7)})
    with pytest.raises(ValueError, match=r"success has shape \(3,\), expected \(8,\)"):
        replace(pushes, success=np.zeros(3, dtype=bool))


def test_a_perfect_score_has_a_bound_on_one_side(pushes):
    # Each of 20 trajectories has one captured state above its lost one: of 20 trials none fails.
    data = labelled(np.repeat(np.arange(20), 2), [1, 0] * 20, capture=[2, 1] * 20)
    cell = evaluate(data, frames=[0]).states["capture"][0]
    assert (cell.auc, cell.ap) == (1.0, 1.0)
    low = 0.05 ** (1 / 20)  # the share of successes of which 20 in a row have a chance of 1 in 20
    assert cell.auc_interval == pytest.approx((low, 1.0))
    assert cell.ap_interval == pytest.approx((low, 1.0))
    upside_down = replace(data, scores={"capture": -data.scores["capture"]})
    cell = evaluate(upside_down, frames=[0]).states["capture"][0]
    assert cell.auc_interval == pytest.approx((0.0, 1 - low))


def test_a_score_that_is_missing_is_left_out_and_counted():
    data = labelled([0, 0, 1, 1], [1, 0, 1, 0], capture=[3, 1, np.nan, 2])
    result = evaluate(data, frames=[0])
    assert result.missing == 1
    words = "3 of 4 states count, of which 1 stays captured; left out are 1 without a score."
    assert words in " ".join(result.to_markdown().split())
    two = evaluate(data, frames=[0, 1]).to_markdown()
    assert "1 state has no score and is left out" in two
    assert "States that count, by h: 3, 1." in two
    cell = result.states["capture"][0]
    assert (cell.auc, cell.count) == (1.0, 3)


def test_a_trajectory_whose_last_frames_lack_a_score_is_left_out_of_success_and_counted():
    scores = {"success": np.array([0.9, np.nan, 0.8, 0.1, 0.2, 0.3])}
    data = labelled([0, 0, 1, 1, 2, 2], [1, 1, 1, 0, 0, 0], success=[1, 1, 1, 1, 0, 0])
    data = replace(data, scores=scores)
    result = evaluate(data, frames=[0])
    assert result.missing_trajectories == 1 and result.success.count == 2
    words = "1 state has no score and is left out; so is 1 trajectory of success."
    assert words in result.to_markdown()
    assert evaluate(data, frames=[0], last=1).missing_trajectories == 1
    first = replace(data, scores={"success": np.roll(scores["success"], -1)})
    assert evaluate(first, frames=[0], last=1).missing_trajectories == 0


def test_all_draws_at_once_give_what_scikit_learn_gives_for_each():
    random = np.random.default_rng(0)
    ranks, labels = random.integers(0, 12, 60), random.random(60) < 0.6
    weights = random.integers(0, 4, (20, 60))
    order, first = thresholds(ranks)
    auc, ap = weighted_auc_ap(labels[order], weights[:, order], first)
    assert auc == pytest.approx([roc_auc_score(labels, ranks, sample_weight=w) for w in weights])
    assert ap == pytest.approx(
        [average_precision_score(labels, ranks, sample_weight=w) for w in weights]
    )


def test_draws_with_one_label_left_have_no_auc_and_no_ap():
    weights = np.array([[1, 1], [2, 0], [0, 2]])
    auc, ap = weighted_auc_ap(np.array([True, False]), weights, first=np.array([0, 1]))
    assert auc == pytest.approx([1.0, np.nan, np.nan], nan_ok=True)
    assert ap == pytest.approx([1.0, np.nan, np.nan], nan_ok=True)


def test_the_interval_does_not_shrink_when_every_state_counts_ten_times():
    random = np.random.default_rng(1)
    captured, scores = random.random(12) < 0.5, random.random(12)
    once = labelled(np.arange(12), captured, capture=scores)
    tenfold = labelled(
        np.repeat(np.arange(12), 10), np.repeat(captured, 10), capture=np.repeat(scores, 10)
    )
    cells = [evaluate(data, frames=[0]).states["capture"][0] for data in (once, tenfold)]
    assert cells[0].auc_interval == pytest.approx(cells[1].auc_interval)
    assert cells[0].auc_interval[0] < cells[0].auc < cells[0].auc_interval[1]


def test_a_single_trajectory_has_no_interval():
    found = evaluate(labelled([0, 0], [1, 0], capture=[1, 2]), frames=[0])
    cell = found.states["capture"][0]
    assert cell.auc_interval is None and cell.intervals() == ("—", "—")
    assert "Intervals take more trajectories than these: there are none." in found.caption


def test_the_csv_file_holds_every_number_in_full():
    random = np.random.default_rng(2)
    data = labelled(np.repeat(np.arange(5), 4), random.random(20) < 0.5, capture=random.random(20))
    result = evaluate(data)
    rows = list(csv.DictReader(io.StringIO(result.to_csv())))
    assert [row["horizon"] for row in rows if row["score"] == "capture"] == [
        "0",
        "1",
        "2",
        "3",
        "4",
        "5",
    ]
    assert float(rows[0]["auc"]) == result.states["capture"][0].auc
