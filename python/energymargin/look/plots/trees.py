"""A search tree in a plane, and its cheapest escape from the capture set."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from energymargin._core import CaptureScore, EscapeEffort, Problem, Tree
from energymargin.base.aliases import Floats, Mask
from energymargin.base.table_text import counted
from energymargin.look.outlines import Limits, Plan, object_centers
from energymargin.look.plots.scenes import draw_lost, lost_objects, sets_of
from energymargin.look.plots.styles import COSTS, LOST_COLOR

LEAST = 1e-9  # J, at the end of a colour bar
ESCAPE: dict[str, Any] = {  # a thick line over all, with a square where the object is lost
    **{"color": "black", "linewidth": 1.8, "zorder": 8, "gid": "escape"},
    **{"marker": "s", "markersize": 6, "markevery": [-1], "markerfacecolor": LOST_COLOR},
    **{"markeredgecolor": "white", "markeredgewidth": 0.8},
    "path_effects": [patheffects.Stroke(linewidth=3.4, foreground="white"), patheffects.Normal()],
}

Result = CaptureScore | EscapeEffort


def draw_tree(ax: Axes, problem: Problem, tree: Tree, plane: Plan, costs: Normalize) -> Floats:
    """Edges, nodes by cost, and a cross at each object that is lost; where these are, (N, 2)."""
    points = object_centers(problem.scene, tree.states, plane)
    edges = np.stack([points[tree.parents[1:]], points[1:]], axis=2).reshape(-1, 2, 2)
    lines = LineCollection(list(edges), colors="0.25", linewidths=0.4, alpha=0.5, zorder=5)
    ax.add_collection(lines)
    (x, y), costs_each = points.reshape(-1, 2).T, np.repeat(tree.costs, points.shape[1])
    look: dict[str, Any] = {"cmap": COSTS, "norm": costs, "linewidths": 0.2, "edgecolors": "white"}
    ax.scatter(x, y, c=costs_each, s=9, **look, zorder=6, gid="nodes")
    outside = points[lost_objects(problem, tree.states)]
    look = {"marker": "x", "linewidths": 0.5, "color": LOST_COLOR}
    ax.scatter(outside[:, 0], outside[:, 1], s=9, **look, zorder=7, gid="outside")
    return outside


def in_view(points: Floats, limits: Limits) -> Mask:
    """Which points, shape (..., 2), are in the view, shape (...)."""
    low, high = np.transpose(limits)
    return np.asarray(((points >= low) & (points <= high)).all(axis=-1))


def most_cost(problem: Problem, tree: Tree, effort: float = 0.0) -> float:
    """The highest cost of a node in the capture set [J], or a finite effort of an escape if it is
    more; nodes outside may cost much more."""
    captured, _ = sets_of(problem)
    inside = np.asarray(captured.contains(problem.scene, tree.states))
    costs = tree.costs[inside] if inside.any() else tree.costs
    return max(LEAST, float(costs.max()), effort if math.isfinite(effort) else 0.0)


def draw_color_bar(
    figure: Figure | SubFigure, axes: Any, costs: Normalize, most: float, **options: Any
) -> None:
    """What the nodes' colours mean, beside the axes; open if the costliest, `most`, is beyond."""
    options |= {"ax": axes, "extend": "max" if most > (costs.vmax or 0.0) else "neither"}
    figure.colorbar(ScalarMappable(costs, COSTS), label="cost of reaching a node [J]", **options)


class Escape(NamedTuple):
    """A way out of the capture set."""

    states: Floats
    """From the start to the first state outside, shape (P, n); P is 0 if none was found."""
    effort: float
    """[J]; inf if none was found."""


def escape_of(problem: Problem, result: Result) -> Escape:
    """The escape of an effort or, of a capture score, its first tree's cheapest node outside."""
    tree = result.tree
    if isinstance(result, EscapeEffort):
        return Escape(tree.states[result.path], result.effort)
    outside = ~np.asarray(problem.captured.contains(problem.scene, tree.states))
    if not outside.any():
        return Escape(tree.states[:0], float("inf"))
    cheapest = int(np.where(outside, tree.costs, np.inf).argmin())
    return Escape(tree.states[tree.path_to(cheapest)], float(tree.costs[cheapest]))


def escape_in_words(of: Result, escape: Escape | None = None) -> str:
    """The effort, for a title; also that there is no escape, or nothing to escape from."""
    effort = of.effort if isinstance(of, EscapeEffort) else escape.effort if escape else math.inf
    if math.isinf(effort):
        return f"no escape found with {counted(of.nodes, 'node')}"
    if escape is not None and len(escape.states) == 1:
        return "the start is outside of the capture set"
    kind = "effort of escape" if isinstance(of, EscapeEffort) else "cheapest escape of the tree"
    return f"{kind} {effort:.3g} J" + (", by itself" if effort == 0.0 else "")


def draw_escape(ax: Axes, problem: Problem, escape: Escape, plane: Plan) -> None:
    """The way of each object that has left at its end, and its outline there."""
    if not len(escape.states):
        return
    scene = problem.scene
    names = [body.name for body in scene.bodies if body.role == "object"]
    lost = lost_objects(problem, escape.states[-1:])[0]
    gone = [number for number in range(len(names)) if lost[number] or not lost.any()]
    draw_lost(ax, scene, escape.states[-1], plane, {names[number] for number in gone})
    centers = object_centers(scene, escape.states, plane)
    for number in gone:
        ax.add_line(Line2D(*centers[:, number].T, **ESCAPE, label="_nolegend_"))
