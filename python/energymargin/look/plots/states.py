"""A state with the search tree that leaves its capture set; its title and its legend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from energymargin._core import CaptureScore, EscapeEffort, Plane, Problem, Scene
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.table_text import counted
from energymargin.look import outlines
from energymargin.look.outlines import Limits, Plan
from energymargin.look.plots import styles, trees
from energymargin.look.plots.scenes import draw_bodies, draw_ghost, draw_set, set_plane, sets_of

AROUND = 0.25  # of the view's longer side, around what moves
WIDTH = 6.0  # inch, of a figure made here
DETAIL = 400  # cells of the sets
SAME = 1e-9  # of the numbers of two states that are the same
PLANES = [(a, b) for a in "xyz" for b in "xyz" if a != b]
MOST_NAMES = 3  # of bodies without a role
VIEW = "(low, high) of two axes [m]"
Notes = tuple[str, str, str]


def plot_state(
    problem: Problem,
    result: trees.Result | None = None,
    *,
    ax: Axes | None = None,
    escape: EscapeEffort | None = None,
    plane: Plan | None = None,
    limits: Limits | None = None,
    most: float | None = None,
    path: bool = True,
    color_bar: bool = True,
    legend: bool | None = None,
    ghosts: int = 0,
    detail: int = DETAIL,
) -> Axes:
    """A state, the search tree of a result from there, and the cheapest escape on top.

    Nodes are drawn at the objects' centres, coloured by cost [J]; a cross marks a node outside of
    the capture set. The capture set is light blue with a solid edge, the success set grey with a
    dashed one: the positions of the objects for which the state, otherwise unchanged, is in the
    set. A set that does not depend on the position, such as a bound on a speed, is not filled; the
    crosses show it. Of several objects each has its nodes and crosses, and the sets are those of
    all.

    Args:
        problem: its state is drawn.
        result: its tree is drawn. None draws the state alone.
        ax: the axes. None makes a figure.
        escape: the escape to draw beside the tree of a `CaptureScore`. None takes that of the
            result: of an `EscapeEffort` its own, of a `CaptureScore` the cheapest node of its
            first tree outside of the capture set.
        plane: the two axes of the picture, such as ("x", "z"). None takes the plane across the axis
            along which nothing can move, else, of the planes in which the robot covers little of
            the objects, that of the two axes along which the objects of the tree move most, or
            along which the moving bodies are longest. `em.tasks.plane_of(task)` is a task's own.
        limits: (low, high) of both axes [m]. None shows where the bodies move; a fixed or jointed
            effector that is far from them, such as a mast, is left out.
        most: the cost at the end of the colours [J]. None takes that of the costliest node in the
            capture set or, if it is more, the effort of the escape.
        path: whether the escape is drawn, and dashed outlines of the objects that leave at its end.
        color_bar: whether costs have a colour bar.
        legend: whether there is a legend, below the axes. None draws one if `ax` is None.
            `state_legend` has its entries, for another place.
        ghosts: how many random nodes have their bodies drawn, half transparent.
        detail: cells of the sets along the view's longer side.

    Returns:
        `ax`, or the axes of a new figure.

    Raises:
        ValueError: for a result of another problem, and arguments out of range.
    """
    result, escaping = _checked(problem, result, escape)
    scene, tree = problem.scene, None if result is None else result.tree
    way = trees.escape_of(problem, escaping) if escaping is not None and path else None
    states = problem.state[np.newaxis] if tree is None else tree.states
    plane = outlines.plane_for(scene, states) if plane is None else _known(plane)
    if limits is None:
        limits = outlines.view_of(scene, _telling(problem, states, way), plane, AROUND)
    _check_looks(limits, most, ghosts, detail)
    legend = ax is None if legend is None else checks.yes_or_no("legend", legend)
    title = state_title(result, escaping, way)
    ax = styles.axes_or_new(ax, WIDTH, _height(limits, title))

    centers = outlines.object_centers(scene, states, plane)
    seen = states[trees.in_view(centers, limits).all(axis=1)]
    notes = _draw_sets(ax, problem, plane, limits, seen=seen, detail=detail)
    draw_bodies(ax, scene, problem.state, plane, limits)
    for node in np.random.default_rng(0).permutation(len(states) - 1)[:ghosts] + 1:
        draw_ghost(ax, scene, states[node], plane)
    ax.plot(*centers[0].T, "+", color="black", markersize=7, markeredgewidth=1.2, zorder=7.2)
    crosses = False
    if tree is not None:
        if most is None:
            most = trees.most_cost(problem, tree, np.inf if way is None else way.effort)
        costs, highest = Normalize(0.0, most), float(tree.costs.max())
        lost = trees.draw_tree(ax, problem, tree, plane, costs)
        crosses = bool(trees.in_view(lost, limits).any())
        if color_bar and highest > 0.0:
            trees.draw_color_bar(ax.figure, ax, costs, highest, shrink=0.85)
    if way is not None:
        trees.draw_escape(ax, problem, way, plane)

    set_plane(ax, plane, limits)
    ax.locator_params(nbins=5)
    ax.set_title(title, fontsize=10)
    if legend:
        unseen = len(states) - len(seen)
        text = f"{unseen} of {counted(len(states), 'node')} out of view" if unseen else ""
        handles = state_legend(problem, notes=(*notes, text), tree=crosses, escape=way)
        styles.draw_legend(ax, "below", handles)
    return ax


def _checked(
    problem: Problem, result: trees.Result | None, escape: EscapeEffort | None
) -> tuple[trees.Result | None, trees.Result | None]:
    """Whose tree is drawn, and whose escape; ValueError on what is not of this problem."""
    checks.check_type("problem", problem, Problem, "a Problem")
    checks.check_type("result", result, trees.Result | None, "a CaptureScore or an EscapeEffort")
    checks.check_type("escape", escape, EscapeEffort | None, "an EscapeEffort")
    expected = problem.scene.dimension
    for name, one in (("result", result), ("escape", escape)):
        states = problem.state[np.newaxis] if one is None else one.tree.states
        if states.shape[1] != expected:
            text = f"{name} is of another problem: its states have {states.shape[1]} numbers"
            raise ValueError(f"{text}, expected {expected} as in the problem's scene")
        if not np.allclose(states[0], problem.state, rtol=0.0, atol=SAME):
            text = f"{name} is of another problem: its tree does not start at the problem's state"
            raise ValueError(text)
    return result if result is not None else escape, escape if escape is not None else result


def _known(plane: Plan) -> Plan:
    if isinstance(plane, Sequence) and tuple(plane) in PLANES:
        return plane
    raise ValueError(f"plane is {plane!r}, expected two axes such as ('x', 'z')")


def _check_looks(limits: Limits, most: float | None, ghosts: int, detail: int) -> None:
    if most is not None:
        checks.positive_number("most", most)
    checks.whole_number("ghosts", ghosts, 0)
    checks.whole_number("detail", detail, 2)
    if not (np.diff(checks.numbers_of("limits", limits, VIEW, (2, 2))) > 0).all():
        raise ValueError(f"limits is {limits!r}, expected {VIEW}")


def _telling(problem: Problem, states: Floats, escape: trees.Escape | None) -> Floats:
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


def _draw_sets(
    ax: Axes, problem: Problem, plane: Plan, limits: Limits, **options: Any
) -> tuple[str, str]:
    """Success set below capture set; returns a note on each for the legend, the latter first."""
    (captured, succeeded), note = sets_of(problem), ""
    if succeeded is not None:
        look: dict[str, Any] = {"color": styles.SUCCEEDED_COLOR, "line": "dashed", "order": 0}
        note = draw_set(ax, problem, succeeded, limits, plane, **look, **options)
    look = {"color": styles.CAPTURED_COLOR, "line": "solid", "order": 1}
    return draw_set(ax, problem, captured, limits, plane, **look, **options), note


def _height(limits: Limits, title: str) -> float:
    """Height of a figure [inch], with what is around the axes."""
    (x0, x1), (y0, y1) = limits
    axes = float(np.clip(0.72 * WIDTH * (y1 - y0) / (x1 - x0), 1.5, 5.0))
    return axes + 1.4 + 0.2 * (title.count("\n") + 1)


def state_legend(
    problem: Problem,
    *,
    notes: Notes = ("", "", ""),
    tree: bool = True,
    escape: trees.Escape | EscapeEffort | None = None,
) -> list[Patch | Line2D]:
    """The entries of a legend of `plot_state`, with or without those of a tree and an escape.

    `notes` follow the names of the capture set and of the success set; the last one is an entry of
    its own.
    """
    handles: list[Patch | Line2D] = [
        Patch(color=styles.BODY_COLORS[role], alpha=0.7, label=styles.folded(label))
        for role, label in _bodies_by_role(problem.scene).items()
    ]
    handles.append(_set_patch(styles.CAPTURED_COLOR, "-", "capture set" + notes[0]))
    if problem.succeeded is not None:
        handles.append(_set_patch(styles.SUCCEEDED_COLOR, "--", "success set" + notes[1]))
    if tree:
        cross: dict[str, Any] = {"color": styles.LOST_COLOR, "marker": "x", "markersize": 4}
        handles.append(Line2D([], [], linestyle="", label="outside of the capture set", **cross))
    way = escape.path if isinstance(escape, EscapeEffort) else escape.states if escape else ()
    if len(way) > 1:
        handles.append(Line2D([], [], **trees.ESCAPE, label="cheapest escape"))
    if notes[2]:
        handles.append(Line2D([], [], linestyle="", label=notes[2]))
    return handles


def score_title(score: CaptureScore) -> str:
    """The scores; with several objects those of all and of at least one, a line each."""
    several = score.capture_any is not None or score.success_any is not None
    lines = []
    for which, end in {"all": "", "any": "_any"}.items():
        values = {name: getattr(score, name + end) for name in ("capture", "success")}
        words = [f"{name} {value:.2f}" for name, value in values.items() if value is not None]
        lines += ["   ".join([f"{which}:"] * several + words)] if words else []
    return "\n".join(lines)


def state_title(
    result: trees.Result | None, escaping: trees.Result | None, escape: trees.Escape | None
) -> str:
    """The scores of a capture score, and what is known of the escape."""
    lines = []
    if isinstance(result, CaptureScore):
        lines.append(score_title(result) + _unfinished(result))
    if escaping is not None and (escape is not None or not lines):
        known = _unfinished(escaping) if isinstance(escaping, EscapeEffort) else ""
        lines.append(trees.escape_in_words(escaping, escape) + known)
    return "\n".join(lines)


def _bodies_by_role(scene: Scene) -> dict[str, str]:
    """The names of the bodies that are drawn, by role."""
    drawn = [body for body in scene.bodies if not isinstance(body.shape, Plane)]
    labels = {body.role: str(body.role) for body in drawn}
    if sum(body.role == "object" for body in drawn) > 1:
        labels["object"] = "objects"
    if "none" in labels:
        names = [body.name for body in drawn if body.role == "none"]
        labels["none"] = ", ".join(names[:MOST_NAMES]) + ", ..." * (len(names) > MOST_NAMES)
    return labels


def _set_patch(color: str, line: Literal["-", "--"], label: str) -> Patch:
    face, edge = to_rgba(color, 0.35), to_rgba(color)
    return Patch(facecolor=face, edgecolor=edge, linestyle=line, linewidth=0.9, label=label)


def _unfinished(result: trees.Result) -> str:
    return "" if result.complete else "   (not complete)"
