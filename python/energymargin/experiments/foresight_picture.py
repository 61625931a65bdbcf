"""The picture of `foresight`: AUC by horizon, and reliability, a column a task."""

from __future__ import annotations

from typing import Any

from energymargin.experiments.foresight_text import (
    HORIZONS,
    LEARNED,
    NAMES,
    NO_PROBABILITY,
    SCRIPT,
    Foresight,
    TaskForesight,
)
from energymargin.plots.styles import CHANCE_COLOR, PALETTE, LineStyle, light_grid

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_foresight"]

SHOWN = ("capture", "effort/est", "hold", SCRIPT, LEARNED, "ceiling")
STYLES = dict(zip(SHOWN, PALETTE, strict=False))


def figure_foresight(result: Foresight) -> Figure:
    """Above: AUC against the horizon. Below: what happened against the probability, in bins."""
    columns = len(result.tasks)
    figure = Figure(figsize=(2.5 * columns + 0.6, 5.6), dpi=200, layout="constrained")
    axes = figure.subplots(2, columns, squeeze=False, sharey="row")
    for number, task in enumerate(result.tasks):
        _draw_auc(axes[0, number], task)
        _draw_reliability(axes[1, number], task)
    axes[0, 0].set_ylabel("AUC")
    axes[1, 0].set_ylabel("share that stayed captured")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=3, frameon=False, handlelength=3.2
    )
    return figure


def _draw_auc(ax: Axes, task: TaskForesight) -> None:
    for name, style in STYLES.items():
        cells = {h: cell for h, cell in task.cells.get(name, {}).items() if cell}
        aucs = [cell.auc for cell in cells.values()]
        ax.plot(list(cells), aucs, **_look(style), linewidth=1.3, label=NAMES[name])
    ax.set_title(task.task)
    ax.set_xlim(min(HORIZONS) - 0.3, max(HORIZONS) + 0.3)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("horizon [frames]")
    light_grid(ax)


def _draw_reliability(ax: Axes, task: TaskForesight) -> None:
    ax.plot([0, 1], [0, 1], color=CHANCE_COLOR, linewidth=0.8)
    for name, style in STYLES.items():
        if name in NO_PROBABILITY or name not in task.scores:
            continue
        found = task.reliability(name, task.last)
        if found is None:
            continue
        ax.plot(found.predicted, found.happened, **_look(style), linewidth=1.0)
    ax.set_xlabel(f"probability, {task.last} frames")
    ax.set_aspect("equal")
    light_grid(ax)


def _look(style: LineStyle) -> dict[str, Any]:
    return {
        "color": style.color,
        "linestyle": style.dashes,
        "marker": style.marker,
        "markersize": 4,
    }
