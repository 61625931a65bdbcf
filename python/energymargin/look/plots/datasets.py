"""Pictures of trajectories of a task: their search trees, and the scores along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from energymargin import tasks
from energymargin._core import CaptureScore, Problem, capture_score, stream
from energymargin.base.checks import whole_number
from energymargin.look.outlines import Limits, Plan, view_of
from energymargin.look.plots.scenes import lost_objects
from energymargin.look.plots.states import plot_state, score_title, state_legend
from energymargin.look.plots.styles import LEGEND_SIZE
from energymargin.look.plots.trajectories import figure_scores, trajectory_scores
from energymargin.look.plots.trees import draw_color_bar, most_cost
from energymargin.records.datasets import Dataset
from energymargin.records.evaluation import LabelledScores
from energymargin.tasks.base import Task, plane_of
from energymargin.tasks.trajectories import Trajectory

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


def figure_trees(dataset: Dataset, nodes: int, seed: int) -> Figure:
    """Search trees in three frames of a failed and of a successful trajectory.

    The trees, and so their scores, are those that the dataset gets from these nodes and this seed.
    """
    chosen = one_of_each(dataset)
    frames = dataset.frames()
    return figure_qualitative(
        tasks.make(dataset.task, **dataset.parameters),
        {name: dataset.trajectories[t] for name, t in chosen.items()},
        nodes=nodes,
        seed=seed,
        first_states={name: frames.index((t, 0)) for name, t in chosen.items()},
    )


def figure_along(dataset: Dataset, labelled: LabelledScores) -> Figure:
    """The scores along a failed and a successful trajectory."""
    columns = {}
    for name, t in one_of_each(dataset).items():
        times = dataset.trajectories[t].times
        columns[f"{name} trajectory"] = trajectory_scores(labelled, t, times=times)
    return figure_scores(columns)


def figure_qualitative(
    task: Task,
    trajectories: Mapping[str, Trajectory],
    *,
    frames: Sequence[int] | None = None,
    nodes: int = 100,
    seed: int = 0,
    first_states: Mapping[str, int] | None = None,
) -> Figure:
    """Search trees in some frames of each trajectory: a row a trajectory, with its name.

    Args:
        task: of the trajectories.
        trajectories: by name.
        frames: their numbers. None takes three, from the first on, a third of the trajectory apart.
        nodes: of each search tree.
        seed: of the searches.
        first_states: the numbers of the trajectories' first states in their dataset. With them the
            trees, and so the scores, are those that the dataset gets from these nodes and seed.

    Raises:
        ValueError: for no trajectories, or a frame that a trajectory does not have.
    """
    if not trajectories:
        raise ValueError("trajectories is empty, expected some by name: {'failed': ...}")
    plane = plane_of(task)
    panels: list[list[_Panel]] = []
    for name, trajectory in trajectories.items():
        first, count = (first_states or {}).get(name, 0), len(trajectory)
        shown = sorted({0, count // 3, 2 * count // 3})
        if frames is not None:
            shown = [whole_number("frame", k, 0, count - 1) for k in frames]
        panels.append([])
        for k in shown:
            asked = trajectory.states[k], trajectory.params, trajectory.contacts[k]
            problem = task.problem(*asked)
            settings: dict[str, Any] = {"nodes": nodes, "seed": stream(seed, first + k)}
            score = capture_score(problem, warn=False, **settings)
            panels[-1].append(_Panel(float(trajectory.times[k]), problem, score))
    states = np.concatenate([trajectory.states for trajectory in trajectories.values()])
    return _figure(panels, list(trajectories), plane, view_of(problem.scene, states, plane))


class _Panel(NamedTuple):
    time: float
    problem: Problem
    score: CaptureScore


def _figure(
    rows: Sequence[Sequence[_Panel]], names: Sequence[str], plane: Plan, limits: Limits
) -> Figure:
    """Panels without gaps between them, and a colour bar and a legend for all."""
    panels = [panel for row in rows for panel in row]
    most = max(most_cost(panel.problem, panel.score.tree) for panel in panels)
    highest = max(float(panel.score.tree.costs.max()) for panel in panels)
    lines = max(score_title(panel.score).count("\n") + 3 for panel in panels)
    columns = max(len(row) for row in rows)
    (x0, x1), (y0, y1) = limits
    height = PANEL * (y1 - y0) / (x1 - x0) + LINE * lines
    size = (PANEL * columns + 1.2, height * len(rows) + 0.7)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(rows), columns, sharex=True, sharey=True, squeeze=False)
    look: dict[str, Any] = {"plane": plane, "limits": limits, "most": most, "path": False}
    for name, row, row_axes in zip(names, rows, axes, strict=True):
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
