"""The picture of `published`: AUC by horizon, theirs and ours, and how early success is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from energymargin.experiments.published_text import EARLY, PROBABILITY, Part, Published
from energymargin.plots.styles import CHANCE_COLOR, PALETTE, LineStyle, light_grid

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_published"]

LINES = (
    ("theirs", "capture", "capture, theirs"),
    ("ours", "capture", "capture, ours"),
    ("ours", PROBABILITY, "probability, ours"),
)


def figure_published(result: Published) -> Figure:
    """A panel for each simulated part, one for the recordings, one for early success: states that
    are captured now."""
    panels: list[tuple[str, list[Part]]] = [(part.name, [part]) for part in result.simulated]
    if result.recorded:
        panels.append(("recordings, smoothed labels", result.recorded))
    columns = len(panels) + bool(result.recorded)
    figure = Figure(figsize=(2.6 * columns + 0.6, 3.2), dpi=200, layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False, sharey=True)[0]
    for ax, (title, parts) in zip(axes, panels, strict=False):
        _draw(ax, title, parts)
    if result.recorded:
        _draw_early(axes[-1], result)
    axes[0].set_ylabel("AUC, captured now")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(ax: Axes, title: str, parts: list[Part]) -> None:
    kind = "recorded" if parts[0].simulated else "smoothed"
    horizons = [h for h in parts[0].horizons if h > 0]
    for (side, score, label), style in zip(LINES, PALETTE, strict=False):
        values = [_mean(parts, side, score, h, kind) for h in horizons]
        ax.plot(horizons, values, label=label, **_look(style))
    _finish(ax, title, "horizon [frames]")


def _draw_early(ax: Axes, result: Published) -> None:
    places = range(len(EARLY))
    for name, style in (("success", PALETTE[0]), (PROBABILITY, PALETTE[2])):
        ax.plot(EARLY, [result.early_auc(name, place) for place in places], **_look(style))
    _finish(ax, "recordings: success known early", "frame of the last 100")


def _mean(parts: list[Part], side: str, score: str, horizon: int, kind: str) -> float:
    cells = [part.cell(side, score, horizon, "captured", kind) for part in parts]
    aucs = [cell[0] for cell in cells if cell is not None]
    return float(np.mean(aucs)) if aucs else float("nan")


def _finish(ax: Axes, title: str, xlabel: str) -> None:
    ax.axhline(0.5, color=CHANCE_COLOR, linestyle=":", linewidth=1.0)
    ax.set(xlabel=xlabel, ylim=(0.4, 1.02))
    ax.set_title(title, fontsize=9)
    light_grid(ax)


def _look(style: LineStyle) -> dict[str, Any]:
    return {
        "color": style.color,
        "linestyle": style.dashes,
        "marker": style.marker,
        "markersize": 4,
    }
