"""A state, and where the objects go from there if nothing disturbs them."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from energymargin._core import Problem
from energymargin.checks import yes_or_no
from energymargin.outlines import Limits, Plan, object_centers, plane_for, view_of
from energymargin.plots.bodies import draw_ghost
from energymargin.plots.legends import draw_state_legend, state_legend
from energymargin.plots.sets import leaving_objects
from energymargin.plots.states import AROUND, plot_state
from energymargin.plots.styles import LOST_COLOR, axes_or_new
from energymargin.undisturbed import Undisturbed, undisturbed

__all__ = ["plot_future"]

SIZE = (6.0, 4.5)  # inch
PATH: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.8, "zorder": 8}
EXIT: dict[str, Any] = {
    **{"color": LOST_COLOR, "marker": "D", "markersize": 6, "linestyle": ""},
    **{"markeredgecolor": "white", "zorder": 9},
}


def plot_future(
    problem: Problem,
    ax: Axes | None = None,
    *,
    plane: Plan | None = None,
    limits: Limits | None = None,
    legend: bool | None = None,
) -> Axes:
    """The state of a problem with a horizon, and the undisturbed future from there.

    A line is where the objects' centres go while the robot follows its plan, and the bodies are
    drawn once more, half transparent, as they are at the horizon. A diamond is where the objects
    leave the capture set; the sets are those of the state, which may go along with the effector.
    `plane`, `limits` [m] and `legend` as of `plot_state`.

    Returns `ax`, or the axes of a new figure. Raises ValueError on a problem without a horizon, and
    RuntimeError if the simulation diverges.
    """
    future = undisturbed(problem)
    plane = plane_for(problem.scene, future.states) if plane is None else plane
    if limits is None:
        limits = view_of(problem.scene, future.states, plane, AROUND)
    new = ax is None
    legend = new if legend is None else yes_or_no("legend", legend)
    ax = plot_state(problem, ax=axes_or_new(ax, *SIZE), plane=plane, limits=limits, legend=False)
    _draw(ax, problem, future, plane)
    ax.set_title(_title(future), fontsize=10)
    if legend:
        handles = [*state_legend(problem, tree=False), *_lines(future)]
        draw_state_legend(ax, handles, own_figure=new)
    return ax


def _draw(ax: Axes, problem: Problem, future: Undisturbed, plane: Plan) -> None:
    draw_ghost(ax, problem.scene, future.states[-1], plane)
    leaves = future.exit_moment
    left = leaving_objects(problem, future)
    for number, center in enumerate(object_centers(problem.scene, plane)):
        ax.add_line(Line2D(*future.states[:, center].T, **PATH, gid="undisturbed"))
        if leaves is not None and left[number]:
            x, y = future.states[leaves, center]
            ax.add_line(Line2D([x], [y], **EXIT, gid="exit"))


def _title(future: Undisturbed) -> str:
    if future.exit is None:
        return f"undisturbed it stays captured for {future.times[-1]:.3g} s"
    return f"undisturbed it leaves at {future.exit:.3g} s"


def _lines(future: Undisturbed) -> list[Line2D]:
    exits = [] if future.exit is None else [Line2D([], [], **EXIT, label="where it leaves")]
    return [Line2D([], [], **PATH, label="undisturbed path"), *exits]
