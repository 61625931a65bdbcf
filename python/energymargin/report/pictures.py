"""A state with its search tree, as a picture that is part of the page."""

from __future__ import annotations

import base64
import io

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from energymargin import plots
from energymargin._core import CaptureProbability, Problem
from energymargin.outlines import Plan
from energymargin.plots.styles import LEGEND_SIZE
from energymargin.report.grown import Grown

__all__ = ["picture"]

WIDTH = 5.4  # inch
HEIGHTS = (3.0, 7.5)  # inch
BESIDE, AROUND = 1.6, 1.7  # inch, that colour bar and legend take of the width and of the height
CURVE = 2.4  # inch, of the height of a probability's curve
RESOLUTION = 130  # dots an inch
COLORS = 256


def picture(grown: Grown, plane: Plan) -> str:
    """A data URI of a picture, with a legend. Of a probability it is the undisturbed future, and
    the curve below it."""
    if isinstance(grown.search, CaptureProbability):
        made = _of_probability(grown.problem, grown.search, plane)
    else:
        made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
        ax = made.subplots()
        plots.plot_state(grown.problem, grown.search, ax, plane=plane, legend=True)
        _move_legend_below(ax, made)
        made.set_size_inches(WIDTH, _height(ax))
    return f"data:image/png;base64,{base64.b64encode(_png(made)).decode()}"


def _of_probability(problem: Problem, found: CaptureProbability, plane: Plan) -> Figure:
    made = Figure(figsize=(WIDTH, HEIGHTS[1]), dpi=RESOLUTION, layout="constrained")
    rows = made.add_gridspec(2)
    ax, curve = made.add_subplot(rows[0]), made.add_subplot(rows[1])
    plots.plot_future(problem, ax, plane=plane, legend=True)
    _move_legend_below(ax, made)
    plots.plot_probability(found, curve, which="captured" if found.any is None else "any")
    height = _height(ax)
    rows.set_height_ratios((height - AROUND, CURVE))
    made.set_size_inches(WIDTH, height + CURVE)
    return made


def _move_legend_below(ax: Axes, figure: Figure) -> None:
    """From the axes to the figure, which makes room for it."""
    legend = ax.get_legend()
    assert legend is not None  # it was asked for
    names = [text.get_text() for text in legend.get_texts()]
    handles = [handle for handle in legend.legend_handles if handle is not None]
    legend.remove()
    figure.legend(
        handles, names, loc="outside lower center", ncols=3, frameon=False, fontsize=LEGEND_SIZE
    )


def _height(ax: Axes) -> float:
    """Of a figure that leaves its axes, whose scales are equal, no room to spare."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    height = (WIDTH - BESIDE) * (y1 - y0) / (x1 - x0) + AROUND
    return min(max(height, HEIGHTS[0]), HEIGHTS[1])


def _png(figure: Figure) -> bytes:
    """A third of the bytes of matplotlib's own: these pictures have few colours."""
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", bbox_inches="tight")
    Image.open(drawn).convert("RGB").quantize(COLORS).save(small, format="png", optimize=True)
    return small.getvalue()
