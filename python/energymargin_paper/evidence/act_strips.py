"""A strip of pictures: two plans in the same held-out world, moment by moment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from energymargin._core import Problem, World as Simulated
from energymargin.look.outlines import view_of
from energymargin.look.plots.scenes import draw_bodies, draw_lost
from energymargin_paper.evidence.act_demo import HOLD, Demo, Values
from energymargin_paper.evidence.act_trials import met

__all__ = ["figure_strip"]

MOMENTS = 5
AROUND = 0.1  # of the view's longer side
WIDTH, AXES = 2.3, 0.5  # inch, of a picture, and what it needs above and below
COLUMNS = 6  # of a wrench


def figure_strip(demo: Demo, plans: Mapping[str, Values], world: int) -> Figure:
    """A row for each plan, by its name: moments from the start to the end of its motion."""
    asked = {name: met(demo, values, world) for name, values in plans.items()}
    motions = {name: _motion(problem, rows) for name, (problem, rows) in asked.items()}
    first = next(iter(asked.values()))[0]
    limits = view_of(first.scene, np.concatenate(list(motions.values())), demo.plane, AROUND)
    (x0, x1), (y0, y1) = limits
    size = (WIDTH * MOMENTS, (WIDTH * (y1 - y0) / (x1 - x0) + AXES) * len(plans))
    figure = Figure(figsize=size, dpi=120, layout="constrained")
    grid = figure.subplots(len(plans), MOMENTS, sharex=True, sharey=True, squeeze=False)
    for row, (name, states) in zip(grid, motions.items(), strict=True):
        problem = asked[name][0]
        shown = np.linspace(0, len(states) - 1, MOMENTS).round().astype(int)
        left = _left(problem, states)
        for ax, k in zip(row, shown, strict=True):
            ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
            draw_bodies(ax, problem.scene, states[k], demo.plane, limits)
            _title(ax, k * HOLD, lost=bool(left[k]))
            if left[k]:
                objects = [b.name for b in problem.scene.bodies if b.role == "object"]
                draw_lost(ax, problem.scene, states[k], demo.plane, objects)
        row[0].set_ylabel(f"{name}\n{demo.plane[1]} [m]")
    for ax in grid[-1]:
        ax.set_xlabel(f"{demo.plane[0]} [m]")
    return figure


def _title(ax: Axes, time: float, *, lost: bool) -> None:
    ax.set_title(f"{time:.2f} s" + (", lost" if lost else ""), fontsize=9)


def _left(problem: Problem, states: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each state comes after one outside of the capture set."""
    inside = np.asarray(problem.captured.contains(problem.scene, states))
    return np.asarray(np.maximum.accumulate(~inside))


def _motion(problem: Problem, rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """The states after each HOLD, and the start, shape (K, n)."""
    world, step = Simulated(problem.scene, plan=problem.plan), problem.scene.step
    size, states = round(HOLD / step), [np.asarray(problem.state)]
    for first in range(0, len(rows) - size + 1, size):
        wrench = rows[first] if rows.shape[1] == COLUMNS else rows[first].reshape(-1, COLUMNS)
        moved = world.rollout(states[-1], wrench, size * step, time=first * step)
        states.append(np.asarray(moved.state))
    return np.array(states)
