"""ROC, and precision over recall, of all scores; chosen by what they are held against."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from energymargin.curves import (
    CAPTURED,
    SUCCESS,
    OneLabelError,
    PrecisionRecall,
    Roc,
    Target,
    metrics_against,
    precision_recall,
    roc,
    target_name,
)
from energymargin.evaluation import LabelledScores
from energymargin.evaluation.labelled import HORIZONS
from energymargin.metrics import unit
from energymargin.report.plots import GUIDE_COLOR, Choice, Plot, figure, look

__all__ = ["curves"]

FEW = 400  # points of a curve that are all drawn
FINE = 1 / 400  # of an axis; what moves by less cannot be told apart
MARKED = 60  # points of a curve that are drawn as such
HEIGHT = 500  # px
GUESSING = {"color": GUIDE_COLOR, "dash": "dot", "width": 1}


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
    """A curve, of which the pointer tells the threshold."""
    kept = seen(x, y)
    color, symbol, dash, width = look(metric)
    axes = (
        ("false positives", "true positives")
        if value.startswith("AUC")
        else ("recall", "precision")
    )
    return go.Scatter(
        x=x[kept],
        y=y[kept],
        customdata=[_at_least(one, unit(metric)) for one in threshold[kept]],
        name=f"{metric} ({value})",
        mode="lines+markers" if len(kept) <= MARKED else "lines",
        line={"color": color, "dash": dash, "width": width},
        marker={"symbol": symbol, "size": 4, "color": color},
        hovertemplate=f"<b>{metric}</b> %{{customdata}}<br>{axes[0]} %{{x:.3f}}<br>"
        f"{axes[1]} %{{y:.3f}}<extra></extra>",
    )


def seen(x: NDArray[np.float64], y: NDArray[np.float64]) -> list[int]:
    """The points of a curve within 0 to 1 that the eye can tell apart: each that is away from the
    one kept before, and the one that it came from; all, if they are few."""
    if len(x) <= FEW:
        return list(range(len(x)))
    kept, (x0, y0) = [0], (x[0], y[0])
    for k, (x1, y1) in enumerate(zip(x.tolist(), y.tolist(), strict=True)):
        if abs(x1 - x0) >= FINE or abs(y1 - y0) >= FINE:
            kept += [k - 1, k] if kept[-1] < k - 1 else [k]
            x0, y0 = x1, y1
    return kept if kept[-1] == len(x) - 1 else [*kept, len(x) - 1]


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
