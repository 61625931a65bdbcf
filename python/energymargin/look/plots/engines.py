"""One question in several engines: how long each holds, and how far apart they move."""

from __future__ import annotations

from matplotlib.figure import Figure

from energymargin.base.checks import check_type
from energymargin.evaluate.engine_comparison import EngineComparison
from energymargin.look.plots import styles
from energymargin.look.plots.results import plot_probability

WIDTH, HEIGHT, OF_DISTANCES = 6.0, 2.8, 1.6  # inch


def figure_engines(comparison: EngineComparison) -> Figure:
    """The probability over time in each engine, and below how far its objects are, without a
    disturbance, from where the first engine has them [mm].

    Raises ValueError on another thing than an EngineComparison.
    """
    check_type("comparison", comparison, EngineComparison, "that of em.compare_engines")
    figure = Figure(figsize=(WIDTH, HEIGHT + OF_DISTANCES), dpi=150, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(HEIGHT, OF_DISTANCES))
    plot_probability(dict(zip(comparison.engines, comparison.probabilities, strict=True)), ax=above)
    above.set_xlabel("")
    for number, distances in enumerate(comparison.distances):
        style = styles.curve_style(number)
        below.plot(comparison.times, 1000 * distances, color=style.color)
    below.set(xlabel="time [s]", ylabel="apart [mm]")
    return figure
