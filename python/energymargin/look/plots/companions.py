"""Grasps by rank, a hand on its object from two sides, and how things lie on a plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from energymargin._core import Scene
from energymargin.base.aliases import Floats
from energymargin.base.checks import whole_number
from energymargin.grasps.outcomes import NO_GRIP, Closed
from energymargin.grasps.scores import GraspScores, grasp_of
from energymargin.look.outlines import Plan, view_of
from energymargin.look.plots import styles
from energymargin.look.plots.scenes import draw_bodies, set_plane
from energymargin.placing import RestingPoses

KINDS = {  # by label: words, colour, marker
    "held": ("recorded as held", "#0072B2", "o"),
    "lost": ("recorded as lost", styles.LOST_COLOR, "X"),
    "": ("no label", "0.45", "D"),
}
NAMED = 40  # grasps whose names stand below them
SIZE = (8.0, 3.6)  # inch
SIDES: tuple[Plan, Plan] = (("x", "z"), ("y", "z"))
MOST_POSES = 8  # pictures of a figure
AXES = {"x": "as the fingers open [m]", "y": "across that [m]", "z": "against the approach [m]"}
DOWN = np.diag([1.0, -1.0, -1.0])  # turns z, the approach, down


def plot_grasps(scores: GraspScores, ax: Axes | None = None) -> Axes:
    """Probabilities with their 95 % intervals, the best grasp on the left, by recorded label.

    A dot is recorded as held (a label of at least 0.5), a cross as lost. Grasps without a score are
    left out. Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than
    GraspScores.
    """
    scored = scores.ranked
    axes = styles.axes_or_new(ax, *SIZE)
    ranks, values = np.arange(1, len(scored) + 1), scores.probabilities[scored]
    low, high = scores.interval()[scored].T
    labels = scores.grasps.labels[scored]
    kinds = np.where(np.isnan(labels), "", np.where(labels >= 0.5, "held", "lost"))
    size = float(np.clip(160 / max(len(scored), 1), 2.0, 6.0))
    for kind, (words, color, marker) in KINDS.items():
        own = kinds == kind
        if own.any():
            bar: dict[str, Any] = {"color": color, "alpha": 0.35, "linewidth": size / 3}
            axes.vlines(ranks[own], low[own], high[own], **bar)
            look: dict[str, Any] = {"color": color, "marker": marker, "markersize": size}
            axes.plot(ranks[own], values[own], linestyle="", label=words, **look)
    axes.set(xlim=(0.5, max(len(scored), 1) + 0.5), ylim=(-0.03, 1.03))
    axes.set(xlabel="rank", ylabel="probability that it holds")
    if len(scored) <= NAMED:
        names = [styles.folded(scores.grasps.names[k]) for k in scored]
        axes.set_xticks(ranks, names, rotation=90, fontsize=8)
        axes.set_xlabel("grasp")
    styles.light_grid(axes)
    if set(kinds) - {""}:
        styles.draw_legend(axes)
    return axes


def figure_grasp(scores: GraspScores, number: int) -> Figure:
    """A grasp from two sides, as it is believed most: the hand (green) once it has closed.

    The hand comes from above: z is against its approach, x the way in which its fingers open. With
    a table z is up, and the hand is turned about it alone. A hand that has no place is drawn open,
    inside of what it is in. Raises ValueError on another thing than GraspScores, or no number of a
    grasp.
    """
    whole_number("number", number, 0, len(scores.grasps) - 1)
    trials, grasp = scores.trials, grasp_of(scores.grasps, number)
    draw = trials.draw(-1)
    closed, (scene, _) = trials.grip(grasp, draw), trials.scene(grasp.opening, draw, gravity=False)
    what = f"the hand {NO_GRIP[closed.ending]}" if closed.ending else "gripped"
    state = _turned(scene, closed, trials.protocol.table)
    views = [view_of(scene, state[np.newaxis], plane) for plane in SIDES]
    low, high = min(view[1][0] for view in views), max(view[1][1] for view in views)
    figure = Figure(figsize=(7.0, 3.8), layout="constrained")
    widths = [max(right - left, (high - low) / 2) for (left, right), _ in views]
    axes = figure.subplots(1, 2, width_ratios=widths)
    for ax, plane, (sides, _) in zip(axes, SIDES, views, strict=True):
        limits = (sides, (low, high))
        draw_bodies(ax, scene, state, plane, limits)
        set_plane(ax, plane, limits)
        names = {**AXES, "z": "height [m]"} if trials.protocol.table else AXES
        ax.set(xlabel=names[plane[0]], ylabel=names[plane[1]])
        ax.locator_params(nbins=4)
    title = f"{styles.folded(scores.grasps.names[number])}: {what}"
    if scores.counted[number]:
        least, most = scores.interval()[number]
        title += f", holds in {scores.probabilities[number]:.2f} of its trials"
        title += f" ({least:.2f} to {most:.2f})"
    figure.suptitle(title, fontsize=10)
    return figure


def _turned(scene: Scene, closed: Closed, table: bool) -> Floats:
    """The state seen from the hand; with a table about the vertical alone."""
    hand = closed.hand
    place = scene.unpack(closed.state)[hand.base]
    grasp = Rotation.from_quat(place["orientation"]) * Rotation.from_matrix(hand.frame[:3, :3])
    back = Rotation.from_matrix(DOWN) * grasp.inv()
    if table:
        x, y, _ = grasp.apply([1.0, 0.0, 0.0])
        back = Rotation.from_euler("z", -np.arctan2(y, x))
    center = np.array(place["position"])
    center[2] = 0.0 if table else center[2]
    turned = closed.state.copy()
    for name in (hand.base, "object"):
        numbers = turned[scene.slice(name)]
        numbers[:3] = back.apply(numbers[:3] - center)
        numbers[3:7] = (back * Rotation.from_quat(numbers[3:7])).as_quat()
        turned[scene.slice(name)] = numbers
    return turned


def plot_resting_pose(poses: RestingPoses, number: int = 0, ax: Axes | None = None) -> Axes:
    """A pose from the side along which it topples most easily, with its probability.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than RestingPoses,
    or no number of a pose.
    """
    whole_number("number", number, 0, len(poses) - 1)
    ax = styles.axes_or_new(ax, 3.2, 2.8)
    one = poses[number]
    scene = Scene()
    scene.add_plane("ground")
    where: dict[str, Any] = {"position": one.pose[:3, 3], "orientation": one.orientation}
    scene.add_body("object", poses.shape, mass=poses.mass, role="object", **where)
    state = scene.pack()
    (left, right), (_, top) = view_of(scene, state[np.newaxis], SIDES[0])
    limits = (left, right), (-0.15 * top, top)
    draw_bodies(ax, scene, state, SIDES[0], limits)
    set_plane(ax, SIDES[0], limits)
    ax.plot(0.0, one.height, "k+")
    ax.locator_params(nbins=4)
    work = f", topples with {one.least_work:.3g} J" if one.work else ""
    ax.set_title(f"{number}: {one.probability:.1%}{work}", fontsize=9)
    return ax


def figure_resting_poses(poses: RestingPoses) -> Figure:
    """The most probable poses, at most eight, each from the side.

    Raises ValueError on another thing than RestingPoses, or none at all.
    """
    if not len(poses.poses):
        raise ValueError("poses is empty, expected one at least")
    count = min(len(poses), MOST_POSES)
    columns = min(count, MOST_POSES // 2)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.0 * columns, 2.7 * rows), layout="constrained")
    axes = np.ravel(figure.subplots(rows, columns))
    for number, ax in enumerate(axes[:count]):
        plot_resting_pose(poses, number, ax)
    for ax in axes[count:]:
        ax.set_axis_off()
    return figure
