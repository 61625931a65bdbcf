"""Pictures of trajectories of a task: their search trees, and the scores along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from energymargin import tasks
from energymargin._core import CaptureScore, Problem, capture_score, stream
from energymargin.checks import whole_number
from energymargin.datasets import Dataset
from energymargin.evaluation import LabelledScores
from energymargin.outlines import Limits, Plan, view_of
from energymargin.plots.scenes import lost_objects
from energymargin.plots.states import plot_state, score_title, state_legend
from energymargin.plots.trajectories import figure_scores, trajectory_scores
from energymargin.plots.trees import draw_color_bar, most_cost
from energymargin.tasks.base import Task, plane_of
from energymargin.trajectories import Trajectory

LINE = 0.15  # inch, of a title


def one_of_each(dataset: Dataset) -> dict[str, int]:
    """A failed and a successful trajectory of a dataset, with an end as clear as can be."""
    chosen = {}
    for name, success in (("failed", False), ("successful", True)):
        of_kind = [
            t for t, trajectory in enumerate(dataset.trajectories) if trajectory.success == success
        ]
        if of_kind:
            chosen[name] = max(
                of_kind, key=lambda t: (dataset.trajectories[t].captured[-1] == success, -t)
            )
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
    numbers = dict.fromkeys(trajectories, 0) if first_states is None else first_states
    rows = {
        name: [
            _panel(task, trajectory, k, nodes, stream(seed, numbers[name] + k))
            for k in _frames(trajectory, frames)
        ]
        for name, trajectory in trajectories.items()
    }
    scene = next(iter(rows.values()))[0].problem.scene
    plane = plane_of(task)
    states = np.concatenate([trajectory.states for trajectory in trajectories.values()])
    return _figure(rows, plane, view_of(scene, states, plane))


def _figure(rows: Mapping[str, Sequence[_Panel]], plane: Plan, limits: Limits) -> Figure:
    panels = [panel for row in rows.values() for panel in row]
    most = max(most_cost(panel.problem, panel.score.tree) for panel in panels)
    lines = max(score_title(panel.score).count("\n") + 2 for panel in panels)
    columns = max(len(row) for row in rows.values())
    figure, axes = _grid(len(rows), columns, limits, LINE * (lines + 1))
    look: dict[str, Any] = {"plane": plane, "limits": limits, "most": most, "path": False}
    for (name, row), row_axes in zip(rows.items(), axes, strict=True):
        for panel, ax in zip(row, row_axes, strict=False):
            plot_state(panel.problem, panel.score, ax=ax, color_bar=False, ghosts=3, **look)
            ax.set_title(f"t = {panel.time:.2f} s\n{score_title(panel.score)}", fontsize=9)
            ax.label_outer()
        row_axes[0].set_ylabel(f"{name}\n{plane[1]} [m]")
    _explain(figure, axes, most, panels)
    return figure


def _frames(trajectory: Trajectory, frames: Sequence[int] | None) -> list[int]:
    """The chosen ones; of None the first, and those at one and two thirds, each once."""
    count = len(trajectory)
    if frames is None:
        return sorted({0, count // 3, 2 * count // 3})
    return [whole_number("frame", k, 0, count - 1) for k in frames]


class _Panel(NamedTuple):
    time: float
    problem: Problem
    score: CaptureScore


def _panel(task: Task, trajectory: Trajectory, k: int, nodes: int, seed: int) -> _Panel:
    problem = task.problem(trajectory.states[k], trajectory.params, trajectory.contacts[k])
    score = capture_score(problem, nodes=nodes, seed=seed, warn=False)
    return _Panel(float(trajectory.times[k]), problem, score)


def _explain(figure: Figure, axes: Any, most: float, panels: Sequence[_Panel]) -> None:
    """A colour bar and a legend for all panels."""
    highest = max(float(panel.score.tree.costs.max()) for panel in panels)
    draw_color_bar(figure, axes, Normalize(0.0, most), highest, shrink=0.7, pad=0.015)
    crosses = any(lost_objects(panel.problem, panel.score.tree.states).any() for panel in panels)
    handles = state_legend(panels[0].problem, tree=crosses)
    figure.legend(
        handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8
    )


def _grid(rows: int, columns: int, limits: Limits, title: float) -> tuple[Figure, Any]:
    """A figure whose panels leave no gaps between them, and its axes; `title` [inch] is above."""
    (x0, x1), (y0, y1) = limits
    panel = 2.9  # width [inch]
    size = (panel * columns + 1.2, (panel * (y1 - y0) / (x1 - x0) + title) * rows + 0.7)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    return figure, figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
