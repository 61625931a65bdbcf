"""How things lie on a plane, from the side."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from energymargin._core import Scene
from energymargin.base.checks import check_type, whole_number
from energymargin.look.outlines import Plan, view_of
from energymargin.look.plots import styles
from energymargin.look.plots.scenes import draw_bodies, set_plane
from energymargin.placing import RestingPoses

SIDE: Plan = ("x", "z")
MOST = 8  # pictures of a figure


def plot_resting_pose(poses: RestingPoses, number: int = 0, ax: Axes | None = None) -> Axes:
    """A pose from the side along which it topples most easily, with its probability.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than RestingPoses,
    or no number of a pose.
    """
    check_type("poses", poses, RestingPoses, "RestingPoses, as of em.resting_poses")
    if whole_number("number", number, 0) >= len(poses):
        raise ValueError(f"number is {number}, expected below {len(poses)}, the number of poses")
    ax = styles.axes_or_new(ax, 3.2, 2.8)
    one = poses[number]
    scene = Scene()
    scene.add_plane("ground")
    where: dict[str, Any] = {"position": one.pose[:3, 3], "orientation": one.orientation}
    scene.add_body("object", poses.shape, mass=poses.mass, role="object", **where)
    state = scene.pack()
    (left, right), (_, top) = view_of(scene, state[np.newaxis], SIDE)
    limits = (left, right), (-0.15 * top, top)
    draw_bodies(ax, scene, state, SIDE, limits)
    set_plane(ax, SIDE, limits)
    ax.plot(0.0, one.height, "k+")
    ax.locator_params(nbins=4)
    work = f", topples with {one.least_work:.3g} J" if one.work else ""
    ax.set_title(f"{number}: {one.probability:.1%}{work}", fontsize=9)
    return ax


def figure_resting_poses(poses: RestingPoses) -> Figure:
    """The most probable poses, at most eight, each from the side.

    Raises ValueError on another thing than RestingPoses, or none at all.
    """
    check_type("poses", poses, RestingPoses, "RestingPoses, as of em.resting_poses")
    if not len(poses):
        raise ValueError("poses is empty, expected one at least")
    count = min(len(poses), MOST)
    columns = min(count, MOST // 2)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.0 * columns, 2.7 * rows), layout="constrained")
    axes = np.ravel(figure.subplots(rows, columns))
    for number, ax in enumerate(axes[:count]):
        plot_resting_pose(poses, number, ax)
    for ax in axes[count:]:
        ax.set_axis_off()
    return figure
