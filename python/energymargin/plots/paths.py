"""The cheapest way out of the capture set that a search has found."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from energymargin._core import CaptureScore, EscapeEffort, Problem
from energymargin.outlines import Plan, object_centers
from energymargin.plots.bodies import draw_lost
from energymargin.plots.sets import lost_objects
from energymargin.plots.styles import LOST_COLOR, joules, nodes_in_words

__all__ = ["Escape", "Result", "draw_escape", "escape_in_words", "escape_line", "escape_of"]


Result = CaptureScore | EscapeEffort


class Escape(NamedTuple):
    """A way out of the capture set."""

    states: NDArray[np.float64]
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
        return f"no escape found with {nodes_in_words(of.nodes)}"
    if escape is not None and len(escape.states) == 1:
        return "the start is outside of the capture set"
    kind = "effort of escape" if isinstance(of, EscapeEffort) else "cheapest escape of the tree"
    return f"{kind} {joules(effort)}" + (", by itself" if effort == 0.0 else "")


def draw_escape(ax: Axes, problem: Problem, escape: Escape, plane: Plan) -> None:
    """The way of each object that has left at its end, and its outline there."""
    if not len(escape.states):
        return
    scene = problem.scene
    names = [body.name for body in scene.bodies if body.role == "object"]
    lost = lost_objects(problem, escape.states[-1:])[0]
    gone = [number for number in range(len(names)) if lost[number] or not lost.any()]
    draw_lost(ax, scene, escape.states[-1], plane, {names[number] for number in gone})
    centers = object_centers(scene, plane)
    for number in gone:
        line = escape_line("_nolegend_")
        line.set_data(*escape.states[:, centers[number]].T)
        ax.add_line(line)


def escape_line(label: str) -> Line2D:
    """A thick black line over all, with a square where the object is lost at its end; yet empty."""
    around = [patheffects.Stroke(linewidth=3.4, foreground="white"), patheffects.Normal()]
    return Line2D(
        [],
        [],
        color="black",
        linewidth=1.8,
        marker="s",
        markersize=6,
        markevery=[-1],
        markerfacecolor=LOST_COLOR,
        markeredgecolor="white",
        markeredgewidth=0.8,
        path_effects=around,
        label=label,
        zorder=8,
        gid="escape",
    )
