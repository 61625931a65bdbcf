"""How much it can take: where it holds, margins of several quantities, and a line in a plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from energymargin.act.critical import CriticalValue
from energymargin.act.limits import CriticalCurve, CriticalValues
from energymargin.act.quantities import Scale
from energymargin.look.plots import styles

TIGHTEST, OTHERS = "tab:orange", "tab:blue"
LINE = 0.42  # inch, of a quantity
WITHOUT = {"everywhere": "holds in the whole range", "nowhere": "does not hold in the range"}
"""What is said of a quantity without a crossing."""


def plot_critical_value(limit: CriticalValue, *, ax: Axes | None = None) -> Axes:
    """The probability at the values that were tried, between what it can be by what is known, and
    each crossing with its interval.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than a
    CriticalValue.
    """
    values, low, high = limit.outcomes.T
    ax = styles.axes_or_new(ax, 6.0, 3.2)
    band: dict[str, Any] = {"facecolor": (styles.CAPTURED_COLOR, 0.35), "linewidth": 1.2}
    band["edgecolor"] = styles.CAPTURED_COLOR
    ax.fill_between(values, low, high, label="share of the draws that hold", **band)
    ax.axhline(limit.probability, color="0.4", linewidth=0.8, linestyle=":")
    for k, (value, first, last, side) in enumerate(limit.crossings):
        ax.axvspan(first, last, color="0.5", alpha=0.3, linewidth=0)
        name = f"holds {side} {_with_unit(value, limit.unit)}"
        ax.axvline(value, color=f"C{k}", linewidth=1.2, label=name)
    ax.set(xlabel=_axis(limit.quantity, limit.unit), ylabel="probability", ylim=(-0.05, 1.05))
    ax.set_xlim(*limit.range)
    _by_ratio(ax, "x", limit.range)
    styles.light_grid(ax)
    styles.draw_legend(ax)
    return ax


def plot_critical_values(limits: CriticalValues, *, ax: Axes | None = None) -> Axes:
    """A tornado: how far each quantity's nominal value is from where it fails, as a share of
    itself, the tightest one on top; the interval is a thin line.

    A quantity that holds in the whole range that was asked is a pale bar from edge to edge. Returns
    `ax`, or the axes of a new figure. Raises ValueError on another thing than CriticalValues.
    """
    rows = sorted(zip(limits, limits.nominals, limits.margins, strict=True), key=_by_margin)
    ax = styles.axes_or_new(ax, 6.4, 1.2 + LINE * len(limits))
    marks = [_marks(one, nominal) for one, nominal, _ in rows]
    edge = 1.15 * max([1e-3, *(abs(share) for row in marks for _, *at in row for share in at)])
    for number, (one, _, _) in enumerate(rows):
        color = TIGHTEST if one is limits.tightest else OTHERS
        for value, at, *ends in marks[number]:
            ax.barh(number, at, height=0.55, color=color, alpha=0.8)
            ax.plot(ends, [number, number], color="0.15", linewidth=1.4)
            ax.annotate(_with_unit(value, one.unit), (at, number), **_beside(at))
        if not one.crossings:
            if one.side == "everywhere":
                ax.barh(number, 2 * edge, left=-edge, height=0.55, color=color, alpha=0.15)
            said = WITHOUT.get(one.side, "not known")
            ax.annotate(said, (0, number), ha="center", va="center", fontsize=8)
    ax.axvline(0.0, color="0.2", linewidth=0.9)
    names = [f"{one.quantity}\nnow {_with_unit(nominal, one.unit)}" for one, nominal, _ in rows]
    ax.set_yticks(range(len(rows)), names, fontsize=8)
    ax.set(xlim=(-edge, edge), ylim=(len(rows) - 0.5, -0.5))
    ax.xaxis.set_major_formatter(lambda share, _: f"{share:+.0%}")
    ax.set_xlabel(f"change until less than {limits[0].probability:.0%} hold")
    styles.light_grid(ax)
    return ax


def plot_critical_curve(curve: CriticalCurve, *, ax: Axes | None = None) -> Axes:
    """The line between held and lost in the plane of two quantities, with its band; where it holds
    is shaded.

    Returns `ax`, or the axes of a new figure. Raises ValueError on another thing than a
    CriticalCurve.
    """
    one = curve.found[0]
    ax = styles.axes_or_new(ax, 5.4, 3.8)
    low, high = curve.band.T
    kind = f"{curve.confidence:.0%} band"
    ax.fill_between(curve.values, low, high, color="0.5", alpha=0.4, linewidth=0, label=kind)
    ax.plot(curve.values, curve.curve, "o-", color="tab:blue", markersize=3, label="critical value")
    sides = {each.side for each in curve.found} & {"above", "below"}
    if len(sides) == 1:
        of, to = one.range if sides == {"above"} else one.range[::-1]
        held: dict[str, Any] = {"color": styles.CAPTURED_COLOR, "alpha": 0.2, "linewidth": 0}
        there = [
            of if each.side == "everywhere" else to if np.isnan(each.value) else each.value
            for each in curve.found
        ]
        ax.fill_between(curve.values, there, to, label=f"{one.probability:.0%} hold", **held)
    ax.set(xlabel=_axis(curve.quantity, curve.unit), ylabel=_axis(one.quantity, one.unit))
    ax.set(xlim=(curve.values[0], curve.values[-1]), ylim=one.range)
    _by_ratio(ax, "x", (curve.values[0], curve.values[-1]))
    _by_ratio(ax, "y", one.range)
    styles.light_grid(ax)
    styles.draw_legend(ax)
    return ax


Row = tuple[CriticalValue, float, float]


def _by_margin(row: Row) -> float:
    return np.inf if np.isnan(row[2]) else row[2]


def _marks(one: CriticalValue, nominal: float) -> list[tuple[float, ...]]:
    """The value of each crossing, and how far it and the ends of its interval are from the nominal
    value, as shares of that, or of the range where it is 0."""
    size = abs(nominal) or one.range[1] - one.range[0]
    return [(v, *((at - nominal) / size for at in (v, *ends))) for v, *ends, _ in one.crossings]


def _beside(at: float) -> dict[str, Any]:
    """Where the value of a bar is written."""
    to = 4 if at >= 0 else -4
    side = "left" if at >= 0 else "right"
    place = {"xytext": (to, 9), "textcoords": "offset points"}
    return {**place, "ha": side, "va": "center", "fontsize": 7}


def _by_ratio(ax: Axes, axis: str, ends: tuple[float, float]) -> None:
    """Makes an axis logarithmic if its values were searched by ratios."""
    if Scale.of(ends).by_ratio:
        (ax.set_xscale if axis == "x" else ax.set_yscale)("log")


def _axis(quantity: str, unit: str) -> str:
    return f"{quantity} [{unit}]" if unit else quantity


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip()
