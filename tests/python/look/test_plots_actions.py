"""Pictures of rankings and of improvements, from results made by hand."""

import warnings

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.colors import same_color
from matplotlib.figure import Figure

from energymargin.act.candidates import Standing
from energymargin.actions import Generation, Improvement, Ranking
from energymargin.plots import figure_improvement, plot_ranking

LONG = "5 cm forward of the centre of the box, same closing speed"
INF = np.inf
RANGES = {"sideways": (-6.0, 6.0), "speed": (0.0, 0.5)}


def standing(name, values, low, score, high, *, racing=True):
    return Standing(name, np.array(values, dtype=float), 1.0, score, low, high, 100, racing)


def of_efforts(*standings):
    return Ranking("effort/est", standings, tolerance=0.05, level=0.95)


def of_probabilities(*names):
    values = [np.arange(40) < 40 - 12 * row for row in range(len(names))]
    rows = [
        standing(name, one, one.mean() - 0.1, one.mean(), one.mean(), racing=row == 0)
        for row, (name, one) in enumerate(zip(names, values, strict=True))
    ]
    return Ranking("probability", tuple(rows), tolerance=0.05, level=0.95)


def improvement(scores, ranking=None):
    """One generation for each list of scores."""
    generations = tuple(
        Generation(np.zeros((len(s), 2)), np.array(s, dtype=float), 0, 1.0 + k, np.array([0.4, 1]))
        for k, s in enumerate(scores)
    )
    return Improvement(
        values={"sideways": 0.0, "speed": 0.1},
        start={"sideways": 1.0, "speed": 0.2},
        problem=None,
        ranking=ranking or of_probabilities("favourite", "start"),
        generations=generations,
        ranges=RANGES,
        steps=1,
        complete=True,
    )


def drawn(figure):
    """Draws it; any warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.draw_without_rendering()
    return figure


def triangles(ax, row):
    """Abscissas of those in a row, and the right edge of the axes."""
    lines = [line for line in ax.lines if line.get_marker() == ">" and row in line.get_ydata()]
    return [float(line.get_xdata()[0]) for line in lines], ax.get_xlim()[1]


def legend_texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def is_clear(ax):
    """Whether the legend lies outside of the axes."""
    drawn(ax.figure)
    return not ax.get_legend().get_window_extent().overlaps(ax.get_window_extent())


def test_an_interval_without_an_end_runs_to_the_right_edge():
    ranking = of_efforts(
        standing("a", [0.2, 0.3, INF], 0.2, 0.3, INF), standing("b", [0.1] * 3, 0.1, 0.1, 0.1)
    )
    ax = plot_ranking(ranking, Figure().subplots())
    (at,), right = triangles(ax, 0)
    assert 0.3 < at < right
    assert [0.2, at] in [list(line.get_xdata()) for line in ax.lines]
    assert triangles(ax, 1)[0] == []
    assert "no escape found" in legend_texts(ax)


def test_a_median_without_a_bound_is_a_triangle_also_if_all_are():
    endless = [standing(name, [INF] * 3, INF, INF, INF) for name in "ab"]
    ax = plot_ranking(of_efforts(*endless), Figure().subplots())
    for row in (0, 1):
        at, right = triangles(ax, row)
        assert at and all(0 < x < right for x in at)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["∞"]


@pytest.mark.parametrize("name", [LONG, "/" + 40 * "candidate_" + "12.json"])
def test_a_long_name_leaves_the_axes_their_space(name):
    figure = drawn(plot_ranking(of_probabilities(name, "b")).figure)
    (ax,) = figure.axes
    label = ax.get_yticklabels()[0].get_window_extent()
    assert ax.get_window_extent().width > 0.4 * figure.bbox.width
    assert label.x0 >= 0
    assert not label.overlaps(ax.get_yticklabels()[1].get_window_extent())
    pyplot.close(figure)


def test_the_legend_of_a_ranking_names_what_occurs_beside_the_data():
    two = of_probabilities("a", "b")
    ax = plot_ranking(two, Figure(layout="constrained").subplots())
    assert legend_texts(ax) == ["best", "worse", "left the race", "95 % interval"]
    assert is_clear(ax)
    alone = plot_ranking(of_probabilities("a"), Figure().subplots())
    assert legend_texts(alone) == ["best", "95 % interval"]


@pytest.mark.parametrize("name", ["$\\x$", "cost_$5.json", "a $2 b $3", "\\$x$"])
def test_a_dollar_sign_in_a_name_is_no_mathematics(name):
    ax = plot_ranking(of_probabilities(name, "b"), Figure().subplots())
    drawn(ax.figure)
    text, is_math = ax.get_yticklabels()[0]._preprocess_math(ax.get_yticklabels()[0].get_text())
    assert (text, is_math) == (name, False)


def test_an_improvement_tells_real_values_and_covers_no_data():
    figure = drawn(figure_improvement(improvement([[0.2, 0.4], [0.5, 0.6]])))
    scores, parameters, last, disturbance = figure.axes
    assert legend_texts(parameters) == ["sideways: -1.2 of -6 to 6", "speed: 0.5 of 0 to 0.5"]
    assert legend_texts(scores) == ["each plan", "median", "best"]
    assert all(is_clear(ax) for ax in (scores, parameters, last))
    (steps,) = disturbance.lines
    assert not any(same_color(line.get_color(), steps.get_color()) for line in parameters.lines)


def test_the_ticks_of_one_generation_are_its_number():
    scores, parameters, *_ = drawn(figure_improvement(improvement([[0.2, 0.4]]))).axes
    for ax in (scores, parameters):
        assert [tick for tick in ax.get_xticks() if 0.5 <= tick <= 1.5] == [1]


def test_generations_without_a_plan_that_can_be_or_without_an_escape_are_drawn():
    nothing = [[np.nan, np.nan], [0.5, np.nan]]
    assert drawn(figure_improvement(improvement(nothing)))
    ranking = of_efforts(standing("favourite", [INF], INF, INF, INF))
    scores = drawn(figure_improvement(improvement([[INF, INF], [0.1, INF]], ranking))).axes[0]
    *_, top = scores.get_yticks()
    marks = [line for line in scores.lines if top in line.get_ydata()]
    assert [list(line.get_xdata()) for line in marks] == [[1, 1, 2], [1, 2], [1]]
    assert "no escape found" in legend_texts(scores)


def test_another_thing_is_refused():
    with pytest.raises(ValueError, match="ranking is 'abc', expected a Ranking"):
        plot_ranking("abc")
    with pytest.raises(ValueError, match="improvement is None, expected an Improvement"):
        figure_improvement(None)
