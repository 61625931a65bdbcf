"""A state as an image, for `render`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem

if TYPE_CHECKING:
    from energymargin.outlines import Plan

__all__ = ["picture"]

DPI = 100
DETAIL = 80  # cells of the sets; a film needs no more


def picture(
    problem: Problem, plane: Plan, seen: NDArray[np.float64], title: str
) -> NDArray[np.uint8]:
    """The bodies and sets of a problem in a plane, shape (height, width, 3).

    The view is that of the states `seen`, shape (K, n). Raises ImportError without matplotlib.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from energymargin.outlines import view_of
    from energymargin.plots import plot_state

    figure = Figure(figsize=(6.0, 5.0), dpi=DPI)
    canvas: Any = FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    plot_state(
        problem,
        ax=ax,
        plane=plane,
        limits=view_of(problem.scene, seen, plane, around=0.25),
        detail=DETAIL,
    )
    ax.set_title(title, fontsize=10)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
