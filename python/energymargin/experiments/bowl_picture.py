"""The picture of `bowl`: the bowl's convex parts with the ball's way out, and the bound's fall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin._core import ConvexHull
from energymargin.experiments.bowl import BALL_RADIUS, PLANNERS, Bowl
from energymargin.outlines import shape_corners

try:
    from matplotlib import colormaps
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    from scipy.spatial import ConvexHull as Hull
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_bowl"]

COLORS = {"bit*": "#0072B2", "rrt*": "#CC79A7"}
STRIDE = 7  # neighbours get colours that differ; coprime to most numbers of parts
APART = 0.25  # how far the parts are moved from the middle, as a share of their distance to it


def figure_bowl(bowl: Bowl) -> Figure:
    """The bowl and a way out; its parts moved apart; upper bounds against samples."""
    figure = Figure(figsize=(12, 3.8), dpi=200, layout="constrained")
    whole = figure.add_subplot(1, 3, 1, projection="3d")
    apart = figure.add_subplot(1, 3, 2, projection="3d")
    bounds = figure.add_subplot(1, 3, 3)
    _draw_parts(whole, bowl, apart=0.0, alpha=0.25)
    _draw_way(whole, bowl)
    whole.set_title("a way out of the bowl", fontsize=10)
    _draw_parts(apart, bowl, apart=APART, alpha=0.9)
    apart.set_title(f"its {len(bowl.shape.parts)} convex parts, moved apart", fontsize=10)
    _draw_bounds(bounds, bowl)
    return figure


def _draw_parts(ax: Axes3D, bowl: Bowl, *, apart: float, alpha: float) -> None:
    count = len(bowl.shape.parts)
    colors = colormaps["cividis"](np.linspace(0.1, 1.0, count)[np.arange(count) * STRIDE % count])
    corners = [_points(part.shape) for part in bowl.shape.parts]
    middle = np.mean([points.mean(axis=0) for points in corners], axis=0)
    for points, color in zip(corners, colors, strict=True):
        moved = points + apart * (points.mean(axis=0) - middle)
        faces = moved[Hull(moved).simplices]
        ax.add_collection3d(Poly3DCollection(faces, facecolor=color, alpha=alpha, linewidth=0))
    limits = np.ptp(np.concatenate(corners), axis=0).max() / 2 * (1 + apart)
    for axis, center in zip("xyz", middle, strict=True):
        getattr(ax, f"set_{axis}lim")(center - limits, center + limits)
        getattr(ax, f"set_{axis}label")(f"{axis} [m]", fontsize=7)
        ax.tick_params(labelsize=6)
    ax.set_box_aspect((1, 1, 1))


def _points(shape: object) -> NDArray[np.float64]:
    return np.asarray(shape.points) if isinstance(shape, ConvexHull) else shape_corners(shape)


def _draw_way(ax: Axes3D, bowl: Bowl) -> None:
    """The cheapest path of all searches, and the ball at its start and at the top."""
    best = min(bowl.runs, key=lambda run: run.found.energy).found
    if best.barrier is None:
        return
    path = best.path[:, bowl.problem.scene.slice("ball")][:, :3]
    ax.plot(*path.T, color="#D55E00", linewidth=1.5)
    turn = np.linspace(0.0, 2.0 * np.pi, 20)
    rise = np.linspace(0.0, np.pi, 12)
    ball = np.stack(
        [
            np.outer(np.cos(turn), np.sin(rise)),
            np.outer(np.sin(turn), np.sin(rise)),
            np.outer(np.ones_like(turn), np.cos(rise)),
        ]
    )
    for row in (0, best.barrier):
        x, y, z = path[row][:, None, None] + BALL_RADIUS * ball
        ax.plot_surface(x, y, z, color="#E69F00", alpha=0.8)


def _draw_bounds(ax: Axes, bowl: Bowl) -> None:
    for run in bowl.runs:
        if not run.found.history:
            continue
        samples, energies = np.transpose(run.found.history)
        first = run.seed == 0
        label = run.planner if first else None
        color = COLORS[run.planner]
        ax.step(samples, 1e3 * energies, where="post", color=color, alpha=0.6, label=label)
    ax.axhline(1e3 * bowl.closed_form, color="black", linewidth=1, linestyle="--", label="m g h")
    ax.set_xscale("log")
    ax.set_xlabel("samples")
    ax.set_ylabel("escape energy [mJ], found from above")
    seeds = 1 + max(run.seed for run in bowl.runs)
    ax.set_title(f"{' and '.join(PLANNERS)}, {seeds} seeds each", fontsize=10)
    ax.grid(alpha=0.25, linewidth=0.5)
    ax.legend(frameon=False, fontsize=8)
