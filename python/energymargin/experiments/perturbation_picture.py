"""The picture of `perturbation`: AP against the scaled largest error."""

from __future__ import annotations

from energymargin.experiments.perturbation import FORCE, PAPER, Perturbation
from energymargin.experiments.perturbation_errors import KINDS

try:
    from matplotlib.figure import Figure
except ImportError as error:
    raise ImportError("pictures need matplotlib: pip install 'energymargin[plots]'") from error

__all__ = ["figure_perturbation"]

# Colours of Okabe and Ito, and markers, which the paper's grey curves share.
STYLES = {
    "friction": ("#0072B2", "o"),
    "velocity": ("#E69F00", "s"),
    "position": ("#009E73", "^"),
    FORCE: ("#D55E00", "D"),
}
PAPER_COLOR = "0.65"


def figure_perturbation(result: Perturbation) -> Figure:
    """A curve for each kind of error, with the interval of its mean as a band; the paper's in grey,
    dashed."""
    figure = Figure(figsize=(6.4, 4.6), dpi=200, layout="constrained")
    ax = figure.subplots()
    for kind in KINDS:
        color, marker = STYLES[kind]
        points = result.curve(kind)
        levels = [point.level for point in points]
        name = f"{kind} (force score)" if kind == FORCE else kind
        ax.plot(
            *(levels, [point.mean for point in points]),
            color=color,
            marker=marker,
            markersize=5,
            linewidth=1.5,
            label=name,
            zorder=4,
        )
        low, high = zip(*(point.interval for point in points), strict=True)
        ax.fill_between(levels, low, high, color=color, alpha=0.2, linewidth=0, zorder=3)
        ax.plot(
            *(list(PAPER[kind]), list(PAPER[kind].values())),
            color=PAPER_COLOR,
            marker=marker,
            markersize=4,
            linestyle="--",
            linewidth=1.1,
            label=f"paper: {kind}",
            zorder=2,
        )
    ax.set_xlabel("scaled largest error (1: the whole of what the quantity is in the mean)")
    ax.set_ylabel("AP of the prediction of capture")
    ax.set_xlim(-0.03, 1.03)
    ax.set_ylim(top=1.015)
    ax.grid(alpha=0.25, linewidth=0.5)
    figure.legend(loc="outside lower center", ncols=len(KINDS), frameon=False, fontsize=8)
    return figure
