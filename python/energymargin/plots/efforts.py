"""How the effort of escape falls as a search goes on."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from energymargin._core import EscapeEffort
from energymargin.checks import yes_or_no
from energymargin.plots.styles import (
    CHANCE_COLOR,
    axes_or_new,
    curve_style,
    draw_legend,
    joules,
    light_grid,
    nodes_in_words,
)

__all__ = ["plot_effort"]

BESIDE = 0.03  # of the width from one node to the most: free on both sides, where a mark may be


def plot_effort(
    results: EscapeEffort | Mapping[str, EscapeEffort],
    ax: Axes | None = None,
    *,
    known: float | None = None,
    legend: bool = True,
) -> Axes:
    """Best effort of escape [J] against nodes, of one search or of several by name, as steps.

    `known` is the right answer [J], where there is one: a line. A search that found no escape is
    named in the legend, without a line; so is one that was stopped. The legend is inside of `ax`,
    or beside the axes of a new figure. Up to 49 curves look different without their colours, too.

    Returns `ax`, or the axes of a new figure. Raises ValueError on what is no EscapeEffort, or a
    `known` effort that is not a finite number of at least 0.
    """
    searches = _checked(results)
    known = None if known is None else _energy("known", known)
    yes_or_no("legend", legend)
    inside = None if ax is None else "best"
    ax = axes_or_new(ax, 6.0, 3.6)
    for number, (name, result) in enumerate(searches.items()):
        _draw(ax, name, result, number)
    if known is not None:
        ax.axhline(known, linestyle=":", color=CHANCE_COLOR, label=f"known: {joules(known)}")
    if all(math.isinf(result.effort) for result in searches.values()):
        ax.text(0.5, 0.5, "no escape found", ha="center", transform=ax.transAxes)
        if known is None:
            ax.set_yticks([])
    most = max(2, *(result.nodes for result in searches.values()))
    ax.set_xscale("log")
    ax.set_xlim(most**-BESIDE, most ** (1 + BESIDE))
    ax.set(xlabel="nodes of the search tree", ylabel="best effort of escape [J]")
    light_grid(ax)
    if legend:
        draw_legend(ax, inside)
    return ax


def _checked(results: EscapeEffort | Mapping[str, EscapeEffort]) -> dict[str, EscapeEffort]:
    if isinstance(results, EscapeEffort):
        return {"search": results}
    if not (isinstance(results, Mapping) and results):
        raise ValueError(f"results is {results!r}, expected an EscapeEffort, or several by name")
    for name, result in results.items():
        if not isinstance(result, EscapeEffort):
            raise ValueError(f"results has {result!r} as {name!r}, expected an EscapeEffort")
    return dict(results)


def _energy(name: str, value: float) -> float:
    number = isinstance(value, (int, float, np.integer, np.floating))
    if not number or isinstance(value, bool) or not 0 <= value < math.inf:
        raise ValueError(f"{name} is {value!r}, expected a finite number of at least 0 [J]")
    return float(value)


def _draw(ax: Axes, name: str, result: EscapeEffort, number: int) -> None:
    """Steps from the first escape on, which go on to the last node."""
    style = curve_style(number)
    stopped = "" if result.complete else ", stopped early"
    if not result.history:
        label = f"{name}: no escape in {nodes_in_words(result.nodes)}{stopped}"
        ax.plot([], [], linestyle="", marker=style.marker, color=style.color, label=label)
        return
    nodes, efforts = _steps(result)
    ax.step(
        nodes,
        efforts,
        where="post",
        color=style.color,
        linestyle=style.dashes,
        linewidth=1.4,
        marker=style.marker,
        markersize=4,
        markevery=range(len(nodes) - 1),
        label=f"{name}: {joules(result.effort)}{stopped}",
    )


def _steps(result: EscapeEffort) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and efforts; what is known before the first node is drawn at it."""
    nodes, efforts = np.array(result.history, dtype=float).T
    nodes = np.maximum(nodes, 1.0)
    return np.append(nodes, max(result.nodes, nodes[-1])), np.append(efforts, efforts[-1])
