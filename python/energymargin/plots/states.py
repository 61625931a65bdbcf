"""A state and its search tree over the workspace.

The colours tell the same without colour vision: cividis for costs, Okabe and Ito's palette for the
rest.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.spatial import ConvexHull as Hull

from energymargin._core import Body, CaptureScore, Plane, Problem, Scene
from energymargin.outlines import (
    Limits,
    Plan,
    Pose,
    axis_numbers,
    body_poses,
    placed,
    shape_parts,
    view_of,
)
from energymargin.regions import Region

__all__ = [
    "CAPTURED_COLOR",
    "COSTS",
    "LOST_COLOR",
    "SUCCEEDED_COLOR",
    "plot_state",
    "score_title",
    "state_legend",
]

COSTS = "cividis"
CAPTURED_COLOR = "#56B4E9"
SUCCEEDED_COLOR = "#8C8C8C"
BODY_COLORS = {"object": "#E69F00", "effector": "#009E73", "none": "#3A3A3A"}
LOST_COLOR = "#D55E00"
GRID = 400  # cells along the longer side of the view, for regions


def plot_state(
    problem: Problem,
    score: CaptureScore,
    ax: Axes,
    *,
    plane: Plan = ("x", "y"),
    limits: Limits | None = None,
    most: float | None = None,
    color_bar: bool = True,
    ghosts: int = 3,
    seed: int = 0,
) -> None:
    """A state and its search tree, as in the paper's qualitative figure, seen along the third axis.

    The nodes are where the object's centre got, coloured by cost [J] from 0 to `most`, with a cross
    where the node left the capture set. Capture set light blue, success set grey: where the object
    may be while all else stays. What does not depend on the place, such as a bound on a speed, is
    not filled; the crosses show it. The bodies of `ghosts` random nodes are drawn half transparent.
    `limits` are the ranges of the plane's axes [m]. Of several objects each has its dots and
    crosses, and what is filled are the sets of all.
    """
    scene, tree = problem.scene, score.tree
    limits = limits or view_of(scene, tree.states, plane)
    captured, succeeded = _sets(problem)
    _draw_region(ax, problem, succeeded, limits, plane, color=SUCCEEDED_COLOR, order=0)
    _draw_region(ax, problem, captured, limits, plane, color=CAPTURED_COLOR, order=1)
    _draw_bodies(ax, scene, problem.state, plane, limits)
    chosen = np.random.default_rng(seed).permutation(np.arange(1, len(tree.costs)))[:ghosts]
    for node in chosen:
        _draw_ghost(ax, scene, tree.states[node], plane)

    norm = Normalize(0.0, most if most is not None else max(float(tree.costs.max()), 1e-9))
    points = tree.states[:, _centers(scene, plane)]  # (M + 1, k, 2)
    edges = np.stack([points[tree.parents[1:]], points[1:]], axis=2).reshape(-1, 2, 2)
    ax.add_collection(
        LineCollection(list(edges), colors="0.25", linewidths=0.4, alpha=0.5, zorder=5)
    )
    ax.scatter(
        points[..., 0].ravel(),
        points[..., 1].ravel(),
        c=np.repeat(tree.costs, points.shape[1]),
        cmap=COSTS,
        norm=norm,
        s=9,
        linewidths=0.2,
        edgecolors="white",
        zorder=6,
    )
    outside = points[_lost(problem, tree.states)]
    ax.scatter(
        outside[:, 0], outside[:, 1], marker="x", s=9, linewidths=0.5, color=LOST_COLOR, zorder=7
    )
    ax.plot(*points[0].T, "+", color="black", markersize=7, markeredgewidth=1.2, zorder=7)

    ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    ax.set(xlabel=f"{plane[0]} [m]", ylabel=f"{plane[1]} [m]")
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.yaxis.set_major_locator(MaxNLocator(5))
    ax.set_title(score_title(score))
    if color_bar:
        figure = ax.get_figure()
        assert figure is not None
        figure.colorbar(
            ScalarMappable(norm, COSTS), ax=ax, label="cost of reaching a node [J]", shrink=0.85
        )


def score_title(score: CaptureScore) -> str:
    """The scores; with several objects those of all and of at least one, a line each."""
    lines = {"all": (score.capture, score.success), "any": (score.capture_any, score.success_any)}
    several = score.capture_any is not None or score.success_any is not None
    return "\n".join(
        (f"{which}:   " if several else "")
        + "   ".join(
            f"{name} {value:.2f}"
            for name, value in zip(("capture", "success"), values, strict=True)
            if value is not None
        )
        for which, values in lines.items()
        if values != (None, None)
    )


def state_legend(problem: Problem) -> list[Patch | Line2D]:
    """What a legend of pictures of states holds."""
    names: dict[str, list[str]] = {}
    for body in problem.scene.bodies:
        if not isinstance(body.shape, Plane):
            names.setdefault(body.role, []).append(body.name)
    handles: list[Patch | Line2D] = [
        Patch(
            color=BODY_COLORS[role],
            alpha=0.7,
            label=role if role != "none" else ", ".join(bodies),
        )
        for role, bodies in names.items()
    ]
    handles.append(Patch(color=CAPTURED_COLOR, alpha=0.4, label="capture set"))
    if problem.succeeded is not None:
        handles.append(Patch(color=SUCCEEDED_COLOR, alpha=0.4, label="success set"))
    left = "outside of the capture set"
    cross = Line2D([], [], color=LOST_COLOR, marker="x", linestyle="", markersize=4, label=left)
    return [*handles, cross]


def _draw_region(
    ax: Axes,
    problem: Problem,
    region: Region | None,
    limits: Limits,
    plane: Plan,
    *,
    color: str,
    order: int,
) -> None:
    """Fills the places of the objects' centres for which the state, else unchanged, is in it."""
    if region is None:
        return
    (x0, x1), (y0, y1) = limits
    cell = max(x1 - x0, y1 - y0) / GRID
    x = np.arange(x0 + cell / 2, x1, cell)
    y = np.arange(y0 + cell / 2, y1, cell)
    states = np.tile(problem.state, (len(x) * len(y), 1))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    for center in _centers(problem.scene, plane):
        states[:, center] = places
    inside = np.asarray(region.contains(problem.scene, states)).reshape(len(y), len(x))
    if inside.all():
        return
    ax.imshow(
        np.ma.masked_where(~inside, inside),
        cmap=ListedColormap([color]),
        extent=(x0, x0 + cell * len(x), y0, y0 + cell * len(y)),
        origin="lower",
        alpha=0.35,
        zorder=order,
        interpolation="nearest",
    )


def _draw_bodies(
    ax: Axes, scene: Scene, state: NDArray[np.float64], plane: Plan, limits: Limits
) -> None:
    """All bodies in a state; of an endless one what is in view."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if isinstance(body.shape, Plane):
            _draw_half_space(ax, body.shape, plane, limits)
        else:
            order = 2 if body.role == "none" else 3
            _draw_body(ax, body, poses[body.name], plane, alpha=0.9, order=order)
    for spring in scene.springs:
        ends = [
            placed(np.array([point]), poses[body], plane)[0]
            for body, point in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))
        ]
        ax.plot(*np.transpose(ends), ":", color=BODY_COLORS["effector"], linewidth=1.2, zorder=3)


def _draw_ghost(ax: Axes, scene: Scene, state: NDArray[np.float64], plane: Plan) -> None:
    """Object and effector as they are at a node."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if body.role != "none" and not body.fixed:
            _draw_body(ax, body, poses[body.name], plane, alpha=0.3, order=4)


def _draw_body(ax: Axes, body: Body, pose: Pose, plane: Plan, *, alpha: float, order: int) -> None:
    color = BODY_COLORS[body.role]
    for part in shape_parts(body.shape):
        corners = placed(part, pose, plane)
        outline = corners[Hull(corners).vertices]
        ax.add_patch(
            Polygon(outline, facecolor=color, alpha=0.55 * alpha, linewidth=0, zorder=order)
        )
        ax.add_patch(
            Polygon(outline, fill=False, edgecolor=color, alpha=alpha, linewidth=0.9, zorder=order)
        )


def _draw_half_space(ax: Axes, solid: Plane, plane: Plan, limits: Limits) -> None:
    """A solid below a plane that is seen from the side; seen from above it is the ground."""
    normal = np.asarray(solid.normal)[axis_numbers(plane)]
    if np.linalg.norm(normal) < 0.99:
        return
    along = np.array([-normal[1], normal[0]])
    far = 2 * float(np.abs(limits).max() + np.ptp(limits))
    surface = solid.offset * normal
    corners = [surface + far * along, surface - far * along]
    corners += [corner - far * normal for corner in reversed(corners)]
    ax.add_patch(Polygon(corners, facecolor=BODY_COLORS["none"], alpha=0.25, linewidth=0, zorder=1))


def _centers(scene: Scene, plane: Plan) -> list[list[int]]:
    """Which numbers of a state are the places of the objects' centres in the plane."""
    starts = [scene.slice(body.name).start for body in scene.bodies if body.role == "object"]
    return [[start + number for number in axis_numbers(plane)] for start in starts]


def _sets(problem: Problem) -> tuple[Region, Region | None]:
    """Capture and success set; if each object has its own, where at least one is in its own."""
    return (
        problem.captured if problem.captured_any is None else problem.captured_any,
        problem.succeeded if problem.succeeded_any is None else problem.succeeded_any,
    )


def _lost(problem: Problem, states: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which object is in no capture set in which of M states, shape (M, k).

    If there is one set for all, none of them is in it or all are.
    """
    scene, (captured, _) = problem.scene, _sets(problem)
    own = [scene.slice(body.name) for body in scene.bodies if body.role == "object"]
    lost = []
    for each in own:
        alike = states.copy()
        if problem.captured_any is not None:
            for other in own:  # with all objects where this one is, the union tells of it alone
                alike[:, other] = states[:, each]
        lost.append(~np.asarray(captured.contains(scene, alike)))
    return np.stack(lost, axis=1)
