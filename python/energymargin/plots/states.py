"""A state, and the search tree that breaks out of its capture set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from energymargin._core import EscapeEffort, Problem, Tree
from energymargin.checks import positive_number, whole_number, yes_or_no
from energymargin.outlines import Limits, Plan, object_centers, plane_for, view_of
from energymargin.plots.bodies import draw_bodies, draw_ghost
from energymargin.plots.legends import draw_state_legend, state_legend, state_title
from energymargin.plots.sets import draw_set, sets_of
from energymargin.plots.styles import (
    CAPTURED_COLOR,
    SUCCEEDED_COLOR,
    axes_or_new,
    nodes_in_words,
)
from energymargin.plots.trees import (
    Escape,
    Result,
    draw_color_bar,
    draw_escape,
    draw_tree,
    escape_of,
    in_view,
    most_cost,
)
from energymargin.regions import Region

__all__ = ["plot_state"]

AROUND = 0.25  # of the view's longer side, around what moves
WIDTH = 6.0  # inch, of a figure made here
DETAIL = 400  # cells of the sets
SAME = 1e-9  # of the numbers of two states that are the same
PLANES = [(a, b) for a in "xyz" for b in "xyz" if a != b]


def plot_state(
    problem: Problem,
    result: Result | None = None,
    ax: Axes | None = None,
    *,
    escape: EscapeEffort | None = None,
    plane: Plan | None = None,
    limits: Limits | None = None,
    most: float | None = None,
    path: bool = True,
    color_bar: bool = True,
    legend: bool | None = None,
    ghosts: int = 0,
    seed: int = 0,
    detail: int = DETAIL,
) -> Axes:
    """A state, the search tree of a result from there, and the cheapest escape on top.

    The nodes are where the objects' centres got, coloured by cost [J] from 0 to `most`, with a
    cross where a node left the capture set. `most=None` takes the cost of the costliest node in the
    capture set, or the effort of the escape if that is more; other nodes may cost more. Capture set
    light blue with a solid edge, success set grey with a dashed one: where the objects may be while
    all else stays as in the state. What does not depend on the place, such as a bound on a speed,
    is not filled; the crosses show it. Of several objects each has its dots and crosses, and what
    is filled are the sets of all.

    The escape is that of an `EscapeEffort`, given as result or, beside a `CaptureScore`, as
    `escape`; else it is the cheapest node of the capture score's first tree outside of the capture
    set. Its end is drawn as the dashed outlines of the objects that have left. `path=False` leaves
    it away. With neither, the state alone is drawn.

    `plane` is looked at along the third axis. None takes the one across the axis along which
    nothing can move, else the two axes along which the objects of the tree get about most, or along
    which the moving bodies are longest; a task's own is `tasks.base.plane_of(task)`. `limits` are
    the ranges of the plane's axes [m]. `legend` is below; None draws one if there is no `ax`, and
    `state_legend` has what it shows, for another place. The bodies of `ghosts` random nodes are
    drawn half transparent, chosen by `seed`. `detail` is how many cells the sets have along the
    view's longer side.

    Returns `ax`, or the axes of a new figure. Raises ValueError on a result of another problem.
    """
    result, escaping = _checked(problem, result, escape)
    way = escape_of(problem, escaping) if escaping is not None and path else None
    view = _view(problem, None if result is None else result.tree, way, plane, limits)
    _check_looks(view.limits, most, ghosts, seed, detail)
    legend = ax is None if legend is None else yes_or_no("legend", legend)
    title = state_title(result, escaping, way)
    own_figure = ax is None
    ax = axes_or_new(ax, WIDTH, _height(view.limits, title))

    costs = Normalize(0.0, view.most_cost if most is None else most)
    notes = _draw_sets(ax, view, detail)
    draw_bodies(ax, problem.scene, problem.state, view.plane, view.limits)
    for node in _some(len(view.states), ghosts, seed):
        draw_ghost(ax, problem.scene, view.states[node], view.plane)
    crosses = _draw_tree(ax, view, costs)
    if way is not None:
        draw_escape(ax, problem, way, view.plane)
    _draw_centers(ax, view)
    _name_axes(ax, view)
    ax.set_title(title, fontsize=10)
    if legend:
        handles = state_legend(problem, (*notes, view.unseen), tree=crosses, escape=way)
        draw_state_legend(ax, handles, own_figure=own_figure)
    if color_bar and view.tree is not None:
        _draw_color_bar(ax, view.tree, costs)
    return ax


@dataclass(frozen=True)
class _View:
    """What of a problem is seen, and where."""

    problem: Problem
    tree: Tree | None
    escape: Escape | None
    plane: Plan
    limits: Limits

    @cached_property
    def states(self) -> NDArray[np.float64]:
        """The state, or those of the tree's nodes, shape (M, n)."""
        return _states(self.problem, self.tree)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each state has all its objects' centres within the limits, shape (M,)."""
        centers = self.states[:, object_centers(self.problem.scene, self.plane)]
        return np.asarray(np.all(in_view(centers, self.limits), axis=1))

    @property
    def unseen(self) -> str:
        """What a legend says of the nodes that are not in view; the root is one of them."""
        nodes = len(self.states)
        unseen = nodes - int(self.inside.sum())
        return f"{unseen} of {nodes_in_words(nodes)} out of view" if unseen else ""

    @property
    def most_cost(self) -> float:
        """The cost [J] at the end of the colours: of what is in the capture set, and of the way
        out."""
        if self.tree is None:
            return 0.0
        most = most_cost(self.problem, self.tree)
        way = self.escape
        return max(most, way.effort) if way is not None and len(way.states) else most


def _view(
    problem: Problem,
    tree: Tree | None,
    escape: Escape | None,
    plane: Plan | None,
    limits: Limits | None,
) -> _View:
    """Plane and limits are chosen where they are not given."""
    states = _states(problem, tree)
    plane = plane_for(problem.scene, states) if plane is None else _known(plane)
    if limits is None:
        limits = view_of(problem.scene, _telling(problem, states, escape), plane, AROUND)
    return _View(problem, tree, escape, plane, limits)


def _states(problem: Problem, tree: Tree | None) -> NDArray[np.float64]:
    return problem.state[np.newaxis] if tree is None else tree.states


def _checked(
    problem: Problem, result: Result | None, escape: EscapeEffort | None
) -> tuple[Result | None, Result | None]:
    """Whose tree is drawn, and whose escape; ValueError on what is not of this problem."""
    if not isinstance(problem, Problem):
        raise ValueError(f"problem is {problem!r}, expected a Problem")
    if not (result is None or isinstance(result, Result)):
        raise ValueError(f"result is {result!r}, expected a CaptureScore or an EscapeEffort")
    if not (escape is None or isinstance(escape, EscapeEffort)):
        raise ValueError(f"escape is {escape!r}, expected an EscapeEffort")
    for name, one in (("result", result), ("escape", escape)):
        if one is not None:
            _check_start(name, one.tree, problem)
    return result if result is not None else escape, escape if escape is not None else result


def _check_start(name: str, tree: Tree, problem: Problem) -> None:
    width, expected = tree.states.shape[1], problem.scene.dimension
    if width != expected:
        raise ValueError(
            f"{name} is of another problem: its states have {width} numbers, "
            f"expected {expected} as in the problem's scene"
        )
    if not np.allclose(tree.states[0], problem.state, rtol=0.0, atol=SAME):
        raise ValueError(
            f"{name} is of another problem: its tree does not start at the problem's state"
        )


def _known(plane: Plan) -> Plan:
    if isinstance(plane, Sequence) and tuple(plane) in PLANES:
        return plane
    raise ValueError(f"plane is {plane!r}, expected two axes such as ('x', 'z')")


def _check_looks(limits: Limits, most: float | None, ghosts: int, seed: int, detail: int) -> None:
    if most is not None:
        positive_number("most", most)
    whole_number("ghosts", ghosts, 0)
    whole_number("seed", seed, 0)
    whole_number("detail", detail, 2)
    try:
        view = np.asarray(limits, dtype=float)
    except (TypeError, ValueError):
        view = np.empty(0)
    if view.shape != (2, 2) or not np.isfinite(view).all() or not (np.diff(view) > 0).all():
        raise ValueError(f"limits is {limits!r}, expected (low, high) of two axes [m]")


def _telling(
    problem: Problem, states: NDArray[np.float64], escape: Escape | None
) -> NDArray[np.float64]:
    """Those that a view has to show: the start, where a body gets farthest, and the escape.

    What is lost may fall far away: if the start is not, what counts are nodes that are not either.
    """
    scene = problem.scene
    captured = np.asarray(problem.captured.contains(scene, states))
    near = states[captured] if captured[0] else states
    links = {joint.child for joint in scene.joints}
    rows = {0}
    for body in scene.bodies:
        if body.role != "none" and not body.fixed and body.name not in links:
            place = near[:, scene.slice(body.name)][:, :3]
            rows |= {*place.argmin(axis=0).tolist(), *place.argmax(axis=0).tolist()}
    telling = near[sorted(rows)]
    return telling if escape is None else np.concatenate([telling, escape.states])


def _draw_sets(ax: Axes, view: _View, detail: int) -> tuple[str, str]:
    """Success set below capture set; returns what a legend says of where capture and success set
    are."""
    captured, succeeded = sets_of(view.problem)
    shown: dict[str, Any] = {"detail": detail, "seen": view.states[view.inside]}

    def draw(region: Region | None, **look: Any) -> str:
        if region is None:
            return ""
        return draw_set(ax, view.problem, region, view.limits, view.plane, **look, **shown)

    of_succeeded = draw(succeeded, color=SUCCEEDED_COLOR, line="dashed", order=0)
    of_captured = draw(captured, color=CAPTURED_COLOR, line="solid", order=1)
    return of_captured, of_succeeded


def _draw_tree(ax: Axes, view: _View, costs: Normalize) -> bool:
    """Returns whether a cross is in view."""
    if view.tree is None:
        return False
    lost = draw_tree(ax, view.problem, view.tree, view.plane, costs)
    return bool(in_view(lost, view.limits).any())


def _draw_color_bar(ax: Axes, tree: Tree, costs: Normalize) -> None:
    """None of a tree without costs."""
    highest = tree.costs.max()
    if highest > 0.0:
        draw_color_bar(ax.figure, ax, costs, highest, shrink=0.85)


def _some(nodes: int, number: int, seed: int) -> list[int]:
    """Rows of random nodes, without the root."""
    return [int(row) for row in np.random.default_rng(seed).permutation(nodes - 1)[:number] + 1]


def _draw_centers(ax: Axes, view: _View) -> None:
    """Where the objects are."""
    problem = view.problem
    starts = problem.state[object_centers(problem.scene, view.plane)]
    ax.plot(*starts.T, "+", color="black", markersize=7, markeredgewidth=1.2, zorder=7)


def _name_axes(ax: Axes, view: _View) -> None:
    ax.set(xlim=view.limits[0], ylim=view.limits[1], aspect="equal")
    ax.set(xlabel=f"{view.plane[0]} [m]", ylabel=f"{view.plane[1]} [m]")
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.yaxis.set_major_locator(MaxNLocator(5))


def _height(limits: Limits, title: str) -> float:
    """Of a figure [inch], with what is around the axes."""
    (x0, x1), (y0, y1) = limits
    axes = float(np.clip(0.72 * WIDTH * (y1 - y0) / (x1 - x0), 1.5, 5.0))
    return axes + 1.4 + 0.2 * (title.count("\n") + 1)
