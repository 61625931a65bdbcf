"""How well scores predict labels: ROC, and precision over recall."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from energymargin.checks import yes_or_no
from energymargin.evaluation import Among, LabelledScores, curves
from energymargin.evaluation.curves import (
    CAPTURED,
    OneLabelError,
    Target,
    metrics_against,
    target_name,
)
from energymargin.evaluation.labelled import HORIZON, LAST_FRAMES
from energymargin.metrics import ANY
from energymargin.plots.styles import (
    CHANCE_COLOR,
    axes_or_new,
    draw_legend,
    light_grid,
    metric_style,
)
from energymargin.plots.trajectories import Scores, labelled_scores
from energymargin.table_text import short

__all__ = ["plot_precision_recall", "plot_roc"]

Curve = TypeVar("Curve", curves.Roc, curves.PrecisionRecall)
SIZE = (6.0, 4.0)  # inch


def plot_roc(
    scores: Scores,
    *,
    ax: Axes | None = None,
    metrics: Sequence[str] | None = None,
    target: Target = CAPTURED,
    horizon: int = HORIZON,
    last: int = LAST_FRAMES,
    among: Among = "all",
    legend: bool = True,
) -> Axes:
    """ROC of several metrics, with AUC as of `evaluate` in the legend, and the line of chance.

    A metric without scores, or with one label alone, has no curve: the legend says so.

    Args:
        scores: with their labels: in memory, of a run of a store, or a file of scores that has one
            run, open or by its path.
        ax: the axes. None makes a figure.
        metrics: None takes all that `evaluate` compares with the target.
        target: "captured", over a `horizon` of frames, or "success" of whole trajectories by their
            `last` frames.
        horizon: frames that the label "captured" looks ahead.
        last: frames at the end of a trajectory whose scores count for "success".
        among: "all" states, or those that are "captured" now.
        legend: whether there is a legend: inside `ax`, or beside the axes of a new figure.

    Returns:
        `ax`, or the axes of a new figure.

    Raises:
        ValueError: as `curves.roc` does, or if the file has several runs.
        FileNotFoundError: if there is no such file.
    """
    labelled = labelled_scores(scores)
    yes_or_no("legend", legend)
    found, lacking = _curves(
        labelled,
        metrics,
        target,
        lambda metric: curves.roc(
            labelled, metric, target=target, horizon=horizon, last=last, among=among
        ),
    )
    inside = None if ax is None else "lower right"
    ax = axes_or_new(ax, *SIZE)
    ax.plot([0, 1], [0, 1], ":", color=CHANCE_COLOR, linewidth=1.0, label="chance .500")
    for metric, curve in found.items():
        label = f"{metric} {short(curve.auc)}"
        _draw(ax, curve.false_positive_rate, curve.true_positive_rate, metric, label)
    _finish(ax, lacking, target_name(target, horizon, last))
    if legend:
        draw_legend(ax, inside, "AUC")
    ax.set(xlabel="false positive rate [0..1]", ylabel="true positive rate [0..1]")
    return ax


def plot_precision_recall(
    scores: Scores,
    *,
    ax: Axes | None = None,
    metrics: Sequence[str] | None = None,
    target: Target = CAPTURED,
    horizon: int = HORIZON,
    last: int = LAST_FRAMES,
    among: Among = "all",
    legend: bool = True,
) -> Axes:
    """Precision over recall of several metrics, with AP in the legend, and the line of chance.

    The curve is drawn as steps, so that the area below it is AP. A metric without scores, or with
    one label alone, has no curve: the legend says so.

    Args:
        scores: with their labels: in memory, of a run of a store, or a file of scores that has one
            run, open or by its path.
        ax: the axes. None makes a figure.
        metrics: None takes all that `evaluate` compares with the target.
        target: "captured", over a `horizon` of frames, or "success" of whole trajectories by their
            `last` frames.
        horizon: frames that the label "captured" looks ahead.
        last: frames at the end of a trajectory whose scores count for "success".
        among: "all" states, or those that are "captured" now.
        legend: whether there is a legend: inside `ax`, or beside the axes of a new figure.

    Returns:
        `ax`, or the axes of a new figure.

    Raises:
        ValueError: as `curves.precision_recall` does, or if the file has several runs.
        FileNotFoundError: if there is no such file.
    """
    labelled = labelled_scores(scores)
    yes_or_no("legend", legend)
    found, lacking = _curves(
        labelled,
        metrics,
        target,
        lambda metric: curves.precision_recall(
            labelled, metric, target=target, horizon=horizon, last=last, among=among
        ),
    )
    inside = None if ax is None else "lower left"
    ax = axes_or_new(ax, *SIZE)
    for share in sorted({curve.positives / curve.count for curve in found.values()}):
        label = f"chance {short(share)}"
        ax.axhline(share, linestyle=":", color=CHANCE_COLOR, linewidth=1.0, label=label)
    for metric, curve in found.items():
        label = f"{metric} {short(curve.ap)}"
        _draw(ax, curve.recall, curve.steps, metric, label, steps=True)
    _finish(ax, lacking, target_name(target, horizon, last))
    if legend:
        draw_legend(ax, inside, "AP")
    ax.set(xlabel="recall [0..1]", ylabel="precision [0..1]")
    return ax


def _curves(
    labelled: LabelledScores,
    metrics: Sequence[str] | None,
    target: Target,
    curve: Callable[[str], Curve],
) -> tuple[dict[str, Curve], dict[str, str]]:
    """The curve of each metric; of the metrics that have none, why."""
    if isinstance(metrics, str):
        raise ValueError(f"metrics is {metrics!r}, expected several: [{metrics!r}]")
    chosen = metrics_against(labelled, target) if metrics is None else list(metrics)
    if not chosen:
        there = ", ".join(labelled.scores) or "none"
        raise ValueError(f"metrics is empty, expected some that have scores: {there}")
    found, lacking = {}, {}
    for metric in chosen:
        try:
            found[metric] = curve(metric)
        except OneLabelError as error:
            lacking[metric] = error.brief
    return found, lacking


def _draw(
    ax: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    metric: str,
    label: str,
    *,
    steps: bool = False,
) -> None:
    """A line in the metric's style; rings mark that of at least one object."""
    style = metric_style(metric)
    any_object = metric.endswith(ANY)
    ax.plot(
        x,
        y,
        color=style.color,
        linestyle=style.dashes,
        linewidth=1.0 if any_object else 1.6,
        drawstyle="steps-pre" if steps else "default",
        marker=style.marker if any_object else "",
        markerfacecolor="white",
        markersize=4,
        markevery=0.12,
        label=label,
    )


def _finish(ax: Axes, lacking: Mapping[str, str], target: str) -> None:
    for metric, why in lacking.items():
        ax.plot([], [], linestyle="", label=f"{metric}: {why}")
    if lacking and len(ax.get_lines()) <= len(lacking) + 1:
        ax.text(0.5, 0.5, "one label alone", ha="center", transform=ax.transAxes)
    ax.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    ax.set_title(target, fontsize=10)
    light_grid(ax)
