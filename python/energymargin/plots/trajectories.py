"""Scores along trajectories, with the labels of their frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from energymargin.evaluation import LabelledScores
from energymargin.metrics import ANY, KINDS, of_kind
from energymargin.plots.styles import (
    LEGEND_SIZE,
    LOST_COLOR,
    axes_or_new,
    legend_beside,
    light_grid,
    metric_style,
)
from energymargin.store import Run
from energymargin.tasks.base import one_of

__all__ = ["Along", "along", "figure_scores", "plot_scores"]


class Along(NamedTuple):
    """What `plot_scores` draws of one trajectory of K frames."""

    times: NDArray[np.float64] | None
    """Of the frames [s], shape (K,), rising; None: they are counted."""
    scores: Mapping[str, NDArray[np.float64]]
    """By metric, shape (K,): inf where no escape was found, NaN where there is no score."""
    captured: NDArray[np.bool_] | None
    """Whether each frame is captured, shape (K,); None: it is not known."""


TOP, ROW = 0.94, 0.09  # of the axes' height: the first row of marks for infinity, and a row


def along(scores: LabelledScores | Run, trajectory: int, times: ArrayLike | None = None) -> Along:
    """The scores and labels of one trajectory, by its number, of a store's run or of what it has.

    `times` of its frames [s], shape (K,), as a `Trajectory` has them; a run does not know them.
    Raises ValueError if there is no such trajectory.
    """
    labelled = scores.labelled_scores() if isinstance(scores, Run) else scores
    states = np.flatnonzero(labelled.trajectory == trajectory)
    if not len(states):
        there = np.unique(labelled.trajectory)
        known = f"one from {there[0]} to {there[-1]}" if len(there) else "none, for there are none"
        raise ValueError(f"trajectory is {trajectory!r}, expected {known}")
    return Along(
        None if times is None else np.asarray(times, dtype=float),
        {metric: values[states] for metric, values in labelled.scores.items()},
        labelled.captured[states],
    )


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

    `kind`: "likelihood" (capture, success), "effort" or "force", each of which has a unit of its
    own; None if there is but one. All of them together are drawn by `figure_scores`. Frames that
    are not captured are shaded. An infinite effort is a mark at the top of the axes, a missing
    score is a gap, which the legend counts.

    Returns `ax`, or the axes of a new figure. Raises ValueError on an unknown kind or metric, or
    arrays of other lengths.
    """
    data = _checked(times, scores, captured)
    kind = _chosen(kind, data.scores)
    ax = axes_or_new(ax, 6.0, 3.0)
    frames = data.times if data.times is not None else np.arange(_frames(data.scores), dtype=float)
    names = of_kind(kind, data.scores)
    endless = [name for name in names if np.isposinf(data.scores[name]).any()]
    for name in names:
        _draw_scores(ax, frames, data.scores[name], name)
    for number, name in enumerate(endless):
        _mark_endless(ax, frames, data.scores[name], name, TOP - ROW * number)
    _leave_room(ax, [data.scores[name] for name in names], ROW * len(endless))
    if data.captured is not None:
        _shade(ax, frames, ~data.captured)
    if kind == "likelihood":
        ax.set_ylim(-0.05, 1.05)
    ax.set(xlabel="frame" if data.times is None else "time [s]", ylabel=KINDS[kind].axis)
    light_grid(ax)
    if legend:
        legend_beside(ax)
    return ax


def figure_scores(columns: Mapping[str, Along]) -> Figure:
    """All scores along several trajectories side by side, a row a kind; `columns` by title.

    Raises ValueError as `plot_scores` does, or if there is nothing to draw.
    """
    kinds = [kind for kind in KINDS if any(of_kind(kind, c.scores) for c in columns.values())]
    if not kinds:
        raise ValueError("columns has no scores, expected those of a trajectory at least")
    size = (4.2 * len(columns) + 1.2, 1.9 * len(kinds) + 0.5)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(kinds), len(columns), sharex="col", sharey="row", squeeze=False)
    for column, (title, data) in enumerate(columns.items()):
        for row, kind in enumerate(kinds):
            if of_kind(kind, data.scores):
                plot_scores(*data, axes[row, column], kind=kind, legend=False)
        axes[0, column].set_title(title, fontsize=10)
    for row_axes in axes:
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


def _checked(
    times: ArrayLike | None, scores: Mapping[str, ArrayLike], captured: ArrayLike | None
) -> Along:
    if not (isinstance(scores, Mapping) and scores):
        raise ValueError(f"scores is {scores!r}, expected arrays by metric")
    arrays = {name: np.asarray(values, dtype=float) for name, values in scores.items()}
    frames = _frames(arrays)
    given = dict(arrays)
    if times is not None:
        given["times"] = np.asarray(times, dtype=float)
    if captured is not None:
        given["captured"] = np.asarray(captured)
    for name, values in given.items():
        if np.shape(values) != (frames,):
            raise ValueError(f"{name} has shape {np.shape(values)}, expected ({frames},)")
    labels = None if captured is None else np.asarray(captured, dtype=bool)
    return Along(given.get("times"), arrays, labels)


def _frames(scores: Mapping[str, NDArray[np.float64]]) -> int:
    return np.size(next(iter(scores.values())))


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


def _mark_endless(
    ax: Axes, times: NDArray[np.float64], values: NDArray[np.float64], name: str, top: float
) -> None:
    """Marks at the height `top` of the axes (0..1), which stand for infinity."""
    style = metric_style(name)
    endless = times[np.isposinf(values)]
    ax.plot(
        endless,
        np.full(len(endless), top),
        color=style.color,
        linestyle="",
        marker=style.marker,
        markersize=5,
        markerfacecolor="white" if name.endswith(ANY) else style.color,
        transform=ax.get_xaxis_transform(),
        label=f"{name}: no escape",
    )
    ax.text(1.01, top, "∞", color=style.color, va="center", transform=ax.transAxes)


def _leave_room(ax: Axes, scores: Sequence[NDArray[np.float64]], room: float) -> None:
    """Scales the axes such that `room`, a share of their height, is free at the top."""
    values = np.concatenate(scores)
    finite = values[np.isfinite(values)]
    if room and len(finite):
        low, high = finite.min(), finite.max()
        ax.update_datalim([(0.0, high + (high - low or 1.0) * room / (1 - room))], updatex=False)
    ax.margins(y=0.12)


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
