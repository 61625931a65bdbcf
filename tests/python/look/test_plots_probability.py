"""The probability over the horizon as a picture."""

import matplotlib.colors
import numpy as np
import pytest
from futures import carried, resting, two_balls
from matplotlib.figure import Figure

import energymargin as em
from energymargin import plots
from energymargin.evaluate.futures import undisturbed
from energymargin.look.plots.styles import METRICS


@pytest.fixture(scope="module")
def shaken():
    """A probability between 0 and 1, of an object that stays if nothing disturbs it."""
    found = em.capture_probability(resting(), rollouts=40)
    assert 0.1 < found.captured < 0.9 and found.undisturbed
    return found


@pytest.fixture(scope="module")
def pushed():
    """One that leaves by itself."""
    found = em.capture_probability(carried(), rollouts=20)
    assert not found.undisturbed
    return found


def drawn(*arguments, **keywords):
    return plots.plot_probability(*arguments, ax=Figure().subplots(), **keywords)


def named(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_the_curve_falls_in_steps_within_the_band_of_its_intervals(shaken):
    ax = drawn(shaken)
    (curve,) = (line for line in ax.lines if line.get_drawstyle() == "steps-post")
    assert np.array_equal(curve.get_xdata(), shaken.times)
    assert np.array_equal(curve.get_ydata(), shaken.curve)
    (band,) = ax.collections
    (path,) = band.get_paths()
    low, high = shaken.band()
    assert set(np.round(path.vertices[:, 1], 9)) == set(np.round([*low, *high], 9))
    assert ax.get_ylim()[0] < 0 and ax.get_ylim()[1] > 1


def test_the_band_is_the_interval_of_each_point_and_ends_in_that_of_the_horizon(shaken):
    low, high = shaken.band()
    assert (low[-1], high[-1]) == shaken.interval()
    assert shaken.curve[0] == 1.0 == high[0]
    assert low[0] == pytest.approx(0.025 ** (1 / 40))  # all of 40 are captured
    assert np.all(low <= shaken.curve) and np.all(shaken.curve <= high)
    narrow, _ = shaken.band(confidence=0.5)
    assert np.all(narrow > low)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"confidence": 1.0}, "confidence is 1.0"),
        ({"which": "success"}, "which is 'success', expected 'captured' or 'any'"),
        ({"which": "any"}, "which is 'any', expected what was asked for: by_object=True"),
    ],
)
def test_a_band_of_what_is_not_there_is_refused(shaken, keywords, message):
    with pytest.raises(ValueError, match=message):
        shaken.band(**keywords)


def test_the_legend_has_the_value_its_interval_and_the_mean_time(shaken):
    low, high = shaken.interval()
    value, mean = texts(drawn(shaken))
    assert value == f"captured: {shaken.captured:.2f} ({low:.2f} to {high:.2f})"
    assert mean == f"mean time captured, {shaken.mean_time:.3g} s"


def test_the_mark_is_on_the_curve_at_the_mean_time(shaken):
    (mark,) = named(drawn(shaken), "mean time")
    assert mark.get_xdata() == [shaken.mean_time]
    before = shaken.times <= shaken.mean_time
    assert mark.get_ydata() == [shaken.curve[before][-1]]


def test_a_line_is_where_the_object_leaves_undisturbed_and_nowhere_if_it_stays(shaken, pushed):
    assert named(drawn(shaken), "leaves") == []
    ax = drawn(pushed)
    (line,) = named(ax, "leaves")
    assert line.get_xdata() == [pushed.undisturbed_time] * 2
    assert f"leaves undisturbed at {pushed.undisturbed_time:.3g} s" in texts(ax)


def test_several_results_have_their_names_and_lines_that_differ_without_colour(shaken, pushed):
    ax = drawn({"rests": shaken, "is pushed": pushed})
    curves = [line for line in ax.lines if line.get_drawstyle() == "steps-post"]
    assert len({line.get_linestyle() for line in curves}) == 2
    assert [text.split(":")[0] for text in texts(ax)[:2]] == ["rests", "is pushed"]
    assert ax.get_xlim()[1] >= max(shaken.times[-1], pushed.times[-1])


def test_of_several_objects_that_of_at_least_one_is_higher():
    found = em.capture_probability(two_balls(), rollouts=30, by_object=True)
    assert found.any.captured > found.captured
    ax = drawn(found, which="any")
    (curve,) = (line for line in ax.lines if line.get_drawstyle() == "steps-post")
    assert np.array_equal(curve.get_ydata(), found.any.curve)
    assert f"{found.any.captured:.2f}" in texts(ax)[0]


@pytest.mark.parametrize(
    ("results", "keywords", "message"),
    [
        (3, {}, "results is 3, expected a CaptureProbability, or several by name"),
        ({}, {}, "results is {}"),
        ({"a": 1.0}, {}, "results has 1.0 as 'a'"),
        (None, {"which": "all"}, "which is 'all'"),
        (None, {"which": "any"}, "by_object=True"),
        (None, {"confidence": 2.0}, "confidence is 2.0"),
        (None, {"legend": "no"}, "legend is 'no'"),
    ],
)
def test_what_cannot_be_drawn_is_said(shaken, results, keywords, message):
    with pytest.raises(ValueError, match=message):
        drawn(shaken if results is None else results, **keywords)


def test_scores_of_a_horizon_are_drawn_from_0_to_1_and_differ_without_colour():
    scores = {"probability": [1.0, 0.5, 0.2], "probability/success": [0.9, 0.9, 0.1]}
    ax = plots.plot_scores([0.0, 0.1, 0.2], scores, ax=Figure().subplots())
    assert ax.get_ylim() == (-0.05, 1.05)
    assert ax.get_ylabel() == "probability [0..1]"
    markers = {line.get_marker() for line in ax.lines}
    assert len(markers) == 2
    assert len({matplotlib.colors.to_rgb(style.color) for style in METRICS.values()}) == 8


def test_the_undisturbed_path_goes_from_the_state_to_the_horizon_with_a_mark_where_it_leaves():
    problem = carried()
    future = undisturbed(problem)
    ax = plots.plot_future(problem, ax=Figure().subplots(), plane=("x", "y"))
    (path,) = named(ax, "undisturbed")
    start = problem.scene.slice("box").start
    assert np.array_equal(path.get_xdata(), future.states[:, start])
    (leaves,) = named(ax, "exit")
    assert leaves.get_xdata() == [future.states[future.exit_moment, start]]
    assert ax.get_title() == f"undisturbed it leaves at {future.exit:.3g} s"
    low, high = ax.get_xlim()
    assert low < path.get_xdata().min() and path.get_xdata().max() < high


def test_what_stays_has_no_mark_and_the_legend_names_no_exit():
    ax = plots.plot_future(resting(), ax=Figure().subplots(), legend=True)
    assert named(ax, "exit") == []
    assert ax.get_title() == "undisturbed it stays captured for 0.4 s"
    assert "undisturbed path" in texts(ax) and "where it leaves" not in texts(ax)


def test_a_future_needs_a_horizon():
    with pytest.raises(ValueError, match="without horizon and plan"):
        plots.plot_future(carried().replace(horizon=None, plan=None), ax=Figure().subplots())
