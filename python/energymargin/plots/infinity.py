"""A band for infinite scores at the top of axes whose numbers end below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import AutoLocator, NullLocator, ScalarFormatter
from numpy.typing import NDArray

from energymargin.metrics import ANY, of_kind
from energymargin.plots.series import Along
from energymargin.plots.styles import metric_style

__all__ = ["draw_endless"]

ROW = 0.11  # of the axes' height: of a row of marks
AROUND = 0.1  # of what is finite: free above and below it, under the band


def draw_endless(axes: Sequence[Axes], columns: Sequence[Along], kind: str) -> None:
    """A band for infinity at the top of axes that share their scale, with a row of marks a metric.

    What is finite stays below it, and so do the numbers on the y axis.
    """
    given = [(name, values) for data in columns for name, values in data.scores.items()]
    names = of_kind(kind, [name for name, values in given if np.isposinf(values).any()])
    drawn = of_kind(kind, dict(given))
    values = np.concatenate([np.empty(0), *(each for name, each in given if name in drawn)])
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


def _mark_endless(ax: Axes, data: Along, name: str, height: float) -> None:
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
