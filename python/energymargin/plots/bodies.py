"""Bodies of a scene in a plane, drawn from their shapes."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from energymargin._core import Body, Plane, Scene
from energymargin.outlines import Limits, Plan, Pose, axis_numbers, body_poses, outlines_of, placed
from energymargin.plots.styles import BODY_COLORS, LOST_COLOR

__all__ = ["draw_bodies", "draw_ghost", "draw_lost"]


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
