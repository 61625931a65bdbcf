"""Rankings of candidates, and how a plan was improved."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from energymargin.actions import Improvement, Ranking
from energymargin.metrics import axis_label, is_likelihood
from energymargin.plots.styles import light_grid

__all__ = ["figure_improvement", "plot_ranking"]

BEST, ALIKE, WORSE = "tab:blue", "0.25", "0.7"
ROW = 0.32  # inch, of a candidate


def plot_ranking(ranking: Ranking, ax: Axes | None = None) -> Axes:
    """The candidates with their 95 % intervals, the best on top: blue the best, black those of
    which it is not surely better, grey the others; a hollow mark was out before the end."""
    if ax is None:
        from matplotlib import pyplot

        height = 1.2 + ROW * len(ranking)
        ax = pyplot.subplots(figsize=(5.2, height), layout="constrained")[1]
    for row, standing in enumerate(ranking):
        color = BEST if row == 0 else ALIKE if standing.name in ranking.alike else WORSE
        if np.isfinite([standing.low, standing.high]).all():
            ax.plot([standing.low, standing.high], [row, row], color=color, linewidth=1.6)
        ax.plot(
            standing.score,
            row,
            marker="o",
            color=color,
            markerfacecolor=color if standing.racing else "white",
            markersize=5,
        )
    ax.set_yticks(range(len(ranking)), ranking.names)
    ax.set_ylim(len(ranking) - 0.5, -0.5)
    if is_likelihood(ranking.metric):
        ax.set_xlim(-0.02, 1.02)
    ax.set_xlabel(f"{axis_label(ranking.metric)}")
    light_grid(ax)
    return ax


def figure_improvement(improvement: Improvement) -> Figure:
    """The scores of each generation and the strength of the disturbance; where the parameters went,
    as shares of their ranges; and the last comparison."""
    figure = Figure(figsize=(11.0, 3.4), dpi=150, layout="constrained")
    scores, parameters, last = figure.subplots(1, 3, width_ratios=(1.1, 1.1, 1.0))
    _draw_scores(scores, improvement)
    _draw_parameters(parameters, improvement)
    plot_ranking(improvement.ranking, last)
    last.set_title("new draws, as stated", fontsize=10)
    return figure


def _draw_scores(ax: Axes, improvement: Improvement) -> None:
    """Of all plans, the best and the median of each generation; the factor beside them."""
    numbers = np.arange(1, len(improvement.generations) + 1)
    for number, one in zip(numbers, improvement.generations, strict=True):
        ax.plot(np.full(len(one.scores), number), one.scores, ".", color="0.75", markersize=3)
    best = [one.scores[one.best] for one in improvement.generations]
    median = [np.nanmedian(one.scores) for one in improvement.generations]
    ax.plot(numbers, best, "o-", color=BEST, linewidth=1.6, markersize=3, label="best")
    ax.plot(numbers, median, "o-", color=ALIKE, linewidth=1.2, markersize=2, label="median")
    ax.set_ylabel(axis_label(improvement.ranking.metric))
    _count_generations(ax, len(numbers))
    light_grid(ax)
    factors = [one.factor for one in improvement.generations]
    if max(factors) > 1.0:
        beside = ax.twinx()
        beside.step(numbers, factors, where="mid", color="tab:orange", linewidth=1.2)
        beside.set_ylabel("disturbance, times the stated one", color="tab:orange")
        beside.set_ylim(bottom=0.0)
    ax.legend(loc="lower right", fontsize=8)


def _draw_parameters(ax: Axes, improvement: Improvement) -> None:
    """The strategy's favourite after each generation."""
    points = np.array([one.favourite for one in improvement.generations])
    numbers = np.arange(1, len(points) + 1)
    for name, column in zip(improvement.parameters, points.T, strict=True):
        ax.plot(numbers, column, "o-", linewidth=1.4, markersize=2, label=name)
    ax.set(ylabel="favourite, share of the range", ylim=(-0.02, 1.02))
    _count_generations(ax, len(points))
    light_grid(ax)
    ax.legend(fontsize=8)


def _count_generations(ax: Axes, count: int) -> None:
    """The axis of their numbers."""
    ax.set(xlabel="generation", xlim=(0.5, count + 0.5))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
