"""Pictures of trajectories of a dataset: their search trees, and the scores along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from energymargin import tasks
from energymargin._core import CaptureScore, Problem, capture_score, stream
from energymargin.look.outlines import Limits, Plan, view_of
from energymargin.look.plots.scenes import lost_objects
from energymargin.look.plots.states import plot_state, score_title, state_legend
from energymargin.look.plots.styles import LEGEND_SIZE
from energymargin.look.plots.trajectories import figure_scores, trajectory_scores
from energymargin.look.plots.trees import draw_color_bar, most_cost
from energymargin.records.datasets import Dataset
from energymargin.records.evaluation import LabelledScores
from energymargin.tasks.base import plane_of

LINE = 0.15  # inch, of a title
PANEL = 2.9  # inch, width of one


def one_of_each(dataset: Dataset) -> dict[str, int]:
    """A failed and a successful trajectory of a dataset, with an end as clear as can be."""
    chosen, every = {}, list(enumerate(dataset.trajectories))
    for name, success in (("failed", False), ("successful", True)):
        of_kind = {t: one.captured[-1] == success for t, one in every if one.success == success}
        if of_kind:
            chosen[name] = max(of_kind, key=lambda t: of_kind[t])  # the first of the clear ones
    return chosen


def figure_along(dataset: Dataset, labelled: LabelledScores) -> Figure:
    """The scores along a failed and a successful trajectory."""
    columns = {}
    for name, t in one_of_each(dataset).items():
        times = dataset.trajectories[t].times
        columns[f"{name} trajectory"] = trajectory_scores(labelled, t, times=times)
    return figure_scores(columns)


def figure_trees(dataset: Dataset, nodes: int, seed: int) -> Figure:
    """Search trees in three frames of a failed and of a successful trajectory, a third of it apart.

    The trees, and so their scores, are those that the dataset gets from these nodes and this seed.
    """
    rows: dict[str, list[_Panel]] = {}
    states = []
    for name, t in one_of_each(dataset).items():
        trajectory, first = dataset.trajectories[t], int(dataset.lengths[:t].sum())
        count = len(trajectory)
        frames = sorted({0, count // 3, 2 * count // 3})
        problems = dataset.problems([first + frame for frame in frames])
        rows[name] = [
            _Panel(
                float(trajectory.times[frame]),
                problem,
                capture_score(problem, nodes=nodes, seed=stream(seed, first + frame), warn=False),
            )
            for frame, problem in zip(frames, problems, strict=True)
        ]
        states.append(trajectory.states)
    plane = plane_of(tasks.make(dataset.task, **dataset.parameters))
    limits = view_of(problems[0].scene, np.concatenate(states), plane)
    return _figure(rows, plane, limits)


class _Panel(NamedTuple):
    time: float
    problem: Problem
    score: CaptureScore


def _figure(rows: Mapping[str, Sequence[_Panel]], plane: Plan, limits: Limits) -> Figure:
    """Panels without gaps between them, and a colour bar and a legend for all."""
    panels = [panel for row in rows.values() for panel in row]
    most = max(most_cost(panel.problem, panel.score.tree) for panel in panels)
    highest = max(float(panel.score.tree.costs.max()) for panel in panels)
    lines = max(score_title(panel.score).count("\n") + 3 for panel in panels)
    columns = max(map(len, rows.values()))
    (x0, x1), (y0, y1) = limits
    height = PANEL * (y1 - y0) / (x1 - x0) + LINE * lines
    size = (PANEL * columns + 1.2, height * len(rows) + 0.7)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(rows), columns, sharex=True, sharey=True, squeeze=False)
    look: dict[str, Any] = {"plane": plane, "limits": limits, "most": most, "path": False}
    for (name, row), row_axes in zip(rows.items(), axes, strict=True):
        for panel, ax in zip(row, row_axes, strict=False):
            plot_state(panel.problem, panel.score, ax=ax, color_bar=False, ghosts=3, **look)
            ax.set_title(f"t = {panel.time:.2f} s\n{score_title(panel.score)}", fontsize=9)
            ax.label_outer()
        row_axes[0].set_ylabel(f"{name}\n{plane[1]} [m]")
    draw_color_bar(figure, axes, Normalize(0.0, most), highest, shrink=0.7, pad=0.015)
    crosses = any(lost_objects(panel.problem, panel.score.tree.states).any() for panel in panels)
    handles = state_legend(panels[0].problem, tree=crosses)
    looks: dict[str, Any] = {"ncols": len(handles), "frameon": False, "fontsize": LEGEND_SIZE}
    figure.legend(handles=handles, loc="outside lower center", **looks)
    return figure
