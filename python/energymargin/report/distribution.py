"""How the scores are spread, by label."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from energymargin.metrics import axis_label, is_likelihood, unit
from energymargin.report.plots import CAPTURED_COLOR, LOST_COLOR, Plot, figure, round_numbers
from energymargin.report.wrong import Judged

__all__ = ["distributions"]

BINS = 20
HEIGHT = 316  # px
FEW = 1  # percent of the scores at either end that may lie outside of the bins' range
LOOKS = {True: (CAPTURED_COLOR, ""), False: (LOST_COLOR, "/")}  # by label


def distributions(every: list[Judged]) -> list[Plot]:
    """A histogram of each metric that has scores."""
    return [
        Plot(
            name=f"histogram-{number}",
            label=f"Histogram of {one.metric} by label",
            figures=[_figure(one)],
            height=HEIGHT,
        )
        for number, one in enumerate(every)
        if len(one.compared.scores)
    ]


def _figure(one: Judged) -> go.Figure:
    """Bars of both labels side by side; infinity has a place of its own at the right end."""
    scores = one.compared.scores
    finite = scores[np.isfinite(scores)]
    low, high = (0.0, 1.0) if is_likelihood(one.metric) else _range(finite)
    edges = np.linspace(low, high, BINS + 1)
    made = figure(
        HEIGHT,
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


def _bars(one: Judged, label: bool, edges: NDArray[np.float64], endless: float) -> go.Bar:
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
    low, high = np.percentile(finite, [FEW, 100 - FEW])
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
