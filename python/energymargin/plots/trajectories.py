"""Scores along trajectories, with the labels of their frames."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from energymargin.metrics import ANY, KINDS, of_kind
from energymargin.plots.infinity import draw_endless
from energymargin.plots.series import Along, checked
from energymargin.plots.styles import (
    LEGEND_SIZE,
    LOST_COLOR,
    axes_or_new,
    draw_legend,
    light_grid,
    metric_style,
)
from energymargin.tasks.base import one_of, yes_or_no

__all__ = ["figure_scores", "plot_scores"]


def plot_scores(
    times: ArrayLike | None,
    scores: Mapping[str, ArrayLike],
    captured: ArrayLike | None = None,
    ax: Axes | None = None,
    *,
    kind: str | None = None,
    legend: bool = True,
) -> Axes:
    """Scores of one kind along one trajectory; arguments as the fields of `Along`.

    `kind`: "likelihood" (capture, success), "probability", "effort" or "force", each of which has
    an axis of its own; None if there is but one. All of them together are drawn by
    `figure_scores`. Frames that are not captured are shaded. An infinite effort is a mark in a
    band at the top of the axes, a missing score is a gap, which the legend counts. The legend is
    inside of `ax`, or beside the axes of a new figure.

    Returns `ax`, or the axes of a new figure. Raises ValueError on an unknown kind or metric,
    arrays of other lengths, or numbers that cannot be times, labels, or scores of these metrics.
    """
    data = checked(times, scores, captured)
    kind = _chosen(kind, data.scores)
    yes_or_no("legend", legend)
    inside = None if ax is None else "best"
    ax = axes_or_new(ax, 6.0, 3.0)
    _draw(ax, data, kind)
    draw_endless([ax], [data], kind)
    if legend:
        draw_legend(ax, inside)
    return ax


def figure_scores(columns: Mapping[str, Along]) -> Figure:
    """All scores along several trajectories side by side, a row a kind; `columns` by title.

    Raises ValueError as `plot_scores` does, or if there is nothing to draw.
    """
    if not (isinstance(columns, Mapping) and all(isinstance(c, Along) for c in columns.values())):
        raise ValueError(f"columns is a {type(columns).__name__}, expected Along by title: {{...}}")
    columns = {title: checked(*data) for title, data in columns.items()}
    kinds = [kind for kind in KINDS if any(of_kind(kind, c.scores) for c in columns.values())]
    if not kinds:
        raise ValueError("columns has no scores, expected those of a trajectory at least")
    size = (4.2 * len(columns) + 1.2, 1.9 * len(kinds) + 0.5)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(kinds), len(columns), sharex="col", sharey="row", squeeze=False)
    for title, ax in zip(columns, axes[0], strict=True):
        ax.set_title(title, fontsize=10)
    for kind, row_axes in zip(kinds, axes, strict=True):
        for ax, data in zip(row_axes, columns.values(), strict=True):
            _draw(ax, data, kind)
        draw_endless(list(row_axes), list(columns.values()), kind)
        for ax in row_axes:
            ax.label_outer()
        _shared_legend(row_axes)
    return figure


def _shared_legend(axes: NDArray[Any]) -> None:
    """Beside the last of some axes, of what is in any: a shade or a mark may be in one alone."""
    entries: dict[str, Any] = {}
    for ax in axes:
        handles, texts = ax.get_legend_handles_labels()
        entries.update(zip(texts, handles, strict=True))
    axes[-1].legend(
        entries.values(),
        entries.keys(),
        loc="center left",
        bbox_to_anchor=(1.03, 0.5),
        frameon=False,
        fontsize=LEGEND_SIZE,
        handlelength=3.2,
    )


def _chosen(kind: str | None, scores: Mapping[str, Any]) -> str:
    """A kind that has scores; ValueError if it has none or, of None, several have."""
    there = [name for name in KINDS if of_kind(name, scores)]
    known = [name for each in KINDS for name in of_kind(each, scores)]
    unknown = [name for name in scores if name not in known]
    if unknown:
        metrics = ", ".join(metric for each in KINDS.values() for metric in each.metrics)
        raise ValueError(f"scores has {unknown[0]!r}, expected some of {metrics}")
    if kind is None and len(there) > 1:
        raise ValueError(
            f"scores are of several kinds: choose kind={' or '.join(map(repr, there))}, "
            "or draw them all with figure_scores"
        )
    return one_of("kind", there[0] if kind is None else kind, there)


def _draw(ax: Axes, data: Along, kind: str) -> None:
    """All of a kind but what is infinite."""
    frames = data.frames
    for name in of_kind(kind, data.scores):
        _draw_scores(ax, frames, data.scores[name], name)
    if data.captured is not None:
        _shade(ax, frames, ~data.captured)
    ax.margins(y=0.12)
    if kind in ("likelihood", "probability"):
        ax.set_ylim(-0.05, 1.05)
    ax.set(xlabel="frame" if data.times is None else "time [s]", ylabel=KINDS[kind].axis)
    light_grid(ax)


def _draw_scores(
    ax: Axes, times: NDArray[np.float64], values: NDArray[np.float64], name: str
) -> None:
    """A line through what is finite; dashed, with rings, for at least one object."""
    style = metric_style(name)
    missing = int(np.isnan(values).sum())
    label = name + (f" ({missing} missing)" if missing else "")
    ax.plot(
        times,
        np.where(np.isfinite(values), values, np.nan),
        color=style.color,
        linestyle="--" if name.endswith(ANY) else "-",
        linewidth=1.2,
        marker=style.marker,
        markersize=3.5,
        markerfacecolor="white" if name.endswith(ANY) else style.color,
        label="_nolegend_" if np.isposinf(values).all() else label,
    )


def _shade(ax: Axes, times: NDArray[np.float64], shaded: NDArray[np.bool_]) -> None:
    """A band about each shaded frame, reaching half-way to its neighbours; about the only one, half
    a unit to both sides."""
    middles = (times[1:] + times[:-1]) / 2
    alone = 0.5 if len(times) == 1 else 0.0
    borders = np.concatenate([times[:1] - alone, middles, times[-1:] + alone])
    label: str | None = "not captured"
    for k in np.flatnonzero(shaded):
        ax.axvspan(borders[k], borders[k + 1], facecolor=LOST_COLOR, alpha=0.15, label=label)
        label = None  # once in the legend
