"""A scene in a plane: its bodies in a state, and its capture and success set."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from energymargin._core import Body, Plane, Problem, Scene
from energymargin.futures import Undisturbed
from energymargin.outlines import (
    Limits,
    Plan,
    Pose,
    axis_numbers,
    body_poses,
    object_centers,
    outlines_of,
    placed,
)
from energymargin.plots.styles import BODY_COLORS, LOST_COLOR
from energymargin.regions import Region

BLOCK = 2**21  # numbers of states in memory at once


def draw_bodies(
    ax: Axes, scene: Scene, state: NDArray[np.float64], plane: Plan, limits: Limits
) -> None:
    """All bodies in a state, with springs and joints; of an endless body what is in view."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if isinstance(body.shape, Plane):
            _draw_half_space(ax, body.shape, plane, limits)
        else:
            order = {"none": 2, "effector": 3, "object": 3.5}[body.role]
            _draw_body(ax, body, poses[body.name], plane, alpha=0.9, order=order)
    _draw_springs(ax, scene, poses, plane)
    _draw_joints(ax, scene, poses, plane)


def set_plane(ax: Axes, plane: Plan, limits: Limits) -> None:
    """The names and limits of axes that show a plane."""
    ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    ax.set(xlabel=f"{plane[0]} [m]", ylabel=f"{plane[1]} [m]")


def draw_ghost(ax: Axes, scene: Scene, state: NDArray[np.float64], plane: Plan) -> None:
    """Object and effector as they are in another state."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if body.role != "none" and not body.fixed:
            _draw_body(ax, body, poses[body.name], plane, alpha=0.3, order=4)


def draw_lost(
    ax: Axes, scene: Scene, state: NDArray[np.float64], plane: Plan, names: Collection[str]
) -> None:
    """The outlines of the objects of these names where they have left the capture set."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if body.name in names:
            for outline in outlines_of(body.shape, poses[body.name], plane):
                ax.add_patch(
                    Polygon(
                        outline,
                        fill=False,
                        edgecolor=LOST_COLOR,
                        linewidth=1.2,
                        linestyle=(0, (3, 1.5)),
                        zorder=7.5,
                        gid="lost",
                    )
                )


def _draw_body(
    ax: Axes, body: Body, pose: Pose, plane: Plan, *, alpha: float, order: float
) -> None:
    color = BODY_COLORS[body.role]
    for outline in outlines_of(body.shape, pose, plane):
        ax.add_patch(
            Polygon(outline, facecolor=color, alpha=0.55 * alpha, linewidth=0, zorder=order)
        )
        ax.add_patch(
            Polygon(outline, fill=False, edgecolor=color, alpha=alpha, linewidth=0.9, zorder=order)
        )


def _draw_springs(ax: Axes, scene: Scene, poses: dict[str, Pose], plane: Plan) -> None:
    for spring in scene.springs:
        ends = [
            placed(np.array([point]), poses[body], plane)[0]
            for body, point in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))
        ]
        ax.plot(*np.transpose(ends), ":", color=BODY_COLORS["effector"], linewidth=1.2, zorder=3)


def _draw_joints(ax: Axes, scene: Scene, poses: dict[str, Pose], plane: Plan) -> None:
    """A small ring where a joint is; a fixed one has nothing to show."""
    places = [
        placed(np.array([joint.origin]), poses[joint.parent], plane)[0]
        for joint in scene.joints
        if joint.type != "fixed"
    ]
    if places:
        ax.plot(
            *np.transpose(places),
            "o",
            markersize=2.5,
            markerfacecolor="white",
            markeredgecolor=BODY_COLORS["effector"],
            markeredgewidth=0.6,
            zorder=3.2,
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

    The view's longer side has `detail` cells. A set that covers the whole view, or none of it, is
    not filled, such as one that does not depend on the position. Returns a note for the legend:
    none, or that the set is all of the view or not in it, if that holds for the states in view,
    `seen`, shape (M, n), too.
    """
    (x0, x1), (y0, y1) = limits
    cell = max(x1 - x0, y1 - y0) / detail
    wide, high = min(cell, (x1 - x0) / 2), min(cell, (y1 - y0) / 2)  # an edge needs two cells
    x = np.arange(x0 + wide / 2, x1, wide)
    y = np.arange(y0 + high / 2, y1, high)
    inside = _inside_at(problem, region, plane, x, y)
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

    With one set for all objects, all of them are in it or none is. Where the sets of single objects
    are not known, as in a problem file with arbitrary sets of all and of any, all objects are
    outside once the state is outside of the set of any.
    """
    objects = [body.name for body in problem.scene.bodies if body.role == "object"]
    of_each = problem.captured_by_object or dict.fromkeys(objects, sets_of(problem)[0])
    inside = [of_each[name].contains(problem.scene, states) for name in objects]
    return ~np.stack([np.asarray(captured) for captured in inside], axis=1)


def leaving_objects(problem: Problem, future: Undisturbed) -> NDArray[np.bool_]:
    """Which objects are outside when an undisturbed future leaves, shape (k,): all of them, if the
    sets of single objects are not known; none without an exit."""
    moment = future.exit_moment
    if moment is None:
        return np.zeros(sum(body.role == "object" for body in problem.scene.bodies), dtype=bool)
    lost = lost_objects(problem, future.states[[moment]])[0]
    return lost if lost.any() else np.ones_like(lost)


def _inside_at(
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
