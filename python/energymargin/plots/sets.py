"""Capture and success sets in a plane: the places of an object, while all else stays, in them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from energymargin._core import Problem
from energymargin.outlines import Limits, Plan, object_centers
from energymargin.regions import Region
from energymargin.undisturbed import Undisturbed

__all__ = ["draw_set", "leaving_objects", "lost_objects", "sets_of"]

BLOCK = 2**21  # numbers of states in memory at once


def sets_of(problem: Problem) -> tuple[Region, Region | None]:
    """Capture and success set; if each object has its own, where at least one is in its own."""
    return (
        problem.captured if problem.captured_any is None else problem.captured_any,
        problem.succeeded if problem.succeeded_any is None else problem.succeeded_any,
    )


def draw_set(
    ax: Axes,
    problem: Problem,
    region: Region,
    limits: Limits,
    plane: Plan,
    *,
    color: str,
    line: str,
    order: int,
    detail: int,
    seen: NDArray[np.float64],
) -> str:
    """Fills the places of the objects' centres for which the state, else unchanged, is in it.

    The view's longer side has `detail` cells. What covers the whole view, as a set that does not
    depend on the place, is not filled. Returns what a legend says of that: nothing, or that it is
    everywhere or nowhere in view, if so are the states that are `seen` there, shape (M, n).
    """
    (x0, x1), (y0, y1) = limits
    cell = max(x1 - x0, y1 - y0) / detail
    wide, high = min(cell, (x1 - x0) / 2), min(cell, (y1 - y0) / 2)  # an edge needs two cells
    x = np.arange(x0 + wide / 2, x1, wide)
    y = np.arange(y0 + high / 2, y1, high)
    inside = _inside(problem, region, plane, x, y)
    if inside.all() or not inside.any():
        return _in_words(problem, region, everywhere=bool(inside.all()), seen=seen)
    ax.imshow(
        np.ma.masked_where(~inside, inside),
        cmap=ListedColormap([color]),
        extent=(x0, x0 + wide * len(x), y0, y0 + high * len(y)),
        origin="lower",
        alpha=0.35,
        zorder=order,
        interpolation="nearest",
    )
    edge = gaussian_filter(inside.astype(float), 1.0)  # cells; without it a slope has steps
    ax.contour(
        x, y, edge, levels=[0.5], colors=[color], linewidths=0.9, linestyles=line, zorder=order
    )
    return ""


def _in_words(
    problem: Problem, region: Region, *, everywhere: bool, seen: NDArray[np.float64]
) -> str:
    """Where a set is that has no edge in view; states in view may be in it, or not, by what else
    they are."""
    if (np.asarray(region.contains(problem.scene, seen)) != everywhere).any():
        return " (not by place alone: not drawn)"
    return " (all of the view)" if everywhere else " (nowhere in view)"


def lost_objects(problem: Problem, states: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which object is outside of its capture set in which of M states, shape (M, k).

    Where there is one set for all objects, all of them are in it or none is. Where their sets
    cannot be told apart, as in a file with any sets of all and of any, all are lost once the state
    is in no set of any.
    """
    objects = [body.name for body in problem.scene.bodies if body.role == "object"]
    of_each = problem.captured_by_object or dict.fromkeys(objects, sets_of(problem)[0])
    inside = [of_each[name].contains(problem.scene, states) for name in objects]
    return ~np.stack([np.asarray(captured) for captured in inside], axis=1)


def leaving_objects(problem: Problem, future: Undisturbed) -> NDArray[np.bool_]:
    """Which objects are outside where an undisturbed future leaves, shape (k,): all, if that cannot
    be told; none without an exit."""
    moment = future.exit_moment
    if moment is None:
        return np.zeros(sum(body.role == "object" for body in problem.scene.bodies), dtype=bool)
    lost = lost_objects(problem, future.states[[moment]])[0]
    return lost if lost.any() else np.ones_like(lost)


def _inside(
    problem: Problem,
    region: Region,
    plane: Plan,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Whether the objects' centres may be at (x[j], y[i]), shape (len(y), len(x))."""
    scene, centers = problem.scene, object_centers(problem.scene, plane)
    rows = max(1, BLOCK // (len(x) * scene.dimension))
    blocks = []
    for first in range(0, len(y), rows):
        places = np.stack(np.meshgrid(x, y[first : first + rows]), axis=-1).reshape(-1, 2)
        states = np.tile(problem.state, (len(places), 1))
        for center in centers:
            states[:, center] = places
        blocks.append(np.asarray(region.contains(scene, states)).reshape(-1, len(x)))
    return np.concatenate(blocks)
