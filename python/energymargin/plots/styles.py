"""What all pictures share: colours, lines, and where a legend goes.

The colours can be told apart without colour vision: cividis for costs, Okabe and Ito's palette for
the rest. No two things differ in colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from energymargin.metrics import ANY

COSTS = "cividis"
CAPTURED_COLOR = "#56B4E9"
SUCCEEDED_COLOR = "#8C8C8C"
LOST_COLOR = "#D55E00"
BODY_COLORS = {"object": "#E69F00", "effector": "#009E73", "none": "#3A3A3A"}
CHANCE_COLOR = "0.55"
LEGEND_SIZE = 8  # points
BELOW = 34.0  # points that the numbers and the name of the x axis are high
TOP = 0.95  # of the height of axes: where marks stand for infinity

Dashes = tuple[int, tuple[float, ...]]


class LineStyle(NamedTuple):
    """How a line looks; it differs from others without its colour too."""

    color: str
    dashes: str | Dashes
    marker: str


PALETTE = (
    LineStyle("#0072B2", "-", "o"),
    LineStyle("#D55E00", (0, (5, 1.5)), "s"),
    LineStyle("#009E73", (0, (1, 1)), "^"),
    LineStyle("#CC79A7", (0, (5, 1.5, 1, 1.5)), "D"),
    LineStyle("#000000", (0, (8, 2, 1, 2, 1, 2)), "v"),
    LineStyle("#E69F00", (0, (2, 1)), "P"),
    LineStyle("#56B4E9", (0, (10, 2)), "X"),
)
METRICS = dict(
    zip(
        (
            *("capture", "effort/est", "effort/rrt", "success", "force"),
            *("probability", "probability/success"),
        ),
        PALETTE,
        strict=True,
    )
)


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
    if not isinstance(ax, Axes):
        raise ValueError(f"ax is {ax!r}, expected a matplotlib Axes or None")
    if ax.name != "rectilinear":
        raise ValueError(f"ax is {ax.name!r}, expected a matplotlib Axes with straight x and y")
    return ax


def draw_legend(
    ax: Axes,
    inside: str | None,
    title: str | None = None,
    *,
    entries: Mapping[str, Artist] | None = None,
    anchor: tuple[float, float] = (1.03, 1.0),
) -> None:
    """A legend `inside` the axes, at that corner, or for None to the right of them at `anchor`,
    over no data.

    `entries`: artists by label; None takes those of the axes. Beside axes that the caller brought
    there may be no room. There is no legend if there is nothing to name.
    """
    handles, labels = ax.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True)) if entries is None else entries
    place: dict[str, Any] = {"loc": inside, "framealpha": 0.85}
    if inside is None:
        corner = "upper left" if anchor[1] == 1.0 else "center left"
        place = {"loc": corner, "bbox_to_anchor": anchor, "frameon": False}
    if named:
        ax.legend(
            named.values(),
            named.keys(),
            **place,
            fontsize=LEGEND_SIZE,
            title=title,
            title_fontsize=LEGEND_SIZE,
            alignment="left",
            handlelength=3.2,
        )


def legend_below(
    ax: Axes, handles: Sequence[Artist], *, columns: int = 2, title: str | None = None
) -> None:
    """A legend below the label of the x axis, where no data are."""
    figure = ax.get_figure()
    assert figure is not None
    below = ScaledTranslation(0.0, -BELOW / 72, figure.dpi_scale_trans)
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + below,
        ncols=columns,
        frameon=False,
        fontsize=LEGEND_SIZE,
        title=title,
        title_fontsize=LEGEND_SIZE,
    )


def shade_frames(
    ax: Axes, times: NDArray[np.float64], shaded: NDArray[np.bool_], label: str
) -> None:
    """A band about each shaded frame, reaching half-way to its neighbours; about the only one, half
    a unit to both sides. The label is in the legend once."""
    middles = (times[1:] + times[:-1]) / 2
    alone = 0.5 if len(times) == 1 else 0.0
    borders = np.concatenate([times[:1] - alone, middles, times[-1:] + alone])
    for number, k in enumerate(np.flatnonzero(shaded)):
        ax.axvspan(
            *(borders[k], borders[k + 1]),
            facecolor=LOST_COLOR,
            alpha=0.15,
            label=None if number else label,
        )


def draw_bounded(
    ax: Axes,
    x: NDArray[Any],
    y: NDArray[np.float64],
    label: str,
    *,
    endless: str = "_nolegend_",
    **style: Any,
) -> None:
    """A line of what is finite; what is infinite are triangles, labelled `endless`, at the top."""
    finite, infinite = np.isfinite(y), np.isposinf(y)
    ax.plot(x, np.where(finite, y, np.nan), label=label if finite.any() else "_nolegend_", **style)
    if infinite.any():
        ax.plot(
            x[infinite],
            np.full(infinite.sum(), TOP),
            color=style["color"],
            linestyle="",
            marker="^",
            markersize=4,
            transform=ax.get_xaxis_transform(),
            label=endless,
        )


def light_grid(ax: Axes) -> None:
    """Lines that help to read values."""
    ax.grid(alpha=0.25, linewidth=0.5)


def joules(energy: float) -> str:
    """An energy in words, such as "0.0123 J"."""
    return f"{energy:.3g} J" if math.isfinite(energy) else "infinite"


def nodes_in_words(nodes: int) -> str:
    """How many, such as "1 node"."""
    return f"{nodes} node{'s' * (nodes != 1)}"
