"""Pictures of scores along a trajectory, against labels, and against nodes."""

import io

import numpy as np
import pytest
from matplotlib.figure import Figure

from energymargin import Problem, escape_effort, plots, tasks
from energymargin.evaluation import LabelledScores, evaluate
from energymargin.records.evaluation.curves import precision_recall, roc
from energymargin.records.store.scoring import begin_run
from energymargin.store import ScoreStore


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture
def labelled():
    """Twenty trajectories of ten frames, of which some stay captured."""
    random = np.random.default_rng(0)
    captured = np.sort(random.random((20, 10)) < 0.7, axis=1)[:, ::-1].ravel()
    success = np.repeat(random.random(20) < 0.5, 10)
    return LabelledScores(
        task="push",
        trajectory=np.repeat(np.arange(20), 10),
        captured=captured,
        success=success,
        scores={
            "capture": np.clip(random.normal(0.3 + 0.4 * captured, 0.2), 0, 1),
            "success": np.clip(random.normal(0.3 + 0.4 * success, 0.2), 0, 1),
            "effort/est": np.where(random.random(200) < 0.2, np.inf, random.random(200) + captured),
            "force": random.normal(size=200),
        },
    )


@pytest.fixture(scope="module")
def push():
    task = tasks.make("push", friction=0.3)
    return task.problem(task.rollout(seed=0, frames=2).states[0])


def named(ax, name):
    """The line whose legend entry begins so."""
    (line,) = (line for line in ax.lines if str(line.get_label()).startswith(name))
    return line


def said(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def ticks(ax):
    """What the y axis says within its view."""
    low, high = ax.get_ylim()
    labels = zip(ax.get_yticks(), ax.get_yticklabels(), strict=True)
    return {height: label.get_text() for height, label in labels if low <= height <= high}


def band(ax):
    """The height of the line below which all is finite."""
    (line,) = (line for line in ax.lines if line.get_gid() == "band")
    return line.get_ydata()[0]


def test_infinite_efforts_are_in_a_band_of_their_own_without_numbers(ax):
    efforts = {"effort/est": np.array([1.0, np.inf, 3.0]), "effort/rrt": np.array([np.inf, 1, 2])}
    plots.plot_scores(None, efforts, ax=ax)
    ax.figure.draw_without_rendering()
    said = ticks(ax)
    assert [label for height, label in said.items() if height > band(ax)] == ["∞"]
    numbers = [float(label) for height, label in said.items() if height < band(ax)]
    assert numbers == [height for height in said if height < band(ax)]
    assert len(numbers) > 2
    assert band(ax) > 3.0


def test_where_no_effort_is_finite_there_are_no_numbers(ax):
    efforts = {"effort/est": [np.inf, np.inf], "effort/rrt": [np.nan, np.nan]}
    plots.plot_scores(None, efforts, ax=ax)
    ax.figure.draw_without_rendering()
    assert list(ticks(ax).values()) == ["∞"]
    missing = plots.plot_scores(None, {"effort/rrt": [np.nan, np.nan]}, ax=Figure().subplots())
    missing.figure.draw_without_rendering()
    assert not ticks(missing)


def test_columns_share_the_band_of_infinity():
    high = plots.TrajectoryScores(None, {"effort/est": np.array([9.0, 5.0])}, None)
    endless = plots.TrajectoryScores(None, {"effort/est": np.array([np.inf, 1.0])}, None)
    figure = plots.figure_scores({"high": high, "endless": endless})
    figure.draw_without_rendering()
    left, right = figure.axes
    assert left.get_ylim() == right.get_ylim()
    assert band(left) == band(right) > 9.0
    assert list(ticks(left).values())[-1] == "∞"


def test_infinite_efforts_are_marks_above_all_that_is_finite_a_row_a_metric(ax):
    efforts = {"effort/est": np.array([1.0, np.inf, 3.0]), "effort/rrt": np.array([np.inf, 1, 2])}
    plots.plot_scores([0.0, 1.0, 2.0], efforts, ax=ax)
    ax.figure.draw_without_rendering()
    heights = []
    for name, time in (("effort/est", 1.0), ("effort/rrt", 0.0)):
        marks = named(ax, f"{name}: no escape")
        assert marks.get_xdata().tolist() == [time]
        heights.append(marks.get_transform().transform((0, marks.get_ydata()[0]))[1])
    _, highest = ax.transData.transform((0, 3.0))
    _, top = ax.transAxes.transform((0, 1))
    assert highest + 5 < heights[1] < heights[0] - 5 < top - 5


def test_the_legend_counts_the_scores_that_are_missing(ax):
    plots.plot_scores(None, {"capture": np.array([0.5, np.nan, 0.7])}, ax=ax)
    assert said(ax) == ["capture (1 missing)"]
    assert ax.get_xlabel() == "frame"


def test_frames_that_are_not_captured_are_shaded(ax):
    labels = np.array([True, True, False, False])
    plots.plot_scores(np.arange(4.0), {"force": np.ones(4)}, labels, ax=ax)
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches]
    assert spans == [(1.5, 2.5), (2.5, 3.0)]


def test_the_only_frame_of_a_trajectory_is_shaded_too(ax):
    plots.plot_scores([2.0], {"force": [1.0]}, [False], ax=ax)
    assert [(patch.get_x(), patch.get_width()) for patch in ax.patches] == [(1.5, 1.0)]


def test_scores_of_at_least_one_object_are_dashed_lines_beside_those_of_all(ax):
    scores = {"capture": np.array([0.2, 0.1]), "capture/any": np.array([0.9, 0.8])}
    plots.plot_scores([0.0, 1.0], scores, ax=ax)
    assert {line.get_label(): line.get_linestyle() for line in ax.lines} == {
        "capture": "-",
        "capture/any": "--",
    }


def test_scores_of_several_units_are_drawn_one_kind_at_a_time(labelled, ax):
    along = plots.trajectory_scores(labelled, 3)
    with pytest.raises(ValueError, match="choose kind='likelihood' or 'effort' or 'force'"):
        plots.plot_scores(*along, ax=ax)
    assert plots.plot_scores(*along, ax=ax, kind="effort") is ax
    assert ax.get_ylabel() == "effort of escape [J]"
    labels = {line.get_label() for line in ax.lines if line.get_gid() != "band"}
    assert labels <= {"effort/est", "effort/est: no escape"}


def test_all_kinds_are_drawn_by_one_figure_a_column_a_trajectory(labelled):
    columns = {
        "first": plots.trajectory_scores(labelled, 0, times=np.arange(10) / 4),
        "other": plots.trajectory_scores(labelled, 7),
    }
    figure = plots.figure_scores(columns)
    assert len(figure.axes) == 3 * 2
    assert [ax.get_title() for ax in figure.axes[:2]] == ["first", "other"]
    assert [ax.get_xlabel() for ax in figure.axes[-2:]] == ["time [s]", "frame"]


def test_the_scores_along_a_trajectory_are_those_of_its_states(labelled):
    found = plots.trajectory_scores(labelled, 3, times=np.arange(10.0))
    assert found.times.tolist() == list(range(10))
    assert found.scores["force"].tolist() == labelled.scores["force"][30:40].tolist()
    assert found.captured.tolist() == labelled.captured[30:40].tolist()
    with pytest.raises(ValueError, match="trajectory is 20, expected one from 0 to 19"):
        plots.trajectory_scores(labelled, 20)


def test_a_run_of_a_store_is_drawn_as_what_it_has_and_what_is_missing_is_said(tmp_path, ax):
    from energymargin import SearchSettings, datasets

    dataset = datasets.generate("push", trajectories=2, frames=3, seed=0)
    with ScoreStore(tmp_path / "scores.db", create=True) as store:
        run = begin_run(store, dataset, ["capture"], SearchSettings(5, 0))
        plots.plot_scores(*plots.trajectory_scores(run, 1), ax=ax)
        assert said(ax)[0] == "capture (3 missing)"
        roc_ax = plots.plot_roc(run, ax=Figure().subplots())
    assert said(roc_ax) == ["chance .500", "capture: no scores yet"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scores": {"grip": [1.0]}}, "scores has 'grip', expected some of capture, success"),
        ({"scores": {}}, "scores is empty, expected arrays by metric"),
        ({"scores": np.ones(3)}, "scores is a ndarray, expected arrays by metric"),
        ({"kind": "force"}, "kind is 'force', expected 'likelihood'"),
        ({"times": [0.0, 1.0]}, r"times has shape \(2,\) of float64, expected \(3,\)"),
        ({"captured": [True]}, r"captured has shape \(1,\) of bool, expected \(3,\)"),
        ({"captured": [1, 0, 0.3]}, r"captured has 0.3, expected True and False, or 1 and 0"),
        ({"captured": [1, 0, np.nan]}, r"captured has nan, expected True and False, or 1 and 0"),
        ({"captured": ["yes"] * 3}, r"captured has 'yes', expected True and False"),
        ({"times": [0.0, np.nan, 1.0]}, "times has nan at frame 1, expected finite numbers"),
        ({"times": [0.0, 2.0, 1.0]}, "times has 1 at frame 2, expected finite numbers that rise"),
        ({"times": "later"}, "times is 'later', expected numbers"),
        ({"scores": {"capture": [0.5, 7.0]}}, "capture has 7, expected 0 to 1"),
        ({"scores": {"success/any": [-0.5]}}, "success/any has -0.5, expected 0 to 1"),
        ({"scores": {"capture": [np.inf]}}, "capture has inf, expected 0 to 1"),
        ({"scores": {"effort/est": [1.0, -np.inf]}}, "effort/est has -inf, expected a number or"),
        ({"scores": {"force": ["a"]}}, r"force is \['a'\], expected numbers"),
        (
            {"scores": {"force": np.ones((2, 2))}},
            r"force has shape \(2, 2\), expected \(K,\), K > 0",
        ),
        ({"scores": {"force": 0.5}}, r"force has shape \(\), expected \(K,\), K > 0"),
        ({"scores": {"force": []}}, r"force has shape \(0,\), expected \(K,\), K > 0"),
        ({"legend": 1}, "legend is 1, expected true or false"),
    ],
)
def test_a_bad_argument_of_scores_is_named_with_what_was_expected(ax, arguments, message):
    given = {"times": None, "scores": {"capture": [0.1, 0.2, 0.3]}, **arguments}
    with pytest.raises(ValueError, match=message):
        plots.plot_scores(**given, ax=ax)


def test_the_columns_of_a_figure_are_checked_as_scores_are():
    with pytest.raises(ValueError, match="capture has 7, expected 0 to 1"):
        plots.figure_scores({"a": plots.TrajectoryScores(None, {"capture": np.array([7.0])}, None)})


PLOTS = {
    "scores": lambda labelled, push, ax: plots.plot_scores(
        *plots.trajectory_scores(labelled, 3), ax=ax, kind="effort"
    ),
    "roc": lambda labelled, push, ax: plots.plot_roc(labelled, ax=ax),
    "precision": lambda labelled, push, ax: plots.plot_precision_recall(labelled, ax=ax),
    "effort": lambda labelled, push, ax: plots.plot_effort(escape_effort(push, nodes=50), ax=ax),
}


@pytest.mark.parametrize("plot", PLOTS.values(), ids=PLOTS)
def test_a_legend_is_inside_the_callers_axes_and_beside_those_made_here(labelled, push, plot):
    brought, made = (plot(labelled, push, ax) for ax in (Figure().subplots(), None))
    for ax in (brought, made):
        ax.figure.savefig(io.BytesIO(), format="png")
    legend = brought.get_legend().get_window_extent()
    assert brought.bbox.contains(legend.x0, legend.y0)
    assert brought.bbox.contains(legend.x1, legend.y1)
    assert made.get_legend().get_window_extent().x0 > made.bbox.x1


def test_a_legend_may_be_left_away(labelled, push):
    for ax in (
        plots.plot_roc(labelled, ax=Figure().subplots(), legend=False),
        plots.plot_precision_recall(labelled, ax=Figure().subplots(), legend=False),
        plots.plot_scores(None, {"force": [1.0]}, ax=Figure().subplots(), legend=False),
        plots.plot_effort(escape_effort(push, nodes=2), ax=Figure().subplots(), legend=False),
    ):
        assert ax.get_legend() is None


def test_scores_are_taken_from_a_file_its_path_or_what_is_said_to_be_expected(tmp_path, ax):
    from energymargin import SearchSettings, datasets

    dataset = datasets.generate("push", trajectories=2, frames=3, seed=0)
    path = tmp_path / "scores.db"
    with ScoreStore(path, create=True) as store:
        begin_run(store, dataset, ["capture"], SearchSettings(5, 0))
        for scores in (store, path, str(path)):
            plots.plot_roc(scores, ax=Figure().subplots())
            plots.plot_precision_recall(scores, ax=Figure().subplots())
            assert (
                plots.trajectory_scores(scores, 1).captured.tolist()
                == dataset.trajectories[1].captured.tolist()
            )
        begin_run(store, dataset, ["capture"], SearchSettings(6, 0))
        for scores in (store, path):
            with pytest.raises(
                ValueError,
                match=r"has 2 runs, choose one by its number \(--run\): run 1: .*; run 2: ",
            ):
                plots.plot_roc(scores, ax=ax)
    for plot in (
        plots.plot_roc,
        plots.plot_precision_recall,
        lambda it: plots.trajectory_scores(it, 0),
    ):
        with pytest.raises(ValueError, match=r"scores is \{.*, expected LabelledScores, a Run or"):
            plot({"capture": np.arange(1000)})


def test_the_roc_that_is_drawn_is_the_curve_and_its_legend_the_auc_of_evaluate(labelled, ax):
    assert plots.plot_roc(labelled, ax=ax, frames=1) is ax
    for metric, cells in evaluate(labelled, frames=[1], draws=2).states.items():
        line, curve = named(ax, metric), roc(labelled, metric, frames=1)
        assert np.array_equal(line.get_xdata(), curve.false_positive_rate)
        assert np.array_equal(line.get_ydata(), curve.true_positive_rate)
        assert line.get_label() == f"{metric} {cells[1].value().split('/')[0]}"
    assert ax.get_title() == "captured over the next 1 frame"


def test_precision_and_recall_are_drawn_as_steps_below_which_the_area_is_ap(labelled, ax):
    plots.plot_precision_recall(labelled, ax=ax, metrics=["capture"])
    line, curve = named(ax, "capture"), precision_recall(labelled, "capture")
    assert line.get_drawstyle() == "steps-pre"
    recall, precision = line.get_data()
    assert np.diff(recall) @ precision[1:] == pytest.approx(curve.ap)
    chance = named(ax, "chance")
    assert chance.get_ydata()[0] == curve.positives / curve.count


def test_against_success_the_scores_of_trajectories_are_drawn(labelled, ax):
    plots.plot_roc(labelled, ax=ax, target="success")
    cell = evaluate(labelled, draws=2).success
    assert said(ax) == ["chance .500", f"success {cell.value().split('/')[0]}"]


def test_no_two_curves_differ_in_colour_alone(labelled, ax):
    plots.plot_roc(labelled, ax=ax)
    lines = [line for line in ax.lines if line.get_color() != "0.55"]
    assert len({str(line._unscaled_dash_pattern) for line in lines}) == len(lines)


def test_labels_of_one_kind_are_said_in_the_legend_instead_of_a_curve(labelled, ax):
    labelled.captured[:] = True
    plots.plot_roc(labelled, ax=ax, metrics=["capture", "force"])
    assert said(ax) == ["chance .500", "capture: one label only", "force: one label only"]
    assert [text.get_text() for text in ax.texts] == ["one label alone"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"metrics": ["grip"]}, "metric is 'grip', expected one that has scores: capture"),
        ({"metrics": "capture"}, "metrics is 'capture', expected several"),
        ({"metrics": []}, "metrics is empty"),
        ({"target": "luck"}, "target is 'luck'"),
        ({"frames": -1}, "frames is -1"),
    ],
)
def test_a_bad_argument_of_curves_is_named_with_what_was_expected(labelled, arguments, message):
    for plot in (plots.plot_roc, plots.plot_precision_recall):
        with pytest.raises(ValueError, match=message):
            plot(labelled, ax=Figure().subplots(), **arguments)


def test_the_effort_is_drawn_as_the_steps_of_its_history_up_to_the_last_node(push, ax):
    result = escape_effort(push, nodes=200, seed=0, search="published")
    assert plots.plot_effort({"est": result}, ax=ax, known=0.01) is ax
    line = named(ax, "est")
    nodes, efforts = np.transpose(result.history)
    assert line.get_xdata().tolist() == [*nodes, 200]
    assert line.get_ydata().tolist() == [*efforts, efforts[-1]]
    assert line.get_drawstyle() == "steps-post"
    assert ax.get_xscale() == "log"
    assert named(ax, "known: 0.01 J").get_ydata()[0] == 0.01


def test_no_two_of_49_searches_differ_in_colour_alone(push, ax):
    result = escape_effort(push, nodes=20, seed=0, search="improved")
    plots.plot_effort({str(number): result for number in range(49)}, ax=ax, legend=False)
    looks = {(str(line._unscaled_dash_pattern), line.get_marker()) for line in ax.lines}
    assert len(ax.lines) == len(looks) == 49


def test_the_mark_of_a_search_that_is_out_at_the_start_is_whole(push, ax):
    state = push.state.copy()
    state[push.scene.slice("object").start] += 9.0
    out = Problem(
        push.scene, state, force=(1, 0, 0), torque=(0, 0, 0), duration=0.5, captured=push.captured
    )
    result = escape_effort(out, nodes=20, seed=0)
    assert result.history[0] == (0, 0.0)
    plots.plot_effort(result, ax=ax)
    ax.figure.draw_without_rendering()
    line = named(ax, "search")
    x, _ = ax.transData.transform(line.get_xydata()[0])
    radius = line.get_markersize() / 2 * ax.figure.dpi / 72
    assert x - radius > ax.bbox.x0


def test_a_search_without_an_escape_is_said_instead_of_drawn(push, ax):
    plots.plot_effort({"short": escape_effort(push, nodes=1, seed=0)}, ax=ax)
    assert said(ax) == ["short: no escape in 1 node"]
    assert [text.get_text() for text in ax.texts] == ["no escape found"]


def test_a_search_that_was_stopped_says_so(push, ax):
    plots.plot_effort(escape_effort(push, nodes=10**6, timeout=0.1, search="published"), ax=ax)
    assert said(ax)[0].endswith("stopped early")


@pytest.mark.parametrize(
    ("results", "known", "message"),
    [
        ({}, None, "results is {}, expected an EscapeEffort"),
        ({"est": 1.0}, None, "results has 1.0 as 'est', expected an EscapeEffort"),
        (None, None, "results is None"),
    ],
)
def test_a_bad_argument_of_efforts_is_named(results, known, message):
    with pytest.raises(ValueError, match=message):
        plots.plot_effort(results, ax=Figure().subplots(), known=known)


@pytest.mark.parametrize("known", [np.float32(0.5), np.int64(1), 0])
def test_a_known_effort_may_be_any_kind_of_number(push, ax, known):
    plots.plot_effort(escape_effort(push, nodes=2), ax=ax, known=known)
    assert named(ax, "known").get_ydata()[0] == known


@pytest.mark.parametrize("known", [-1.0, np.inf, np.nan, "zero", True])
def test_a_known_effort_is_a_finite_number_of_at_least_0(push, ax, known):
    with pytest.raises(ValueError, match="expected a finite number of at least 0"):
        plots.plot_effort(escape_effort(push, nodes=2), ax=ax, known=known)
