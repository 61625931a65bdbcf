"""The picture of `efficiency`: success prediction and time a state, against nodes."""

from __future__ import annotations

from energymargin.experiments.efficiency import PAPER, Efficiency

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_efficiency"]

# Label, colour of Okabe and Ito, marker, and how far the points stand aside, so that equal ones
# are both seen.
STYLES = {
    "success_auc": ("AUC", "#0072B2", "o", 0.96),
    "success_ap": ("AP", "#D55E00", "s", 1.04),
    "seconds": ("time", "#009E73", "^", 1.0),
}
PAPER_COLOR = "0.6"


def figure_efficiency(result: Efficiency) -> Figure:
    """AUC and AP on the left axis, time on the right one; the paper's in grey, dashed."""
    figure = Figure(figsize=(6.4, 4.3), dpi=200, layout="constrained")
    left = figure.subplots()
    right = left.twinx()
    for quantity in STYLES:
        ax = right if quantity == "seconds" else left
        theirs = {nodes: values[quantity] for nodes, values in PAPER.items()}
        ours = {nodes: result.mean_sd(nodes, quantity) for nodes in result.nodes}
        _draw(ax, quantity, ours, paper=False)
        _draw(ax, quantity, theirs, paper=True)
    left.set_xscale("log")
    left.set_xticks(sorted({*PAPER, *result.nodes}))
    left.xaxis.set_major_formatter("{x:g}")
    left.xaxis.set_minor_formatter(NullFormatter())
    left.set_xlabel("nodes of the search tree (the paper's iterations)")
    left.set_ylabel("AUC, AP of the success prediction")
    left.set_ylim(top=1.015)
    right.set_ylabel("time a state [s]")
    slowest = max(right.get_ylim()[1], 1e-3)
    right.set_ylim(-0.03 * slowest, 1.15 * slowest)  # below the best AUC and AP
    left.grid(alpha=0.25, linewidth=0.5)
    pairs = [ax.get_legend_handles_labels() for ax in (left, right)]
    handles = [handle for own, _ in pairs for handle in own]
    labels = [label for _, own in pairs for label in own]
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=len(STYLES),
        frameon=False,
        fontsize=9,
    )
    return figure


def _draw(ax: Axes, quantity: str, curve: dict[int, tuple[float, float]], *, paper: bool) -> None:
    """A curve of means and deviations, by nodes."""
    label, color, marker, aside = STYLES[quantity]
    means, deviations = zip(*curve.values(), strict=True)
    ax.errorbar(
        [aside * nodes for nodes in curve],
        means,
        yerr=deviations,
        color=PAPER_COLOR if paper else color,
        marker=marker,
        linestyle="--" if paper else "-",
        markersize=5,
        linewidth=1.3,
        elinewidth=0.9,
        capsize=3,
        label=f"paper: {label}" if paper else label,
        zorder=2 if paper else 3,
    )
