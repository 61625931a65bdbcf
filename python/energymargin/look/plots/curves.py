"""How well scores predict labels: ROC, precision over recall, and histograms by label."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.ticker import MaxNLocator

from energymargin.base.aliases import Floats
from energymargin.base.metrics import ANY, axis_label, is_likelihood
from energymargin.base.table_text import short
from energymargin.look.plots import styles
from energymargin.look.plots.trajectories import Scores, labelled_scores
from energymargin.records.evaluation import Among, LabelledScores, curves
from energymargin.records.evaluation.labelled import HORIZON, LAST_FRAMES

Curve = curves.Roc | curves.PrecisionRecall
SIZE = (6.0, 4.0)  # inch
BINS = 20
FAR = 1  # percent of the scores at either end that may lie outside of the bins' range
LABEL_STYLES = {True: (styles.PALETTE[0].color, ""), False: (styles.LOST_COLOR, "///")}


def plot_roc(
    scores: Scores,
    *,
    ax: Axes | None = None,
    metrics: Sequence[str] | None = None,
    target: curves.Target = curves.CAPTURED,
    frames: int = HORIZON,
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
        target: "captured", over so many `frames`, or "success" of whole trajectories by their
            `last` frames.
        frames: frames that the label "captured" looks ahead.
        last: frames at the end of a trajectory whose scores count for "success".
        among: "all" states, or those that are "captured" now.
        legend: whether there is a legend: inside `ax`, or beside the axes of a new figure.

    Returns:
        `ax`, or the axes of a new figure.

    Raises:
        ValueError: as `curves.roc` does, or if the file has several runs.
        FileNotFoundError: if there is no such file.
    """
    return _plot(curves.roc, **locals())


def plot_precision_recall(
    scores: Scores,
    *,
    ax: Axes | None = None,
    metrics: Sequence[str] | None = None,
    target: curves.Target = curves.CAPTURED,
    frames: int = HORIZON,
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
        target: "captured", over so many `frames`, or "success" of whole trajectories by their
            `last` frames.
        frames: frames that the label "captured" looks ahead.
        last: frames at the end of a trajectory whose scores count for "success".
        among: "all" states, or those that are "captured" now.
        legend: whether there is a legend: inside `ax`, or beside the axes of a new figure.

    Returns:
        `ax`, or the axes of a new figure.

    Raises:
        ValueError: as `curves.precision_recall` does, or if the file has several runs.
        FileNotFoundError: if there is no such file.
    """
    return _plot(curves.precision_recall, **locals())


def plot_distribution(one: curves.Wrongness, ax: Axes) -> None:
    """Histograms of a metric's scores with either label, in percent of those with that label.

    Infinite scores have a bar of their own at the right end; a few scores far away are in the
    first and the last bin.
    """
    scores, labels = one.compared.scores, one.compared.labels
    edges = np.linspace(*_range(one.metric, scores[np.isfinite(scores)]), BINS + 1)
    width = edges[1] - edges[0]
    places = np.append(edges[:-1] + width / 2, edges[-1] + 2 * width)
    for label, (color, hatch) in LABEL_STYLES.items():
        own = scores[labels == label]
        counts, _ = np.histogram(own[np.isfinite(own)].clip(edges[0], edges[-1]), edges)
        heights = np.append(counts, np.isposinf(own).sum()) * 100 / max(1, len(own))
        look: dict[str, Any] = {"color": to_rgba(color, 0.45), "edgecolor": color, "hatch": hatch}
        label_text = f"{one.words(label)} ({len(own)})"
        ax.bar(places, heights, 0.95 * width, linewidth=0.6, label=label_text, **look)
    if np.isposinf(scores).any():
        ticks = [tick for tick in MaxNLocator(4).tick_values(*edges[[0, -1]]) if tick <= edges[-1]]
        ax.set_xticks([*ticks, edges[-1] + 2 * width], [*(f"{t:.3g}" for t in ticks), "∞"])
    ax.set_xlim(edges[0] - width, edges[-1] + width * (3.0 if np.isposinf(scores).any() else 1.0))
    ax.set(xlabel=axis_label(one.metric), ylabel="share of that label [%]")
    styles.light_grid(ax)
    styles.draw_legend(ax)


def _range(metric: str, finite: Floats) -> tuple[float, float]:
    """Where the bins begin and end."""
    if is_likelihood(metric) or not len(finite):
        return 0.0, 1.0
    low, high = np.percentile(finite, [FAR, 100 - FAR])
    low = min(0.0, float(low))
    return (low, float(high)) if high > low else (low, low + 1.0)


def _chosen(
    labelled: LabelledScores, metrics: Sequence[str] | None, target: curves.Target
) -> Sequence[str]:
    if isinstance(metrics, str):
        raise ValueError(f"metrics is {metrics!r}, expected several: [{metrics!r}]")
    chosen = curves.metrics_against(labelled, target) if metrics is None else metrics
    if not chosen:
        there = ", ".join(labelled.scores) or "none"
        raise ValueError(f"metrics is empty, expected some that have scores: {there}")
    return chosen


def _plot(
    curve: Callable[..., Curve],
    scores: Scores,
    *,
    ax: Axes | None,
    metrics: Sequence[str] | None,
    legend: bool,
    **terms: Any,
) -> Axes:
    """The curve of each metric, or in the legend why it has none; rings mark that of at least one
    object."""
    labelled, found, lacking = labelled_scores(scores), dict[str, Curve](), dict[str, str]()
    for metric in _chosen(labelled, metrics, terms["target"]):
        try:
            found[metric] = curve(labelled, metric, **terms)
        except curves.OneLabelError as error:
            lacking[metric] = error.brief
    is_roc = curve is curves.roc
    title, corner = ("AUC", "lower right") if is_roc else ("AP", "lower left")
    chance: dict[str, Any] = {"linestyle": ":", "color": styles.CHANCE_COLOR, "linewidth": 1.0}
    with styles.curve_axes(ax, SIZE, corner, legend=legend, title=title) as axes:
        if is_roc:
            axes.plot([0, 1], [0, 1], label="chance .500", **chance)
            axes.set(xlabel="false positive rate [0..1]", ylabel="true positive rate [0..1]")
        else:
            for share in sorted({each.positives / each.count for each in found.values()}):
                axes.axhline(share, label=f"chance {short(share)}", **chance)
            axes.set(xlabel="recall [0..1]", ylabel="precision [0..1]")
        for metric, each in found.items():
            if isinstance(each, curves.Roc):
                x, y, area = each.false_positive_rate, each.true_positive_rate, each.auc
            else:
                x, y, area = each.recall, each.steps, each.ap
            style = styles.metric_style(metric)
            look = style.look(linewidth=1.6, marker="")
            if metric.endswith(ANY):
                look = style.look(linewidth=1.0, markerfacecolor="white", markevery=0.12)
            steps = "default" if is_roc else "steps-pre"
            axes.plot(x, y, drawstyle=steps, label=f"{metric} {short(area)}", **look)
        for metric, why in lacking.items():
            axes.plot([], [], linestyle="", label=f"{metric}: {why}")
        if not found:
            axes.text(0.5, 0.5, "one label alone", ha="center", transform=axes.transAxes)
        axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
        title = curves.target_name(terms["target"], terms["frames"], terms["last"])
        axes.set_title(title, fontsize=10)
    return axes
