"""Scores along trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from energymargin.plots.states import LOST_COLOR
from energymargin.settings import ANY

__all__ = ["figure_scores", "plot_trajectory_scores"]

METRIC_COLORS = {
    "capture": "#0072B2",
    "success": "#000000",
    "effort/est": "#0072B2",
    "effort/rrt": "#CC79A7",
    "force": "#000000",
}
LIKELIHOOD = "likelihood"
# The metrics that share an axis, with its label; those of at least one object go with them, dashed.
PANELS = (
    (("capture", "success"), LIKELIHOOD),
    (("effort/est", "effort/rrt"), "effort of escape [J]"),
    (("force",), "force score [N]"),
)


def plot_trajectory_scores(
    times: NDArray[np.float64],
    scores: Mapping[str, NDArray[np.float64]],
    captured: NDArray[np.bool_],
    axes: Sequence[Axes],
) -> None:
    """Scores along one trajectory, all arrays (K,); each kind on its own one of `axes`.

    Frames that are not captured are shaded. An infinite effort is drawn as a triangle at the top.
    """
    for ax, (names, label) in zip(axes, _kinds(scores), strict=True):
        for number, name in enumerate(names):
            _draw_scores(ax, times, scores[name], name, top=0.95 - 0.08 * number)
        _shade(ax, times, ~captured, label="not captured" if ax is axes[0] else None)
        ax.set_ylabel(label)
        ax.margins(y=0.12)
        ax.grid(alpha=0.25, linewidth=0.5)
        if label == LIKELIHOOD:
            ax.set_ylim(-0.05, 1.05)
    axes[-1].set_xlabel("time [s]")


def figure_scores(
    columns: Mapping[
        str, tuple[NDArray[np.float64], Mapping[str, NDArray[np.float64]], NDArray[np.bool_]]
    ],
) -> Figure:
    """Scores along several trajectories side by side.

    `columns`: name -> (times, scores, captured), each as in `plot_trajectory_scores`.
    """
    kinds = len(_kinds(next(iter(columns.values()))[1]))
    figure = Figure(figsize=(4.2 * len(columns), 1.9 * kinds + 0.5), dpi=200, layout="constrained")
    axes = figure.subplots(kinds, len(columns), sharex="col", sharey="row", squeeze=False)
    for column, (name, (times, scores, captured)) in enumerate(columns.items()):
        plot_trajectory_scores(times, scores, captured, list(axes[:, column]))
        axes[0, column].set_title(name, fontsize=10)
    for row in axes:
        entries: dict[str, Any] = {}  # of all columns: a shade or a triangle may be in one alone
        for ax in row:
            ax.label_outer()
            entries.update({text: handle for handle, text in zip(*_entries(ax), strict=True)})
        row[-1].legend(
            entries.values(),
            entries.keys(),
            loc="center left",
            bbox_to_anchor=(1.0, 0.5),
            frameon=False,
            fontsize=8,
        )
    return figure


def _entries(ax: Axes) -> tuple[list[Any], list[str]]:
    """What a legend would hold."""
    handles, texts = ax.get_legend_handles_labels()
    return list(handles), list(texts)


def _kinds(scores: Mapping[str, Any]) -> list[tuple[list[str], str]]:
    """The kinds of score that are there, with the label of their axis."""
    kinds = [
        ([m for name in names for m in (name, name + ANY) if m in scores], label)
        for names, label in PANELS
    ]
    return [(names, label) for names, label in kinds if names]


def _draw_scores(
    ax: Axes,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    name: str,
    *,
    top: float,
) -> None:
    """A line; triangles at the height `top` of the axis (0..1) stand for infinity."""
    finite = np.where(np.isfinite(values), values, np.nan)
    color = METRIC_COLORS[name.removesuffix(ANY)]
    line = "o--" if name.endswith(ANY) else "o-"
    ax.plot(times, finite, line, color=color, markersize=3, linewidth=1.2, label=name)
    endless = times[np.isposinf(values)]
    if len(endless):
        ax.plot(
            endless,
            np.full(len(endless), top),
            "^",
            color=color,
            markersize=4,
            transform=ax.get_xaxis_transform(),
            label=f"{name}: no escape",
        )


def _shade(
    ax: Axes, times: NDArray[np.float64], shaded: NDArray[np.bool_], label: str | None
) -> None:
    """A band about each shaded frame, reaching half-way to its neighbours."""
    middles = (times[1:] + times[:-1]) / 2
    borders = np.concatenate([times[:1], middles, times[-1:]])
    for k in np.flatnonzero(shaded):
        ax.axvspan(borders[k], borders[k + 1], facecolor=LOST_COLOR, alpha=0.15, label=label)
        label = None  # once in the legend
