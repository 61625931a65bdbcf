"""The picture of what scores foresee: AUC by horizon, and reliability."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from energymargin_paper.evidence.foresight_task import NAMES, TaskForesight
from energymargin_paper.probabilities import HORIZONS, LEARNED, SCRIPT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure_foresight"]

SHOWN = ("capture", "effort/est", "hold", SCRIPT, LEARNED, "ceiling")


def figure_foresight(tasks: Sequence[TaskForesight]) -> Figure:
    """Above: AUC against the horizon. Below: what happened against the probability, in bins."""
    from matplotlib.figure import Figure

    columns = len(tasks)
    figure = Figure(figsize=(2.5 * columns + 0.6, 5.6), dpi=200, layout="constrained")
    axes = figure.subplots(2, columns, squeeze=False, sharey="row")
    for number, task in enumerate(tasks):
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
    from matplotlib.ticker import MaxNLocator

    from energymargin.look.plots.styles import PALETTE, light_grid

    for name, style in zip(SHOWN, PALETTE, strict=False):
        cells = {h: cell for h, cell in task.cells.get(name, {}).items() if cell}
        aucs = [cell.auc for cell in cells.values()]
        ax.plot(list(cells), aucs, **style.look(linewidth=1.3), label=NAMES[name])
    ax.set_title(task.task)
    ax.set_xlim(min(HORIZONS) - 0.3, max(HORIZONS) + 0.3)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("horizon [frames]")
    light_grid(ax)


def _draw_reliability(ax: Axes, task: TaskForesight) -> None:
    from energymargin.look.plots.styles import CHANCE_COLOR, PALETTE, light_grid

    ax.plot([0, 1], [0, 1], color=CHANCE_COLOR, linewidth=0.8)
    for name, style in zip(SHOWN, PALETTE, strict=False):
        found = task.reliability(name, task.last) if name in task.scores else None
        if found is not None:
            ax.plot(found.predicted, found.happened, **style.look(linewidth=1.0))
    ax.set_xlabel(f"probability, {task.last} frames")
    ax.set_aspect("equal")
    light_grid(ax)
