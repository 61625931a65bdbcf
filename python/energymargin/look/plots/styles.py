"""What all pictures share: colours, lines, and where a legend goes.

The colours can be told apart without colour vision: cividis for costs, Okabe and Ito's palette for
the rest. No two things differ in colour alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from energymargin.base.aliases import Floats, Mask
from energymargin.base.checks import check_type, yes_or_no
from energymargin.base.metrics import ANY, TIMED

COSTS = "cividis"
CAPTURED_COLOR = "#56B4E9"
SUCCEEDED_COLOR = "#8C8C8C"
LOST_COLOR = "#D55E00"
BODY_COLORS = {"object": "#E69F00", "effector": "#009E73", "none": "#3A3A3A"}
CHANCE_COLOR = "0.55"
LEGEND_SIZE = 8  # points
BELOW = 34.0  # points that the numbers and the name of the x axis are high
LONGEST, MOST_LINES = 32, 3  # letters and lines of a name
AROUND = 0.1  # of the finite values: free at their ends, before the marks of infinity
ROW = 0.16  # of the finite values: of a row of these marks

Dashes = tuple[int, tuple[float, ...]]


class LineStyle(NamedTuple):
    """How a line looks; it differs from others without its colour too."""

    color: str
    dashes: str | Dashes
    marker: str

    def look(self, **others: Any) -> dict[str, Any]:
        """Keywords of a line that is plotted; `others` change some."""
        shape = {"color": self.color, "linestyle": self.dashes, "marker": self.marker}
        return {**shape, "linewidth": 1.4, "markersize": 3.5, **others}


PALETTE = (
    LineStyle("#0072B2", "-", "o"),
    LineStyle("#D55E00", (0, (5, 1.5)), "s"),
    LineStyle("#009E73", (0, (1, 1)), "^"),
    LineStyle("#CC79A7", (0, (5, 1.5, 1, 1.5)), "D"),
    LineStyle("#000000", (0, (8, 2, 1, 2, 1, 2)), "v"),
    LineStyle("#E69F00", (0, (2, 1)), "P"),
    LineStyle("#56B4E9", (0, (10, 2)), "X"),
)
STYLED = ("capture", "effort/est", "effort/rrt", "success", "force", *list(TIMED)[:2])
METRICS = dict(zip(STYLED, PALETTE, strict=True)) | {"effort": LineStyle("#882255", "-", "*")}


def metric_style(metric: str) -> LineStyle:
    """That of a metric, the same in every picture; "/any" has that of its metric for all."""
    return METRICS.get(metric.removesuffix(ANY), PALETTE[-1])


def curve_style(number: int) -> LineStyle:
    """That of one curve of many: no two of 49 have both their dashes and their marker in common."""
    row, column = divmod(number, len(PALETTE))
    dashes = PALETTE[(column + row) % len(PALETTE)].dashes
    marker = PALETTE[(column + 2 * row) % len(PALETTE)].marker
    return LineStyle(PALETTE[column].color, dashes, marker)


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """`ax`, or those of a new figure of pyplot, `width` by `height` inch; ValueError if neither."""
    if ax is None:
        from matplotlib import pyplot  # slow to load, and of no use to who brings the axes

        return pyplot.figure(figsize=(width, height), layout="constrained").add_subplot()
    check_type("ax", ax, Axes, "a matplotlib Axes or None")
    if ax.name != "rectilinear":
        raise ValueError(f"ax is {ax.name!r}, expected a matplotlib Axes with straight x and y")
    return ax


@contextmanager
def curve_axes(
    ax: Axes | None, size: tuple[float, float], corner: str, *, legend: bool, title: str = ""
) -> Iterator[Axes]:
    """`ax`, or those of a new figure of `size` [inch]; drawn in, they get a grid and a legend.

    The legend is in a corner of `ax`, or beside the axes of a new figure.
    """
    yes_or_no("legend", legend)
    axes = axes_or_new(ax, *size)
    yield axes
    light_grid(axes)
    if legend:
        draw_legend(axes, "beside" if ax is None else corner, title=title)


def draw_legend(
    ax: Axes, place: str = "best", handles: Iterable[Artist] | None = None, **options: Any
) -> None:
    """A legend in a corner of the axes or, over no data, "beside" or "below" them.

    `handles`: labelled artists, of which each label is named once; None takes those of the axes.
    Around axes that the caller brought there may be no room. Without a label there is no legend.
    """
    looks: dict[str, Any] = {"loc": place, "framealpha": 0.85, "handlelength": 3.2}
    if place == "beside":
        looks |= {"loc": "upper left", "bbox_to_anchor": (1.03, 1.0), "frameon": False}
    if place == "below":
        below = ScaledTranslation(0.0, -BELOW / 72, ax.figure.dpi_scale_trans)
        looks = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "frameon": False}
        looks |= {"bbox_transform": ax.transAxes + below, "ncols": 2}
    artists = ax.get_legend_handles_labels()[0] if handles is None else handles
    named = {str(artist.get_label()): artist for artist in artists}
    if named:
        sizes = {"fontsize": LEGEND_SIZE, "title_fontsize": LEGEND_SIZE}
        ax.legend(named.values(), named.keys(), alignment="left", **sizes, **looks | options)


def folded(text: str) -> str:
    """A name of up to 32 letters in a line, three lines at most: without its middle if it is
    longer. A dollar sign begins no mathematics."""
    most = LONGEST * MOST_LINES - MOST_LINES
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-(most // 2) :]}"
    return "\n".join(wrap(text, LONGEST)[:MOST_LINES]).replace("$", r"\$")


def shade_frames(ax: Axes, times: Floats, shaded: Mask, label: str) -> None:
    """A band about each shaded frame, reaching half-way to its neighbours; about the only one, half
    a unit to both sides. The label is in the legend once."""
    middles = (times[1:] + times[:-1]) / 2
    alone = 0.5 if len(times) == 1 else 0.0
    borders = np.concatenate([times[:1] - alone, middles, times[-1:] + alone])
    for number, k in enumerate(np.flatnonzero(shaded)):
        look: dict[str, Any] = {"facecolor": LOST_COLOR, "alpha": 0.15}
        ax.axvspan(borders[k], borders[k + 1], label=None if number else label, **look)


def room_for_infinity(axis: XAxis | YAxis, values: Floats, rows: int = 1) -> list[float]:
    """Scales an axis such that rows of marks, which stand for infinity, have room beyond the finite
    values; returns where these rows are, from the end on, and the border before them.

    The axis keeps its scale if no value is infinite, and has no ticks without any value.
    """
    finite = values[np.isfinite(values)]
    if not np.isposinf(values).any():
        if not len(finite):
            axis.set_ticks([])
        return [np.nan] * (rows + 1)
    transform = axis.get_transform()
    ends = np.array([finite.min(), finite.max()]) if len(finite) else np.ones(2)
    low, high = transform.transform(ends)
    around = AROUND * ((high - low) or abs(high) or 1.0)
    low, high = low - around, (high + around if len(finite) else low - around)
    row = ROW * ((high - low) or 1.0)
    places = [*(high + row * (np.arange(rows, 0, -1) - 0.5)), high, low, high + rows * row]
    found: list[float]
    *found, start, end = transform.inverted().transform(places).tolist()
    numbers = axis.get_major_locator().tick_values(start, found[-1])
    ticks: list[float] = [tick for tick in numbers if start <= tick < found[-1]]
    labels = [*(f"{tick:.6g}" for tick in ticks), "∞"]
    axis.set_ticks([*ticks, float(np.mean(found[:-1]))], labels=labels)
    axis.set_ticks([], minor=True)
    axis.axes.set(**{f"{axis.axis_name}lim": (start, end)})
    return found


def draw_bounded(
    ax: Axes,
    x: NDArray[Any],
    y: Floats,
    label: str,
    height: float,
    *,
    endless: str = "_nolegend_",
    **style: Any,
) -> None:
    """A line of what is finite; what is infinite are marks, labelled `endless`, at a height, as of
    `room_for_infinity`."""
    finite, infinite = np.isfinite(y), np.isposinf(y)
    name = label if finite.any() or not infinite.any() else "_nolegend_"
    ax.plot(x, np.where(finite, y, np.nan), label=name, **style)
    if infinite.any():
        marks = style | {"linestyle": "", "markevery": None, "markersize": 5, "label": endless}
        ax.plot(x[infinite], np.full(infinite.sum(), height), **marks)


def light_grid(ax: Axes) -> None:
    """Lines that help to read values."""
    ax.grid(alpha=0.25, linewidth=0.5)
