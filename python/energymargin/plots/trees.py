"""A search tree over the workspace."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from energymargin._core import Problem, Tree
from energymargin.outlines import Limits, Plan, object_centers
from energymargin.plots.sets import lost_objects, sets_of
from energymargin.plots.styles import COSTS, LOST_COLOR

__all__ = ["draw_color_bar", "draw_tree", "in_view", "most_cost"]

LEAST = 1e-9  # J, at the end of a colour bar


def draw_tree(
    ax: Axes, problem: Problem, tree: Tree, plane: Plan, costs: Normalize
) -> NDArray[np.float64]:
    """Edges, nodes by cost, and a cross at each object that is lost; where these are, (N, 2)."""
    points = tree.states[:, object_centers(problem.scene, plane)]  # (M + 1, k, 2)
    edges = np.stack([points[tree.parents[1:]], points[1:]], axis=2).reshape(-1, 2, 2)
    ax.add_collection(
        LineCollection(list(edges), colors="0.25", linewidths=0.4, alpha=0.5, zorder=5)
    )
    ax.scatter(
        points[..., 0].ravel(),
        points[..., 1].ravel(),
        c=np.repeat(tree.costs, points.shape[1]),
        cmap=COSTS,
        norm=costs,
        s=9,
        linewidths=0.2,
        edgecolors="white",
        zorder=6,
        gid="nodes",
    )
    outside = points[lost_objects(problem, tree.states)]
    ax.scatter(
        outside[:, 0],
        outside[:, 1],
        marker="x",
        s=9,
        linewidths=0.5,
        color=LOST_COLOR,
        zorder=7,
        gid="outside",
    )
    return outside


def in_view(points: NDArray[np.float64], limits: Limits) -> NDArray[np.bool_]:
    """Which points, shape (..., 2), are in the view, shape (...)."""
    low, high = np.transpose(limits)
    return np.asarray(((points >= low) & (points <= high)).all(axis=-1))


def most_cost(problem: Problem, tree: Tree) -> float:
    """That of the costliest node in the capture set [J]: what lies beyond may cost much more."""
    captured, _ = sets_of(problem)
    inside = np.asarray(captured.contains(problem.scene, tree.states))
    costs = tree.costs[inside] if inside.any() else tree.costs
    return max(LEAST, float(costs.max()))


def draw_color_bar(
    figure: Figure | SubFigure, axes: Any, costs: Normalize, most: float, **options: Any
) -> None:
    """What the nodes' colours mean, beside the axes; open if the costliest, `most`, is beyond."""
    figure.colorbar(
        ScalarMappable(costs, COSTS),
        ax=axes,
        label="cost of reaching a node [J]",
        extend="max" if most > (costs.vmax or 0.0) else "neither",
        **options,
    )
