"""What all plots of a report share: how a score looks, and how a figure gets into the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import plotly.graph_objects as go
from matplotlib.ticker import MaxNLocator
from plotly.io import to_json

from energymargin.metrics import ANY
from energymargin.plots.styles import metric_style

__all__ = [
    "CAPTURED_COLOR",
    "GUIDE_COLOR",
    "LOST_COLOR",
    "Choice",
    "Plot",
    "figure",
    "look",
    "round_numbers",
]

CAPTURED_COLOR = "#0072B2"
LOST_COLOR = "#D55E00"
GUIDE_COLOR = "#8c959f"  # of lines that are no data, on light and on dark ground
BAR = 30  # px at the top of a figure, of its title and its tool bar, which covers what is there
WIDTH = 2.0  # px, of a line
_SYMBOLS = {  # of matplotlib, and what they are called here
    "o": "circle",
    "s": "square",
    "^": "triangle-up",
    "D": "diamond",
    "v": "triangle-down",
    "P": "cross",
    "X": "x",
}


class Look(NamedTuple):
    """How a score is drawn: as in `energymargin.plots`. That of at least one object is thin, with
    open marks."""

    color: str
    symbol: str
    dash: str
    width: float


class Choice(NamedTuple):
    """One of several figures at the same place."""

    group: str
    text: str


@dataclass(frozen=True, eq=False)
class Plot:
    """A place in the page where a figure is drawn."""

    name: str
    label: str
    """What it shows, for who cannot see it."""
    figures: Sequence[go.Figure]
    choices: Sequence[Choice] = field(default_factory=list)
    """One for each figure, if there are several."""
    chooser: str = "Show"
    """The name of the choice."""
    follows: str = ""
    """The plot whose choice it follows, if it has none of its own."""
    height: int = 420
    """[px]"""

    def to_json(self) -> str:
        """The figures, safe within a script of the page."""
        return f"[{','.join(_json(one) for one in self.figures)}]"

    def groups(self) -> dict[str, list[tuple[int, str]]]:
        """The choices with their numbers, by group."""
        groups: dict[str, list[tuple[int, str]]] = {}
        for number, choice in enumerate(self.choices):
            groups.setdefault(choice.group, []).append((number, choice.text))
        return groups


def look(metric: str) -> Look:
    """How a metric is drawn."""
    style = metric_style(metric)
    symbol, dash = _SYMBOLS[style.marker], _dash(style.dashes)
    if metric.endswith(ANY):
        return Look(style.color, f"{symbol}-open", dash, WIDTH / 2)
    return Look(style.color, symbol, dash, WIDTH)


def figure(height: int, title: str = "", **layout: Any) -> go.Figure:
    """An empty figure of so many pixels: at its top the title, below it the legend, and below that
    the plot, which gives way to a legend of several lines. Its colours of text and grid are the
    page's, which knows if it is dark; so is what is black."""
    return go.Figure(
        layout={
            "template": "none",
            "margin": {"l": 62, "r": 12, "t": BAR + 26, "b": 52},
            "hoverlabel": {"align": "left"},
            "title": {
                **{"text": title, "x": 0, "xref": "paper", "font": {"size": 14}},
                **{"y": 1, "yanchor": "top", "pad": {"t": 6}},
            },
            "legend": {
                **{"orientation": "h", "x": 0, "xref": "paper"},
                **{"yref": "container", "yanchor": "top", "y": 1 - BAR / height},
            },
            **layout,
        }
    )


def round_numbers(low: float, high: float) -> list[float]:
    """A few from `low` to `high`, for the ticks of an axis."""
    return [float(t) for t in MaxNLocator(4).tick_values(low, high) if low <= t <= high]


def _dash(dashes: str | tuple[int, tuple[float, ...]]) -> str:
    """A pattern of matplotlib, in pixels."""
    if isinstance(dashes, str):
        return "solid"
    return ",".join(f"{WIDTH * length:g}px" for length in dashes[1])


def _json(one: go.Figure) -> str:
    return str(to_json(one, validate=False)).replace("<", "\\u003c")
