"""Scores along trajectories, with the labels of their frames, and a band for infinite scores."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import AutoLocator, NullLocator, ScalarFormatter
from numpy.typing import ArrayLike, NDArray

from energymargin.checks import one_of, yes_or_no
from energymargin.evaluation import LabelledScores
from energymargin.metrics import ANY, KINDS, is_likelihood, metric_kind, of_kind
from energymargin.plots.styles import (
    axes_or_new,
    draw_legend,
    light_grid,
    metric_style,
    shade_frames,
)
from energymargin.store import Run, ScoreStore

BAND = (0.1, 0.9)  # quantiles of the particles of a belief
ROW = 0.11  # of the axes' height: of a row of marks
MARKED = 80  # frames; the line of a longer trajectory has no marks
AROUND = 0.1  # of what is finite: free above and below it, under the band

Scores = LabelledScores | Run | ScoreStore | str | os.PathLike[str]
"""Scores with their labels: in memory, of a run, or of the only run of a file, by its path too."""


def labelled_scores(scores: Scores) -> LabelledScores:
    """What there is; ValueError if it is none of these, or a file that has not just one run."""
    if isinstance(scores, LabelledScores):
        return scores
    if isinstance(scores, Run):
        return scores.labelled_scores()
    if isinstance(scores, ScoreStore):
        return scores.run().labelled_scores()
    if isinstance(scores, (str, os.PathLike)):
        with ScoreStore(scores) as store:
            return labelled_scores(store)
    raise ValueError(
        f"scores is a {type(scores).__name__}, expected LabelledScores, a Run or a ScoreStore, or "
        "the path of a file of scores"
    )


class TrajectoryScores(NamedTuple):
    """What `plot_scores` draws of one trajectory of K frames."""

    times: NDArray[np.float64] | None
    """Times of the frames [s], shape (K,), rising; None: they are counted."""
    scores: Mapping[str, NDArray[np.float64]]
    """By metric, shape (K,): inf where no escape was found, NaN where there is no score."""
    captured: NDArray[np.bool_] | None
    """Whether each frame is captured, shape (K,); None: it is not known."""
    captured_any: NDArray[np.bool_] | None = None
    """Whether at least one of several objects is captured, shape (K,); None: there is one set."""
    bands: Mapping[str, NDArray[np.float64]] = {}
    """By metric, the quantiles BAND of its score under a belief, shape (K, 2)."""

    @property
    def frames(self) -> NDArray[np.float64]:
        """Where they are on the x axis: at their times [s], or else their numbers."""
        if self.times is not None:
            return self.times
        return np.arange(len(next(iter(self.scores.values()))), dtype=float)


def trajectory_scores(
    scores: Scores, trajectory: int, *, times: ArrayLike | None = None
) -> TrajectoryScores:
    """The scores and labels of a trajectory, by its number; `scores` as of `plot_roc`.

    `times`: of its K frames [s], shape (K,), as in `Trajectory.times`; a store does not hold them.
    Raises ValueError if there is no such trajectory.
    """
    labelled = labelled_scores(scores)
    states = np.flatnonzero(labelled.trajectory == trajectory)
    if not len(states):
        there = np.unique(labelled.trajectory)
        known = f"one from {there[0]} to {there[-1]}" if len(there) else "none, for there are none"
        raise ValueError(f"trajectory is {trajectory!r}, expected {known}")
    return TrajectoryScores(
        None if times is None else np.asarray(times, dtype=float),
        {metric: values[states] for metric, values in labelled.scores.items()},
        labelled.captured[states],
        None if labelled.captured_any is None else labelled.captured_any[states],
    )


def _checked(
    times: ArrayLike | None,
    scores: Mapping[str, ArrayLike],
    captured: ArrayLike | None,
    captured_any: ArrayLike | None = None,
    bands: Mapping[str, ArrayLike] | None = None,
) -> TrajectoryScores:
    """Checked fields of TrajectoryScores; ValueError as `plot_scores` raises."""
    if not (isinstance(scores, Mapping) and scores):
        kind = "empty" if isinstance(scores, Mapping) else f"a {type(scores).__name__}"
        raise ValueError(f"scores is {kind}, expected arrays by metric")
    arrays = {name: _numbers(name, values) for name, values in scores.items()}
    name, first = next(iter(arrays.items()))
    if first.ndim != 1 or not len(first):
        raise ValueError(f"{name} has shape {first.shape}, expected (K,), K > 0: a number a frame")
    frames = len(first)
    for name, values in arrays.items():
        _check_shape(name, values, (frames,))
        _check_scores(name, values)
    if times is not None:
        times = _numbers("times", times)
        _check_shape("times", times, (frames,))
        _check_times(times)
    return TrajectoryScores(
        times,
        arrays,
        _labels("captured", captured, frames),
        _labels("captured_any", captured_any, frames),
        {name: _numbers(name, values) for name, values in (bands or {}).items()},
    )


def _numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {values!r}, expected numbers") from None


def _check_shape(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> None:
    if values.shape != shape:
        raise ValueError(f"{name} has shape {values.shape}, expected {shape}")


def _check_scores(name: str, values: NDArray[np.float64]) -> None:
    """NaN is a score that is not there, and inf an effort without an escape."""
    low, high = (0.0, 1.0) if is_likelihood(name) else (np.finfo(float).min, np.inf)
    wrong = values[(values < low) | (values > high)]
    if len(wrong):
        expected = "0 to 1" if is_likelihood(name) else "a number or inf"
        raise ValueError(
            f"{name} has {wrong[0]:g}, expected {expected}, or NaN where there is none"
        )


def _check_times(times: NDArray[np.float64]) -> None:
    wrong = ~np.isfinite(times)
    wrong[1:] |= ~(np.diff(times) > 0)
    if wrong.any():
        k = int(wrong.argmax())
        raise ValueError(f"times has {times[k]:g} at frame {k}, expected finite numbers that rise")


def _labels(name: str, given: ArrayLike | None, frames: int) -> NDArray[np.bool_] | None:
    if given is None:
        return None
    labels = np.asarray(given)
    _check_shape(name, labels, (frames,))
    wrong = [label for label in labels.tolist() if label not in (0, 1)]
    if wrong:
        raise ValueError(f"{name} has {wrong[0]!r}, expected True and False, or 1 and 0")
    return labels.astype(bool)


def plot_scores(
    times: ArrayLike | None,
    scores: Mapping[str, ArrayLike],
    captured: ArrayLike | None = None,
    captured_any: ArrayLike | None = None,
    bands: Mapping[str, ArrayLike] | None = None,
    *,
    ax: Axes | None = None,
    kind: str | None = None,
    legend: bool = True,
) -> Axes:
    """Scores of one kind along one trajectory; arguments as the fields of `TrajectoryScores`.

    `kind`: "likelihood" (capture, success), "probability", "effort" or "force", each of which has
    a unit of its own; None if there is only one. `figure_scores` draws all of them. Frames that
    are not captured are shaded. An infinite effort is a mark in a band at the top of the axes. A
    missing score is a gap; the legend counts them. The legend is inside `ax`, or beside the axes
    of a new figure.

    Returns `ax`, or the axes of a new figure. Raises ValueError on an unknown kind or metric,
    arrays of other lengths, or numbers that cannot be times, labels, or scores of these metrics.
    """
    data = _checked(times, scores, captured, captured_any, bands)
    kind = _chosen(kind, data.scores)
    yes_or_no("legend", legend)
    inside = None if ax is None else "best"
    ax = axes_or_new(ax, 6.0, 3.0)
    _draw_row([ax], [data], _Row(of_kind(kind, data.scores), KINDS[kind].axis))
    if legend:
        draw_legend(ax, inside)
    return ax


def figure_scores(columns: Mapping[str, TrajectoryScores], *, width: float = 4.2) -> Figure:
    """All scores along several trajectories side by side, a row a kind.

    `columns`: by title; `width`: of each column [inch]. Raises ValueError as `plot_scores` does, or
    if there is nothing to draw.
    """
    columns = {title: _checked(*data) for title, data in columns.items()}
    rows = _rows({metric: None for data in columns.values() for metric in data.scores})
    if not rows:
        raise ValueError("columns has no scores, expected those of a trajectory at least")
    size = (width * len(columns) + 1.2, 1.9 * len(rows) + 0.5)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(rows), len(columns), sharex="col", sharey="row", squeeze=False)
    for title, ax in zip(columns, axes[0], strict=True):
        ax.set_title(title, fontsize=10)
    for row, row_axes in zip(rows, axes, strict=True):
        _draw_row(list(row_axes), list(columns.values()), row)
        for ax in row_axes:
            ax.label_outer()
        _shared_legend(row_axes)
    return figure


class _Row(NamedTuple):
    """Metrics that share an axis."""

    metrics: list[str]
    axis: str
    """Its label."""


def _rows(metrics: Iterable[str]) -> list[_Row]:
    """One for each kind; a metric of another program has its own."""
    rows = [_Row(of_kind(name, metrics), kind.axis) for name, kind in KINDS.items()]
    others = [_Row([metric], metric) for metric in metrics if metric_kind(metric) is None]
    return [*(row for row in rows if row.metrics), *others]


def _shared_legend(axes: NDArray[Any]) -> None:
    """Beside the last of some axes, of what is in any: a shade or a mark may be in one alone."""
    entries: dict[str, Any] = {}
    for ax in axes:
        handles, texts = ax.get_legend_handles_labels()
        entries.update(zip(texts, handles, strict=True))
    draw_legend(axes[-1], None, entries=entries, anchor=(1.03, 0.5))


def _chosen(kind: str | None, scores: Mapping[str, Any]) -> str:
    """A kind that has scores; ValueError if it has none or, of None, several have."""
    there = [name for name in KINDS if of_kind(name, scores)]
    unknown = [name for name in scores if metric_kind(name) is None]
    if unknown:
        metrics = ", ".join(metric for each in KINDS.values() for metric in each.metrics)
        raise ValueError(f"scores has {unknown[0]!r}, expected some of {metrics}")
    if kind is None and len(there) > 1:
        raise ValueError(
            f"scores are of several kinds: choose kind={' or '.join(map(repr, there))}, "
            "or draw them all with figure_scores"
        )
    return one_of("kind", there[0] if kind is None else kind, there)


def _draw_row(axes: Sequence[Axes], columns: Sequence[TrajectoryScores], row: _Row) -> None:
    """The scores of these metrics along each trajectory, on axes that share their scale."""
    for ax, data in zip(axes, columns, strict=True):
        for name in row.metrics:
            if name in data.scores:
                _draw_band(ax, data, name)
                _draw_scores(ax, data.frames, data.scores[name], name)
        if data.captured is not None:
            shade_frames(ax, data.frames, ~data.captured, "not captured")
        if data.captured_any is not None:
            shade_frames(ax, data.frames, ~data.captured_any, "no object captured")
        ax.margins(y=0.12)
        if is_likelihood(row.metrics[0]):
            ax.set_ylim(-0.05, 1.05)
        ax.set(xlabel="frame" if data.times is None else "time [s]", ylabel=row.axis)
        light_grid(ax)
    _draw_endless(axes, columns, row.metrics)


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
        marker=style.marker if len(values) <= MARKED else "",
        markersize=3.5,
        markerfacecolor="white" if name.endswith(ANY) else style.color,
        label="_nolegend_" if np.isposinf(values).all() else label,
    )


def _draw_band(ax: Axes, data: TrajectoryScores, name: str) -> None:
    """Between the quantiles of a score; what is infinite ends at the largest finite one."""
    ends = data.bands.get(name, np.empty(0))
    finite = ends[np.isfinite(ends)]
    if len(finite):
        shown = np.minimum(ends, finite.max())
        color, label = metric_style(name).color, f"{name}: {BAND[0]:g} to {BAND[1]:g} quantile"
        ax.fill_between(data.frames, *shown.T, color=color, alpha=0.25, linewidth=0, label=label)


def _draw_endless(
    axes: Sequence[Axes], columns: Sequence[TrajectoryScores], metrics: Sequence[str]
) -> None:
    """A band for infinity at the top of axes that share their scale, with a row of marks a metric.

    What is finite stays below it, and so do the numbers on the y axis.
    """
    drawn = [{name: data.scores.get(name, np.empty(0)) for name in metrics} for data in columns]
    names = [name for name in metrics if any(np.isposinf(of[name]).any() for of in drawn)]
    bands = [data.bands.get(name, np.empty(0)).ravel() for data in columns for name in metrics]
    values = np.concatenate([*(each for of in drawn for each in of.values()), *bands])
    finite = values[np.isfinite(values)]
    below = 1.0 - ROW * len(names) if len(finite) else 0.0  # of the height
    for number, name in enumerate(names):
        height = 1.0 - (1.0 - below) * (number + 0.5) / len(names)
        for ax, data in zip(axes, columns, strict=True):
            _mark_endless(ax, data, name, height)
    if names:
        axes[0].yaxis.set_major_locator(_Below(below))
        axes[0].yaxis.set_major_formatter(_InfinityLast())
    elif not len(finite):
        axes[0].yaxis.set_major_locator(NullLocator())
    if names and len(finite):
        _keep_below(axes, finite, below)


def _mark_endless(ax: Axes, data: TrajectoryScores, name: str, height: float) -> None:
    """Marks at a height of the axes (0..1), which stand for infinity."""
    endless = np.isposinf(data.scores.get(name, np.empty(0)))
    if not endless.any():
        return
    style = metric_style(name)
    ax.plot(
        data.frames[endless],
        np.full(endless.sum(), height),
        color=style.color,
        linestyle="",
        marker=style.marker,
        markersize=5,
        markerfacecolor="white" if name.endswith(ANY) else style.color,
        transform=ax.get_xaxis_transform(),
        label=f"{name}: no escape",
    )


def _keep_below(axes: Sequence[Axes], finite: NDArray[np.float64], share: float) -> None:
    """Scales axes such that what is finite is in that share of their height, below a thin line."""
    low, spread = finite.min(), np.ptp(finite) or abs(finite[0]) or 1.0
    bottom = low - AROUND * spread
    top = bottom + (1.0 + 2 * AROUND) * spread / share
    axes[0].update_datalim([(0.0, bottom), (0.0, top)], updatex=False)
    for ax in axes:
        ax.margins(y=0.0)
        line = Line2D([0, 1], [share, share], color="0.3", linewidth=0.8, gid="band")
        line.set_transform(ax.transAxes)
        ax.add_line(line)


class _Below(AutoLocator):
    """The usual ticks in a share of an axis from its low end, and one amidst the rest of it."""

    def __init__(self, share: float) -> None:
        super().__init__()
        self._share = share

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        end = vmin + self._share * (vmax - vmin)
        numbers = [tick for tick in super().tick_values(vmin, vmax) if tick < end]
        return [*numbers, (end + vmax) / 2]


class _InfinityLast(ScalarFormatter):
    """The last tick stands for infinity, and the others for their numbers."""

    def format_ticks(self, values: list[float]) -> list[str]:
        return [*super().format_ticks(values[:-1]), "∞"]
