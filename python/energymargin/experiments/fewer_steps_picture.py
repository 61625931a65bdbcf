"""The picture of `fewer_steps`: AUC and AP against the computing time of a state."""

from __future__ import annotations

from itertools import product
from typing import Any

from energymargin.experiments.fewer_steps import FewerSteps
from energymargin.experiments.fewer_steps_options import OPTIONS

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_fewer_steps"]

# Okabe and Ito's colours, which all eyes tell apart; markers too, for print in grey.
STYLES = {
    "ends alone": ("#000000", "o"),
    "four trees": ("#999999", "<"),
    "2 nodes an edge": ("#56B4E9", "v"),
    "likely 1 %": ("#F0E442", "P"),
    "likely 10 %": ("#009E73", "X"),
    "likely 10 %, 4 nodes": ("#D55E00", "*"),
    "4 nodes an edge": ("#0072B2", "s"),
    "8 nodes an edge": ("#CC79A7", "D"),
    "frame before": ("#E69F00", "^"),
    "as published": ("#000000", "o"),
    "stop at escape": ("#0072B2", "s"),
    "shortened": ("#E69F00", "^"),
    "shortened, stop at escape": ("#009E73", "D"),
}
METRICS = {"capture": "capture score", "effort/est": "effort of escape, AO-EST"}
QUALITIES = ("AUC", "AP")


def figure_fewer_steps(result: FewerSteps) -> Figure:
    """A row a task, a column for each score's AUC and AP; error bars are standard deviations."""
    tasks = result.settings.tasks
    columns = list(product(METRICS, range(len(QUALITIES))))
    figure = Figure(figsize=(12, 2.6 * len(tasks) + 0.6), dpi=200, layout="constrained")
    axes = figure.subplots(len(tasks), len(columns), squeeze=False)
    for row, task in enumerate(tasks):
        for column, (metric, quality) in enumerate(columns):
            ax = axes[row, column]
            _draw(ax, result, task, metric, quality)
            if column == 0:
                ax.set_ylabel(task, fontsize=9)
            if row == 0:
                ax.set_title(f"{METRICS[metric]}: {QUALITIES[quality]}", fontsize=9)
            if row == len(tasks) - 1:
                ax.set_xlabel("computing time of a state [ms]", fontsize=8)
    for first, side in ((0, "left"), (len(QUALITIES), "right")):
        handles, labels = axes[0, first].get_legend_handles_labels()
        where: Any = f"outside lower {side}"
        figure.legend(handles, labels, loc=where, ncols=4, frameon=False, fontsize=7)
    return figure


def _draw(ax: Axes, result: FewerSteps, task: str, metric: str, quality: int) -> None:
    for option in OPTIONS:
        points = result.curve(task, metric, option)
        if not points:
            continue
        color, marker = STYLES[option]
        values = [p.quality[:, quality] for p in points]
        ax.errorbar(
            [1e3 * p.seconds for p in points],
            [v.mean() for v in values],
            yerr=[v.std(ddof=1) if len(v) > 1 else 0.0 for v in values],
            color=color,
            marker=marker,
            markersize=3.5,
            linewidth=1.2,
            elinewidth=0.6,
            label=option,
        )
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25, linewidth=0.5)
