"""Scores along trajectories with the labels of their frames, and search trees of a dataset."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from energymargin import tasks
from energymargin._core import CaptureScore, Problem, capture_score, stream
from energymargin.base.aliases import AnyPath, Floats, Mask
from energymargin.base.checks import check_shape, check_type, numbers_of, one_of
from energymargin.base.metrics import ANY, KINDS, check_scores, is_likelihood, metric_kind, of_kind
from energymargin.look.outlines import Limits, Plan, view_of
from energymargin.look.plots import styles
from energymargin.look.plots.scenes import lost_objects
from energymargin.look.plots.states import plot_state, score_title, state_legend
from energymargin.look.plots.styles import LEGEND_SIZE
from energymargin.look.plots.trees import draw_color_bar, most_cost
from energymargin.records.datasets import Dataset
from energymargin.records.evaluation import LabelledScores
from energymargin.records.store import Run, ScoreStore
from energymargin.tasks.base import plane_of

BAND = (0.1, 0.9)  # quantiles of the particles of a belief
MARKED = 80  # frames; the line of a longer trajectory has no marks

Scores = LabelledScores | Run | ScoreStore | AnyPath
"""Scores with their labels: in memory, of a run, or of a file, by its path too, whose run is that
of `ScoreStore.run`."""


def labelled_scores(scores: Scores) -> LabelledScores:
    """What there is; ValueError if it is none of these, or a file of several runs."""
    if isinstance(scores, (str, os.PathLike)):
        with ScoreStore(scores) as store:
            return labelled_scores(store)
    if isinstance(scores, (Run, ScoreStore)):
        run = scores.run() if isinstance(scores, ScoreStore) else scores
        return run.labelled_scores()
    expected = "LabelledScores, a Run or a ScoreStore, or the path of a file of scores"
    check_type("scores", scores, LabelledScores, expected)
    return scores


class TrajectoryScores(NamedTuple):
    """What `plot_scores` draws of one trajectory of K frames."""

    times: Floats | None
    """Times of the frames [s], shape (K,), rising; None: they are counted."""
    scores: Mapping[str, Floats]
    """By metric, shape (K,): inf where no escape was found, NaN where there is no score."""
    captured: Mask | None
    """Whether each frame is captured, shape (K,); None: it is not known."""
    captured_any: Mask | None = None
    """Whether at least one of several objects is captured, shape (K,); None: there is one set."""
    bands: Mapping[str, Floats] = {}
    """By metric, the quantiles BAND of its score under a belief, shape (K, 2)."""

    @property
    def frames(self) -> Floats:
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
    captured_any = None if labelled.captured_any is None else labelled.captured_any[states]
    scored = {metric: values[states] for metric, values in labelled.scores.items()}
    at = None if times is None else np.asarray(times, dtype=float)
    return TrajectoryScores(at, scored, labelled.captured[states], captured_any)


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
    arrays = {name: numbers_of(name, values) for name, values in scores.items()}
    name, first = next(iter(arrays.items()))
    if first.ndim != 1 or not len(first):
        raise ValueError(f"{name} has shape {first.shape}, expected (K,), K > 0: a number a frame")
    for name, values in arrays.items():
        check_shape(name, values, first.shape)
        check_scores(name, values)
    if times is not None:
        times = numbers_of("times", times)
        check_shape("times", times, first.shape)
        falls = ~np.isfinite(times) | ~(np.diff(times, prepend=-np.inf) > 0)
        if falls.any():
            k = int(falls.argmax())
            text = f"times has {times[k]:g} at frame {k}, expected finite numbers that rise"
            raise ValueError(text)
    return TrajectoryScores(
        times,
        arrays,
        _labels("captured", captured, first.shape),
        _labels("captured_any", captured_any, first.shape),
        {name: numbers_of(name, values) for name, values in (bands or {}).items()},
    )


def _labels(name: str, given: ArrayLike | None, shape: tuple[int, ...]) -> Mask | None:
    if given is None:
        return None
    labels = np.asarray(given)
    check_shape(name, labels, shape)
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
    with styles.curve_axes(ax, (6.0, 3.0), "best", legend=legend) as axes:
        _draw_row([axes], [data], of_kind(kind, data.scores), KINDS[kind].axis)
    return axes


def figure_scores(columns: Mapping[str, TrajectoryScores], *, width: float = 4.2) -> Figure:
    """All scores along several trajectories side by side, a row a kind.

    `columns`: by title; `width`: of each column [inch]. Raises ValueError as `plot_scores` does, or
    if there is nothing to draw.
    """
    columns = {title: _checked(*data) for title, data in columns.items()}
    there = {metric: None for data in columns.values() for metric in data.scores}
    rows = {kind.axis: of_kind(name, there) for name, kind in KINDS.items()}
    rows |= {metric: [metric] for metric in there if metric_kind(metric) is None}
    rows = {label: metrics for label, metrics in rows.items() if metrics}
    if not rows:
        raise ValueError("columns has no scores, expected those of a trajectory at least")
    size = (width * len(columns) + 1.2, 1.9 * len(rows) + 0.5)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(rows), len(columns), sharex="col", sharey="row", squeeze=False)
    for title, ax in zip(columns, axes[0], strict=True):
        ax.set_title(title, fontsize=10)
    for (label, metrics), row_axes in zip(rows.items(), axes, strict=True):
        _draw_row(list(row_axes), list(columns.values()), metrics, label)
        for ax in row_axes:
            ax.label_outer()
        # A shade or a mark may be in one column alone.
        handles = [handle for ax in row_axes for handle in ax.get_legend_handles_labels()[0]]
        styles.draw_legend(row_axes[-1], "beside", handles)
    return figure


def _chosen(kind: str | None, scores: Mapping[str, Any]) -> str:
    """A kind that has scores; ValueError if it has none or, of None, several have."""
    there = [name for name in KINDS if of_kind(name, scores)]
    unknown = [name for name in scores if metric_kind(name) is None]
    if unknown:
        metrics = ", ".join(metric for each in KINDS.values() for metric in each.metrics)
        raise ValueError(f"scores has {unknown[0]!r}, expected some of {metrics}")
    if kind is None and len(there) > 1:
        text = f"scores are of several kinds: choose kind={' or '.join(map(repr, there))}"
        raise ValueError(f"{text}, or draw them all with figure_scores")
    return one_of("kind", there[0] if kind is None else kind, there)


def _draw_row(
    axes: Sequence[Axes], columns: Sequence[TrajectoryScores], metrics: Sequence[str], label: str
) -> None:
    """The scores of these metrics along each trajectory, on axes that share their scale.

    What is infinite is in a band at the top of the axes, in a row of marks for each metric.
    """
    drawn = [{name: data.scores.get(name, np.empty(0)) for name in metrics} for data in columns]
    endless = [name for name in metrics if any(np.isposinf(of[name]).any() for of in drawn)]
    bands = [data.bands.get(name, np.empty(0)).ravel() for data in columns for name in metrics]
    values = np.concatenate([*(each for of in drawn for each in of.values()), *bands])
    *heights, border = styles.room_for_infinity(axes[0].yaxis, values, len(endless))
    height = dict(zip(endless, heights, strict=True))
    for ax, data in zip(axes, columns, strict=True):
        for name in metrics:
            if name in data.scores:
                _draw_band(ax, data, name)
                _draw_scores(ax, data.frames, data.scores[name], name, height.get(name, np.nan))
        if data.captured is not None:
            styles.shade_frames(ax, data.frames, ~data.captured, "not captured")
        if data.captured_any is not None:
            styles.shade_frames(ax, data.frames, ~data.captured_any, "no object captured")
        if endless:
            ax.axhline(border, color="0.3", linewidth=0.8, gid="band")
        ax.margins(y=0.12)
        if is_likelihood(metrics[0]):
            ax.set_ylim(-0.05, 1.05)
        ax.set(xlabel="frame" if data.times is None else "time [s]", ylabel=label)
        styles.light_grid(ax)


def _draw_scores(ax: Axes, times: Floats, values: Floats, name: str, height: float) -> None:
    """A line through what is finite; dashed, with rings, for at least one object."""
    style = styles.metric_style(name)
    missing = int(np.isnan(values).sum())
    ring, label = name.endswith(ANY), name + (f" ({missing} missing)" if missing else "")
    fill, dashes = ("white", "--") if ring else (style.color, "-")
    every = None if len(values) <= MARKED else slice(0)
    look = style.look(linestyle=dashes, linewidth=1.2, markerfacecolor=fill, markevery=every)
    styles.draw_bounded(ax, times, values, label, height, endless=f"{name}: no escape", **look)


def _draw_band(ax: Axes, data: TrajectoryScores, name: str) -> None:
    """Between the quantiles of a score; what is infinite ends at the largest finite one."""
    ends = data.bands.get(name, np.empty(0))
    finite = ends[np.isfinite(ends)]
    if len(finite):
        low, high = np.minimum(ends, finite.max()).T
        label = f"{name}: {BAND[0]:g} to {BAND[1]:g} quantile"
        look: dict[str, Any] = {"color": styles.metric_style(name).color, "alpha": 0.25}
        ax.fill_between(data.frames, low, high, linewidth=0, label=label, **look)


LINE = 0.15  # inch, of a title
PANEL = 2.9  # inch, width of one


def one_of_each(dataset: Dataset) -> dict[str, int]:
    """A failed and a successful trajectory of a dataset, with an end as clear as can be."""
    chosen, every = {}, list(enumerate(dataset.trajectories))
    for name, success in (("failed", False), ("successful", True)):
        of_kind = {t: one.captured[-1] == success for t, one in every if one.success == success}
        if of_kind:
            chosen[name] = max(of_kind, key=lambda t: of_kind[t])  # the first of the clear ones
    return chosen


def figure_along(dataset: Dataset, labelled: LabelledScores) -> Figure:
    """The scores along a failed and a successful trajectory."""
    columns = {}
    for name, t in one_of_each(dataset).items():
        times = dataset.trajectories[t].times
        columns[f"{name} trajectory"] = trajectory_scores(labelled, t, times=times)
    return figure_scores(columns)


def figure_trees(dataset: Dataset, nodes: int, seed: int) -> Figure:
    """Search trees in three frames of a failed and of a successful trajectory, a third of it apart.

    The trees, and so their scores, are those that the dataset gets from these nodes and this seed.
    """
    rows: dict[str, list[_Panel]] = {}
    states = []
    for name, t in one_of_each(dataset).items():
        trajectory, first = dataset.trajectories[t], int(dataset.lengths[:t].sum())
        count = len(trajectory)
        frames = sorted({0, count // 3, 2 * count // 3})
        problems = dataset.problems([first + frame for frame in frames])
        rows[name] = []
        for frame, problem in zip(frames, problems, strict=True):
            of_state: dict[str, Any] = {"nodes": nodes, "seed": stream(seed, first + frame)}
            score = capture_score(problem, warn=False, **of_state)
            rows[name].append(_Panel(float(trajectory.times[frame]), problem, score))
        states.append(trajectory.states)
    plane = plane_of(tasks.make(dataset.task, **dataset.parameters))
    return _figure(rows, plane, view_of(problems[0].scene, np.concatenate(states), plane))


class _Panel(NamedTuple):
    time: float
    problem: Problem
    score: CaptureScore


def _figure(rows: Mapping[str, Sequence[_Panel]], plane: Plan, limits: Limits) -> Figure:
    """Panels without gaps between them, and a colour bar and a legend for all."""
    panels = [panel for row in rows.values() for panel in row]
    most = max(most_cost(panel.problem, panel.score.tree) for panel in panels)
    highest = max(float(panel.score.tree.costs.max()) for panel in panels)
    lines = max(score_title(panel.score).count("\n") + 3 for panel in panels)
    columns = max(map(len, rows.values()))
    (x0, x1), (y0, y1) = limits
    height = PANEL * (y1 - y0) / (x1 - x0) + LINE * lines
    size = (PANEL * columns + 1.2, height * len(rows) + 0.7)
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    axes = figure.subplots(len(rows), columns, sharex=True, sharey=True, squeeze=False)
    look: dict[str, Any] = {"plane": plane, "limits": limits, "most": most, "path": False}
    for (name, row), row_axes in zip(rows.items(), axes, strict=True):
        for panel, ax in zip(row, row_axes, strict=False):
            plot_state(panel.problem, panel.score, ax=ax, color_bar=False, ghosts=3, **look)
            ax.set_title(f"t = {panel.time:.2f} s\n{score_title(panel.score)}", fontsize=9)
            ax.label_outer()
        row_axes[0].set_ylabel(f"{name}\n{plane[1]} [m]")
    draw_color_bar(figure, axes, Normalize(0.0, most), highest, shrink=0.7, pad=0.015)
    crosses = any(lost_objects(panel.problem, panel.score.tree.states).any() for panel in panels)
    handles = state_legend(panels[0].problem, tree=crosses)
    looks: dict[str, Any] = {"ncols": len(handles), "frameon": False, "fontsize": LEGEND_SIZE}
    figure.legend(handles=handles, loc="outside lower center", **looks)
    return figure
