"""ROC, and precision over recall, of all scores; and their histograms by label."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from energymargin.evaluation import LabelledScores
from energymargin.evaluation.curves import (
    CAPTURED,
    SUCCESS,
    OneLabelError,
    PrecisionRecall,
    Roc,
    Target,
    Wrongness,
    metrics_against,
    precision_recall,
    roc,
    target_name,
)
from energymargin.evaluation.labelled import HORIZONS
from energymargin.metrics import axis_label, is_likelihood, unit
from energymargin.report.plots import (
    CAPTURED_COLOR,
    GUIDE_COLOR,
    LOST_COLOR,
    Choice,
    Plot,
    figure,
    look,
    round_numbers,
)

__all__ = ["curves", "distributions", "visible"]

FEW = 400  # points of a curve that are all drawn
FINE = 1 / 400  # of an axis; smaller differences cannot be seen
MARKED = 60  # points of a curve that are drawn as such
HEIGHT = 500  # px
GUESSING = {"color": GUIDE_COLOR, "dash": "dot", "width": 1}

BINS = 20
HISTOGRAM_HEIGHT = 316  # px
FEW_SCORES = 1  # percent of the scores at either end that may lie outside of the bins' range
LOOKS = {True: (CAPTURED_COLOR, ""), False: (LOST_COLOR, "/")}  # by label


def curves(labelled: LabelledScores, horizon: int, last: int) -> list[Plot]:
    """The two plots; none if there are no labels of both kinds."""
    horizons = [horizon, *(h for h in HORIZONS if h != horizon)]
    targets = [(CAPTURED, h) for h in horizons] + [(SUCCESS, horizon)]
    found = []
    for target, h in targets:
        metrics = _told_apart(labelled, target, h, last)
        if metrics:
            name = Choice("", target_name(target, h, last))
            pairs = [
                (
                    roc(labelled, m, target=target, horizon=h, last=last),
                    precision_recall(labelled, m, target=target, horizon=h, last=last),
                )
                for m in metrics
            ]
            found.append(
                (name, _roc(metrics, [a for a, _ in pairs]), _pr(metrics, [b for _, b in pairs]))
            )
    if not found:
        return []
    names = [name for name, _, _ in found]
    return [
        Plot(
            name="roc",
            label="ROC of each score",
            figures=[one for _, one, _ in found],
            choices=names,
            chooser="Held against",
            height=HEIGHT,
        ),
        Plot(
            name="pr",
            label="Precision over recall of each score",
            figures=[one for _, _, one in found],
            choices=names,
            follows="roc",
            height=HEIGHT,
        ),
    ]


def _told_apart(labelled: LabelledScores, target: Target, horizon: int, last: int) -> list[str]:
    """The metrics whose labels are of both kinds."""
    metrics = []
    for metric in metrics_against(labelled, target):
        with suppress(OneLabelError):
            roc(labelled, metric, target=target, horizon=horizon, last=last)
            metrics.append(metric)
    return metrics


def _roc(metrics: Sequence[str], found: Sequence[Roc]) -> go.Figure:
    made = _square("ROC", "false positive rate (0 to 1)", "true positive rate (0 to 1)")
    for metric, one in zip(metrics, found, strict=True):
        x, y = one.false_positive_rate, one.true_positive_rate
        made.add_trace(_line(metric, f"AUC {one.auc:.3f}", x, y, one.threshold))
    made.add_trace(_guessing([(0.0, 1.0)]))
    return made


def _pr(metrics: Sequence[str], found: Sequence[PrecisionRecall]) -> go.Figure:
    made = _square("Precision over recall", "recall (0 to 1)", "precision (0 to 1)")
    for metric, one in zip(metrics, found, strict=True):
        line = _line(metric, f"AP {one.ap:.3f}", one.recall, one.steps, one.threshold)
        line.line.shape = "vh"  # each step at the height of its end: below them the area is AP
        made.add_trace(line)
    shares = {one.positives / one.count for one in found}  # two, of several objects
    made.add_trace(_guessing([(share, share) for share in sorted(shares)]))
    return made


def _square(title: str, x: str, y: str) -> go.Figure:
    axis = {"range": [-0.01, 1.015], "dtick": 0.2, "zeroline": False}
    return figure(
        HEIGHT,
        title,
        xaxis={"title": {"text": x}, **axis},
        yaxis={"title": {"text": y}, **axis},
    )


def _line(
    metric: str,
    value: str,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    threshold: NDArray[np.float64],
) -> go.Scatter:
    """A curve, whose tips have the threshold."""
    shown = visible(x, y)
    color, symbol, dash, width = look(metric)
    axes = (
        ("false positives", "true positives")
        if value.startswith("AUC")
        else ("recall", "precision")
    )
    return go.Scatter(
        x=x[shown],
        y=y[shown],
        customdata=[_at_least(one, unit(metric)) for one in threshold[shown]],
        name=f"{metric} ({value})",
        mode="lines+markers" if len(shown) <= MARKED else "lines",
        line={"color": color, "dash": dash, "width": width},
        marker={"symbol": symbol, "size": 4, "color": color},
        hovertemplate=f"<b>{metric}</b> %{{customdata}}<br>{axes[0]} %{{x:.3f}}<br>"
        f"{axes[1]} %{{y:.3f}}<extra></extra>",
    )


def visible(x: NDArray[np.float64], y: NDArray[np.float64]) -> list[int]:
    """The points of a curve within 0 to 1 that the eye can tell apart.

    Each point that is away from the last visible one, and the point before it; all, if few.
    """
    if len(x) <= FEW:
        return list(range(len(x)))
    shown, (x0, y0) = [0], (x[0], y[0])
    for k, (x1, y1) in enumerate(zip(x.tolist(), y.tolist(), strict=True)):
        if abs(x1 - x0) >= FINE or abs(y1 - y0) >= FINE:
            shown += [k - 1, k] if shown[-1] < k - 1 else [k]
            x0, y0 = x1, y1
    return shown if shown[-1] == len(x) - 1 else [*shown, len(x) - 1]


def _at_least(threshold: float, unit: str) -> str:
    """Which scores count as positive."""
    if np.isnan(threshold):
        return "none counts as positive"
    if np.isposinf(threshold):
        return "no escape found (infinite)"
    return f"≥ {threshold:.4g} {unit}".rstrip()


def _guessing(lines: Sequence[tuple[float, float]]) -> go.Scatter:
    """What a score without any knowledge gets: lines from 0 to 1, with gaps between them."""
    return go.Scatter(
        x=[0.0, 1.0, None] * len(lines),
        y=[height for low, high in lines for height in (low, high, None)],
        name="guessing",
        mode="lines",
        line=GUESSING,
        hoverinfo="skip",
    )


def distributions(every: list[Wrongness]) -> list[Plot]:
    """A histogram of each metric that has scores."""
    return [
        Plot(
            name=f"histogram-{number}",
            label=f"Histogram of {one.metric} by label",
            figures=[_histogram(one)],
            height=HISTOGRAM_HEIGHT,
        )
        for number, one in enumerate(every)
        if len(one.compared.scores)
    ]


def _histogram(one: Wrongness) -> go.Figure:
    """Bars of both labels side by side; infinity has a place of its own at the right end."""
    scores = one.compared.scores
    finite = scores[np.isfinite(scores)]
    low, high = (0.0, 1.0) if is_likelihood(one.metric) else _range(finite)
    edges = np.linspace(low, high, BINS + 1)
    made = figure(
        HISTOGRAM_HEIGHT,
        one.metric,
        barmode="overlay",
        bargap=0.05,
        yaxis={"title": {"text": "share of that label [%]"}, "rangemode": "tozero"},
    )
    axis: dict[str, Any] = {"title": {"text": axis_label(one.metric)}}
    endless = high + 2 * (edges[1] - edges[0])
    if np.isposinf(scores).any():
        ticks = round_numbers(low, high)
        axis |= {"tickvals": [*ticks, endless], "ticktext": [*(f"{t:.3g}" for t in ticks), "∞"]}
    made.update_layout(xaxis=axis)
    for label in (True, False):
        made.add_trace(_bars(one, label, edges, endless))
    return made


def _bars(one: Wrongness, label: bool, edges: NDArray[np.float64], endless: float) -> go.Bar:
    """Of the scores with one label."""
    name, (color, pattern) = one.words(label).one, LOOKS[label]
    scores = one.compared.scores[one.compared.labels == label]
    finite = scores[np.isfinite(scores)]
    counts, _ = np.histogram(finite.clip(edges[0], edges[-1]), edges)
    places = (edges[1:] + edges[:-1]) / 2
    ranges = _range_texts(edges, finite, unit(one.metric))
    infinite = int(np.isposinf(scores).sum())
    if infinite:
        counts, places = np.append(counts, infinite), np.append(places, endless)
        ranges.append("no escape found")
    return go.Bar(
        x=places,
        y=100 * counts / max(1, len(scores)),
        width=edges[1] - edges[0],
        customdata=[[where, int(count)] for where, count in zip(ranges, counts, strict=True)],
        name=f"{name} ({len(scores)})",
        marker={
            "color": color,
            "opacity": 0.6,
            "line": {"color": color, "width": 1},
            "pattern": {
                "shape": pattern,
                "fgcolor": "white",
                "fillmode": "overlay",
                "solidity": 0.15,
            },
        },
        hovertemplate=f"<b>{name}</b><br>%{{customdata[0]}}<br>%{{customdata[1]}} of {len(scores)} "
        "(%{y:.3g} %)<extra></extra>",
    )


def _range(finite: NDArray[np.float64]) -> tuple[float, float]:
    """Of the bins: a few scores far away go into the last ones."""
    if not len(finite):
        return 0.0, 1.0
    low, high = np.percentile(finite, [FEW_SCORES, 100 - FEW_SCORES])
    low = min(0.0, float(low))
    return (low, float(high)) if high > low else (low, low + 1.0)


def _range_texts(edges: NDArray[np.float64], finite: NDArray[np.float64], unit: str) -> list[str]:
    """Which scores are in each bin."""
    texts = [f"{low:.3g} to {high:.3g} {unit}" for low, high in pairwise(edges)]
    if len(finite) and finite.min() < edges[0]:
        texts[0] = f"{edges[1]:.3g} {unit} or less"
    if len(finite) and finite.max() > edges[-1]:
        texts[-1] = f"{edges[-2]:.3g} {unit} or more"
    return texts
