"""The paper's qualitative figure: search trees along trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from energymargin._core import CaptureScore, Problem, capture_score, stream
from energymargin.outlines import Limits, view_of
from energymargin.plots.legends import score_title, state_legend
from energymargin.plots.states import LEAST, plot_state
from energymargin.plots.styles import COSTS
from energymargin.tasks.base import Task, Trajectory, plane_of

__all__ = ["figure_qualitative"]

LINE = 0.15  # inch, of a title


def figure_qualitative(
    task: Task,
    trajectories: Mapping[str, Trajectory],
    *,
    frames: Sequence[int] | None = None,
    nodes: int = 100,
    seed: int = 0,
    first_states: Mapping[str, int] | None = None,
    pairs: bool = False,
) -> Figure:
    """Search trees in some frames of each trajectory: a row a trajectory, named as in the mapping.

    `frames` are numbers of frames; None takes three of them, from the first on, a third of the
    trajectory apart. The trees are grown here, with `nodes` nodes each. `first_states` are the
    numbers of the trajectories' first states in their dataset: with them the trees, and so the
    scores, are those that the dataset gets from the same nodes and seed. `pairs` writes the scores
    as (success, capture) under each frame, as the paper does, instead of above it.
    """
    numbers = first_states or dict.fromkeys(trajectories, 0)
    rows = {
        name: [
            _panel(task, trajectory, k, nodes, stream(seed, numbers[name] + k))
            for k in (_three(len(trajectory)) if frames is None else frames)
        ]
        for name, trajectory in trajectories.items()
    }
    panels = [panel for row in rows.values() for panel in row]
    scene = panels[0].problem.scene
    plane = plane_of(task)
    limits = view_of(scene, np.concatenate([t.states for t in trajectories.values()]), plane)
    most = max(LEAST, *(float(panel.score.tree.costs.max()) for panel in panels))

    lines = max(score_title(panel.score).count("\n") + 2 for panel in panels)
    columns = max(len(row) for row in rows.values())
    figure, axes = _grid(len(rows), columns, limits, LINE * (lines + 1))
    look: dict[str, Any] = {"plane": plane, "limits": limits, "most": most}
    for (name, row), row_axes in zip(rows.items(), axes, strict=True):
        for panel, ax in zip(row, row_axes, strict=False):
            plot_state(
                *(panel.problem, panel.score, ax), **look, path=False, color_bar=False, ghosts=3
            )
            _write_scores(ax, panel, pairs=pairs)
        row_axes[0].set_ylabel(f"{name}\n{plane[1]} [m]")
    _explain(figure, axes, most, panels[0].problem)
    return figure


class _Panel(NamedTuple):
    time: float
    problem: Problem
    score: CaptureScore


def _panel(task: Task, trajectory: Trajectory, k: int, nodes: int, seed: int) -> _Panel:
    problem = task.problem(trajectory.states[k], trajectory.params, trajectory.contacts[k])
    score = capture_score(problem, nodes=nodes, seed=seed)
    return _Panel(float(trajectory.times[k]), problem, score)


def _write_scores(ax: Axes, panel: _Panel, *, pairs: bool) -> None:
    """Beside the time of a frame: under it as a pair, or above it by their names."""
    time, score = f"t = {panel.time:.2f} s", panel.score
    ax.set_title(time if pairs else f"{time}\n{score_title(score)}", fontsize=9)
    ax.label_outer()
    if pairs:
        success = "-" if score.success is None else f"{score.success:.2f}"
        ax.set_xlabel(f"{ax.get_xlabel()}\n({success}, {score.capture:.2f})".lstrip())


def _explain(figure: Figure, axes: Any, most: float, problem: Problem) -> None:
    """A colour bar and a legend for all panels."""
    costs = ScalarMappable(Normalize(0.0, most), COSTS)
    figure.colorbar(costs, ax=axes, label="cost of reaching a node [J]", shrink=0.7, pad=0.015)
    handles = state_legend(problem)
    figure.legend(
        handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8
    )


def _three(frames: int) -> list[int]:
    """The first frame, and those at one and two thirds, each once."""
    return sorted({0, frames // 3, 2 * frames // 3})


def _grid(rows: int, columns: int, limits: Limits, title: float) -> tuple[Figure, Any]:
    """A figure whose panels leave no gaps between them, and its axes; `title` [inch] is above."""
    (x0, x1), (y0, y1) = limits
    panel = 2.9  # width [inch]
    size = (panel * columns + 1.2, (panel * (y1 - y0) / (x1 - x0) + title) * rows + 0.7)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    return figure, figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
