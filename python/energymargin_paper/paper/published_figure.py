"""The picture of the authors' data: AUC by horizon, and how early success is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from energymargin_paper.paper.published_parts import PROBABILITY, Part, early_auc, mean_auc
from energymargin_paper.paper.published_states import EARLY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure_published"]

LINES = (
    ("theirs", "capture", "capture, theirs"),
    ("ours", "capture", "capture, ours"),
    ("ours", PROBABILITY, "probability, ours"),
)


def figure_published(simulated: Sequence[Part], recorded: Sequence[Part]) -> Figure:
    """A panel for each simulated part, one for the recordings, one for early success: states that
    are captured now."""
    from matplotlib.figure import Figure

    panels: list[tuple[str, Sequence[Part]]] = [(part.name, [part]) for part in simulated]
    if recorded:
        panels.append(("recordings, smoothed labels", recorded))
    columns = len(panels) + bool(recorded)
    figure = Figure(figsize=(2.6 * columns + 0.6, 3.2), dpi=200, layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False, sharey=True)[0]
    for ax, (title, parts) in zip(axes, panels, strict=False):
        _draw(ax, title, parts)
    if recorded:
        _draw_early(axes[-1], recorded)
    axes[0].set_ylabel("AUC, captured now")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(ax: Axes, title: str, parts: Sequence[Part]) -> None:
    from energymargin.look.plots.styles import PALETTE

    kind = "recorded" if parts[0].simulated else "smoothed"
    horizons = [h for h in parts[0].horizons if h > 0]
    for (side, score, label), style in zip(LINES, PALETTE, strict=False):
        cells = [[part.cell(side, score, h, "captured", kind) for part in parts] for h in horizons]
        values = [mean_auc(of) for of in cells]
        ax.plot(horizons, values, label=label, **style.look())
    _finish(ax, title, "horizon [frames]")


def _draw_early(ax: Axes, recorded: Sequence[Part]) -> None:
    from energymargin.look.plots.styles import PALETTE

    places = range(len(EARLY))
    for name, style in (("success", PALETTE[0]), (PROBABILITY, PALETTE[2])):
        ax.plot(EARLY, [early_auc(recorded, name, place) for place in places], **style.look())
    _finish(ax, "recordings: success known early", "frame of the last 100")


def _finish(ax: Axes, title: str, xlabel: str) -> None:
    from energymargin.look.plots.styles import CHANCE_COLOR, light_grid

    ax.axhline(0.5, color=CHANCE_COLOR, linestyle=":", linewidth=1.0)
    ax.set(xlabel=xlabel, ylim=(0.4, 1.02))
    ax.set_title(title, fontsize=9)
    light_grid(ax)
