"""The probability of staying captured, over the horizon."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from energymargin._core import CaptureProbability, Survival
from energymargin.checks import one_of, yes_or_no
from energymargin.plots.styles import (
    LineStyle,
    axes_or_new,
    curve_style,
    draw_legend,
    light_grid,
)

__all__ = ["plot_probability"]

BAND = 0.15  # opacity
SETS = ("captured", "any")


def plot_probability(
    results: CaptureProbability | Mapping[str, CaptureProbability],
    ax: Axes | None = None,
    *,
    which: str = "captured",
    confidence: float = 0.95,
    legend: bool = True,
) -> Axes:
    """Probability of having been captured throughout, over time [s], of one result or of several
    by name, as steps.

    The band about a curve is the interval of Clopper and Pearson at each time, for that time
    alone. A mark on it is at the mean time captured; a dotted line is where the object leaves if
    nothing disturbs it. `which`: "captured", all objects, or "any", at least one, of results with
    by_object=True. The legend, with the values at the horizon, is inside of `ax`, or beside the
    axes of a new figure.

    Returns `ax`, or the axes of a new figure. Raises ValueError on what is no CaptureProbability,
    on a result that lacks `which`, or a confidence that is not between 0 and 1.
    """
    named = _checked(results)
    one_of("which", which, SETS)
    yes_or_no("legend", legend)
    bands = {name: result.band(confidence, which) for name, result in named.items()}
    inside = None if ax is None else "best"
    ax = axes_or_new(ax, 6.0, 3.6)
    for number, (name, result) in enumerate(named.items()):
        style = curve_style(number)
        low, high = bands[name]
        ax.fill_between(
            result.times, low, high, step="post", color=style.color, alpha=BAND, linewidth=0
        )
        stopped = "" if result.complete else ", stopped early"
        value = f"{_survival(result, which).captured:.2f} ({low[-1]:.2f} to {high[-1]:.2f})"
        _draw(ax, result, which, style, f"{name}: {value}{stopped}")
    _explain(ax, named, which)
    most = max(float(result.times[-1]) for result in named.values())
    ax.set(xlim=(0.0, 1.03 * most), ylim=(-0.03, 1.03))
    ax.set(xlabel="time [s]", ylabel="captured until then [0..1]")
    light_grid(ax)
    if legend:
        draw_legend(ax, inside)
    return ax


def _checked(
    results: CaptureProbability | Mapping[str, CaptureProbability],
) -> dict[str, CaptureProbability]:
    if isinstance(results, CaptureProbability):
        return {"captured": results}
    if not (isinstance(results, Mapping) and results):
        raise ValueError(
            f"results is {results!r}, expected a CaptureProbability, or several by name"
        )
    for name, result in results.items():
        if not isinstance(result, CaptureProbability):
            raise ValueError(f"results has {result!r} as {name!r}, expected a CaptureProbability")
    return dict(results)


def _survival(result: CaptureProbability, which: str) -> CaptureProbability | Survival:
    """What has a curve, a mean time, and the probability at the horizon."""
    return result if which == "captured" or result.any is None else result.any


def _draw(ax: Axes, result: CaptureProbability, which: str, style: LineStyle, label: str) -> None:
    """The curve, its mean time, and where it ends undisturbed."""
    survival = _survival(result, which)
    ax.step(
        result.times,
        survival.curve,
        where="post",
        color=style.color,
        linestyle=style.dashes,
        linewidth=1.5,
        label=label,
    )
    at = int((result.times <= survival.mean_time).sum()) - 1
    ax.plot(
        survival.mean_time,
        survival.curve[at],
        color=style.color,
        marker=style.marker,
        markeredgecolor="white",
        markersize=7,
        linestyle="",
        zorder=4,
        gid="mean time",
    )
    if which == "captured" and not result.undisturbed:
        ax.axvline(
            result.undisturbed_time, color=style.color, linestyle=":", linewidth=1.3, gid="leaves"
        )


def _explain(ax: Axes, results: Mapping[str, CaptureProbability], which: str) -> None:
    """What mark and dotted line mean, in the legend; with the number, if it is but one."""
    alone = next(iter(results.values())) if len(results) == 1 else None
    time = ""
    if alone is not None:
        time = f", {_survival(alone, which).mean_time:.3g} s"
    mark = Line2D([], [], color="0.3", marker="o", linestyle="", label=f"mean time captured{time}")
    ax.add_line(mark)
    if which == "captured" and not all(result.undisturbed for result in results.values()):
        time = "" if alone is None else f" at {alone.undisturbed_time:.3g} s"
        ax.add_line(Line2D([], [], color="0.3", linestyle=":", label=f"leaves undisturbed{time}"))
