"""A search tree over the workspace."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from energymargin._core import Problem, Tree
from energymargin.outlines import Limits, Plan, object_centers
from energymargin.plots.sets import lost_objects
from energymargin.plots.styles import COSTS, LOST_COLOR, nodes_in_words

__all__ = ["draw_color_bar", "draw_tree", "out_of_view"]


def draw_tree(ax: Axes, problem: Problem, tree: Tree, plane: Plan, costs: Normalize) -> None:
    """Edges, nodes by cost, and a cross at each object that is lost."""
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


def out_of_view(points: NDArray[np.float64], limits: Limits) -> str:
    """How many of the nodes have an object outside of the view; points (M + 1, k, 2)."""
    low, high = np.transpose(limits)
    unseen = int(((points < low) | (points > high)).any(axis=(1, 2)).sum())
    return f" ({nodes_in_words(unseen)} out of view)" if unseen else ""


def draw_color_bar(ax: Axes, costs: Normalize) -> None:
    """What the colours of the nodes mean, beside the axes."""
    figure = ax.get_figure()
    assert figure is not None
    figure.colorbar(
        ScalarMappable(costs, COSTS), ax=ax, label="cost of reaching a node [J]", shrink=0.85
    )
