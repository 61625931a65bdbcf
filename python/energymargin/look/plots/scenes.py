"""A scene in a plane: its bodies in a state, and its capture and success set."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgba
from matplotlib.patches import Polygon
from scipy.ndimage import gaussian_filter

from energymargin._core import Plane, Problem, Scene
from energymargin.base.aliases import Floats, Mask
from energymargin.evaluate.futures import Undisturbed
from energymargin.look import outlines
from energymargin.look.outlines import Limits, Plan
from energymargin.look.plots.styles import BODY_COLORS, LOST_COLOR
from energymargin.model.scenes import body_poses
from energymargin.regions import Region

ORDERS = {"none": 2, "effector": 3, "object": 3.5}  # of roles, from the back
BLOCK = 2**21  # numbers of states in memory at once
RING: dict[str, Any] = {"markersize": 2.5, "markerfacecolor": "white", "markeredgewidth": 0.6}
LOST: dict[str, Any] = {"fill": False, "edgecolor": LOST_COLOR, "linewidth": 1.2, "zorder": 7.5}
"""The looks of a joint, and of an object that has left."""


def draw_bodies(ax: Axes, scene: Scene, state: Floats, plane: Plan, limits: Limits) -> None:
    """All bodies in a state, with springs and joints; of an endless body what is in view."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if isinstance(body.shape, Plane):
            _draw_half_space(ax, body.shape, plane, limits)
    for role, order in ORDERS.items():
        names = {body.name for body in scene.bodies if body.role == role}
        draw_outlines(ax, scene, state, plane, names, **_solid(role, 0.9), zorder=order)
    color = BODY_COLORS["effector"]
    for ends in outlines.spring_ends(scene, poses)[..., outlines.axis_numbers(plane)]:
        ax.plot(*ends.T, ":", color=color, linewidth=1.2, zorder=3)
    for joint in scene.joints:
        if joint.type != "fixed":
            place = outlines.placed(np.array([joint.origin]), poses[joint.parent], plane)[0]
            ax.plot(*place, "o", color=color, zorder=3.2, **RING)


def set_plane(ax: Axes, plane: Plan, limits: Limits) -> None:
    """The names and limits of axes that show a plane."""
    ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    ax.set(xlabel=f"{plane[0]} [m]", ylabel=f"{plane[1]} [m]")


def draw_ghost(ax: Axes, scene: Scene, state: Floats, plane: Plan) -> None:
    """Object and effector as they are in another state."""
    for role in ("effector", "object"):
        names = {body.name for body in scene.bodies if body.role == role and not body.fixed}
        draw_outlines(ax, scene, state, plane, names, **_solid(role, 0.3), zorder=4)


def draw_lost(ax: Axes, scene: Scene, state: Floats, plane: Plan, names: Collection[str]) -> None:
    """The outlines of the objects of these names where they have left the capture set."""
    draw_outlines(ax, scene, state, plane, names, gid="lost", linestyle=(0, (3, 1.5)), **LOST)


def draw_outlines(
    ax: Axes, scene: Scene, state: Floats, plane: Plan, names: Collection[str], **look: Any
) -> None:
    """The bodies of these names as polygons that look so, without those that are endless."""
    poses = body_poses(scene, state)
    for body in scene.bodies:
        if body.name in names and not isinstance(body.shape, Plane):
            for outline in outlines.outlines_of(body.shape, poses[body.name], plane):
                ax.add_patch(Polygon(outline, **look))


def _solid(role: str, alpha: float) -> dict[str, Any]:
    """The look of a body, half transparent within its edge."""
    color = BODY_COLORS[role]
    faces = {"facecolor": to_rgba(color, 0.55 * alpha), "edgecolor": to_rgba(color, alpha)}
    return {**faces, "linewidth": 0.9}


def _draw_half_space(ax: Axes, solid: Plane, plane: Plan, limits: Limits) -> None:
    """A solid below a plane that is seen from the side; seen from above it is the ground."""
    normal = np.asarray(solid.normal)[outlines.axis_numbers(plane)]
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
    captured = problem.captured if problem.captured_any is None else problem.captured_any
    return captured, problem.succeeded if problem.succeeded_any is None else problem.succeeded_any


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
    seen: Floats,
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
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = inside_at(problem, region, places, plane).reshape(len(y), len(x))
    if inside.all() or not inside.any():
        if (np.asarray(region.contains(problem.scene, seen)) != inside.all()).any():
            return " (not by place alone: not drawn)"
        return " (all of the view)" if inside.all() else " (nowhere in view)"
    extent = (x0, x0 + wide * len(x), y0, y0 + high * len(y))
    fill: dict[str, Any] = {"origin": "lower", "alpha": 0.35, "interpolation": "nearest"}
    fill |= {"cmap": ListedColormap([color]), "zorder": order}
    ax.imshow(np.ma.masked_where(~inside, inside), extent=extent, **fill)
    edge = gaussian_filter(inside.astype(float), 1.0)  # cells; without it a slope has steps
    border: dict[str, Any] = {"colors": [color], "linewidths": 0.9, "linestyles": line}
    ax.contour(x, y, edge, levels=[0.5], zorder=order, **border)
    return ""


def lost_objects(problem: Problem, states: Floats) -> Mask:
    """Which object is outside of its capture set in which of M states, shape (M, k).

    With one set for all objects, all of them are in it or none is. Where the sets of single objects
    are not known, as in a problem file with arbitrary sets of all and of any, all objects are
    outside once the state is outside of the set of any.
    """
    objects = [body.name for body in problem.scene.bodies if body.role == "object"]
    of_each = problem.captured_by_object or dict.fromkeys(objects, sets_of(problem)[0])
    inside = [of_each[name].contains(problem.scene, states) for name in objects]
    return ~np.stack([np.asarray(captured) for captured in inside], axis=1)


def leaving_objects(problem: Problem, future: Undisturbed) -> Mask:
    """Which objects are outside when an undisturbed future leaves, shape (k,): all of them, if the
    sets of single objects are not known; none without an exit."""
    moment = future.exit_moment
    if moment is None:
        return np.zeros(sum(body.role == "object" for body in problem.scene.bodies), dtype=bool)
    lost = lost_objects(problem, future.states[[moment]])[0]
    return lost if lost.any() else np.ones_like(lost)


def inside_at(problem: Problem, region: Region, places: Floats, axes: Sequence[str]) -> Mask:
    """Whether the state, else unchanged, is in a set with the objects' centres at each of N places
    along some axes, shape (N, len(axes)); shape (N,). Nowhere if one is on a joint."""
    scene, blocks = problem.scene, []
    objects = {body.name for body in scene.bodies if body.role == "object"}
    if objects & {joint.child for joint in scene.joints}:
        return np.zeros(len(places), dtype=bool)
    columns = [scene.slice(name).start + np.array(outlines.axis_numbers(axes)) for name in objects]
    for some in np.array_split(places, 1 + places.shape[0] * problem.scene.dimension // BLOCK):
        states = np.tile(problem.state, (len(some), 1))
        for column in columns:
            states[:, column] = some
        blocks.append(np.atleast_1d(region.contains(problem.scene, states)))
    return np.concatenate(blocks)
