"""The picture of `closed_forms`: for each problem, how the ratio falls with the nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin.experiments.closed_forms import (
    OURS,
    PLANNER_NAMES,
    PUBLISHED,
    ClosedForms,
    measurable,
)
from energymargin.experiments.known_answers import KnownAnswer

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_closed_forms"]

COLORS = {"est": "#0072B2", "rrt": "#D55E00"}
COLUMNS = 4
TICKS = (1, 1.25, 2, 5, 10)
FEWEST = 30  # nodes, where the curves begin


def figure_closed_forms(result: ClosedForms) -> Figure:
    """Medians and ranges over the seeds; dashed, the search as published."""
    problems = [problem for problem in result.problems if measurable(problem)]
    rows = -(-len(problems) // COLUMNS)
    figure = Figure(figsize=(3 * COLUMNS, 2.5 * rows), dpi=200, layout="constrained")
    for i, problem in enumerate(problems):
        _draw(figure.add_subplot(rows, COLUMNS, i + 1), result, problem, legend=i == 0)
    figure.supxlabel("nodes", fontsize=9)
    figure.supylabel("effort found / answer on paper", fontsize=9)
    return figure


def _draw(ax: Axes, result: ClosedForms, problem: KnownAnswer, *, legend: bool) -> None:
    most = max(run.job.nodes for run in result.runs)
    nodes = np.unique(np.geomspace(FEWEST, most, 60).astype(int))
    for planner, name in PLANNER_NAMES.items():
        ratios = _ratios(result, problem, planner, OURS, nodes)
        ax.fill_between(
            nodes, ratios.min(0), ratios.max(0), color=COLORS[planner], alpha=0.15, lw=0
        )
        ax.plot(nodes, np.median(ratios, 0), color=COLORS[planner], label=name)
        published = _ratios(result, problem, planner, PUBLISHED, nodes)
        if len(published):
            label = f"{name}, as published"
            ax.plot(nodes, np.median(published, 0), "--", lw=1, color=COLORS[planner], label=label)
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.set(xscale="log", yscale="log", ylim=(0.93, 12))
    ax.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    ax.set_yticks([], minor=True)
    ax.set_title(f"{problem.name}: {problem.formula}", fontsize=9)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25, linewidth=0.5)
    if legend:
        ax.legend(frameon=False, fontsize=6)


def _ratios(
    result: ClosedForms, problem: KnownAnswer, planner: str, search: str, nodes: NDArray[np.int_]
) -> NDArray[np.float64]:
    """One row a seed; where nothing is found yet, above the picture."""
    efforts = [result.efforts(problem, planner, search, int(n)) for n in nodes]
    return np.minimum(np.transpose(efforts) / problem.answer, 1e3)
