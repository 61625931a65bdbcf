"""What is said in words about a picture of a state: its title and its legend."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from energymargin._core import CaptureScore, EscapeEffort, Plane, Problem, Scene
from energymargin.plots.styles import (
    BODY_COLORS,
    CAPTURED_COLOR,
    LEGEND_SIZE,
    LOST_COLOR,
    SUCCEEDED_COLOR,
)
from energymargin.plots.trees import Escape, Result, escape_in_words, escape_line

__all__ = ["Notes", "draw_state_legend", "score_title", "state_legend", "state_title"]

MOST_NAMES = 3  # of bodies without a role
NAMES = 30  # points that the numbers and the name of the x axis are high
Notes = tuple[str, str, str]


def state_legend(
    problem: Problem,
    notes: Notes = ("", "", ""),
    *,
    tree: bool = True,
    escape: Escape | EscapeEffort | None = None,
) -> list[Patch | Line2D]:
    """What a legend of pictures of states holds, with or without the crosses of a tree, an escape.

    `notes` are put behind the names of the capture set and of the success set; the last is an entry
    of its own.
    """
    handles: list[Patch | Line2D] = [
        Patch(color=BODY_COLORS[role], alpha=0.7, label=label)
        for role, label in _bodies_by_role(problem.scene).items()
    ]
    handles.append(_set_patch(CAPTURED_COLOR, "-", "capture set" + notes[0]))
    if problem.succeeded is not None:
        handles.append(_set_patch(SUCCEEDED_COLOR, "--", "success set" + notes[1]))
    if tree:
        left = "outside of the capture set"
        cross = Line2D([], [], color=LOST_COLOR, marker="x", linestyle="", markersize=4, label=left)
        handles.append(cross)
    way = escape.path if isinstance(escape, EscapeEffort) else escape.states if escape else ()
    if len(way) > 1:
        handles.append(escape_line("cheapest escape"))
    if notes[2]:
        handles.append(Line2D([], [], linestyle="", label=notes[2]))
    return handles


def score_title(score: CaptureScore) -> str:
    """The scores; with several objects those of all and of at least one, a line each."""
    lines = {"all": (score.capture, score.success), "any": (score.capture_any, score.success_any)}
    several = score.capture_any is not None or score.success_any is not None
    return "\n".join(
        (f"{which}:   " if several else "")
        + "   ".join(
            f"{name} {value:.2f}"
            for name, value in zip(("capture", "success"), values, strict=True)
            if value is not None
        )
        for which, values in lines.items()
        if values != (None, None)
    )


def state_title(result: Result | None, escaping: Result | None, escape: Escape | None) -> str:
    """The scores of a capture score, and what is known of the escape."""
    lines = []
    if isinstance(result, CaptureScore):
        lines.append(score_title(result) + _unfinished(result))
    if escaping is not None and (escape is not None or not lines):
        known = _unfinished(escaping) if isinstance(escaping, EscapeEffort) else ""
        lines.append(escape_in_words(escaping, escape) + known)
    return "\n".join(lines)


def _bodies_by_role(scene: Scene) -> dict[str, str]:
    """What a legend says of the bodies that are drawn, by their role."""
    names: dict[str, list[str]] = {}
    for body in scene.bodies:
        if not isinstance(body.shape, Plane):
            names.setdefault(body.role, []).append(body.name)
    several = {"object": "objects", "effector": "effector"}
    labels = {}
    for role, of_role in names.items():
        if role == "none":
            more = ", ..." if len(of_role) > MOST_NAMES else ""
            labels[role] = ", ".join(of_role[:MOST_NAMES]) + more
        else:
            labels[role] = several[role] if len(of_role) > 1 else role
    return labels


def _set_patch(color: str, line: Literal["-", "--"], label: str) -> Patch:
    face, edge = to_rgba(color, 0.35), to_rgba(color)
    return Patch(facecolor=face, edgecolor=edge, linestyle=line, linewidth=0.9, label=label)


def _unfinished(result: Result) -> str:
    return "" if result.complete else "   (not complete)"


def draw_state_legend(ax: Axes, handles: list[Patch | Line2D], *, own_figure: bool) -> None:
    """Below the axes, over no data. Axes that the caller brought stay where they are: a layout
    engine makes room for it, or else the caller does."""
    figure = ax.get_figure()
    assert figure is not None
    options: dict[str, Any] = {"handles": handles, "frameon": False, "fontsize": LEGEND_SIZE}
    if own_figure:
        outside = partial(figure.legend, loc="outside lower center", **options)
        _as_wide_as(figure.bbox.width, outside)
    else:
        below = ax.transAxes + ScaledTranslation(0.0, -NAMES / 72, figure.dpi_scale_trans)
        options |= {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": below}
        ax.legend(loc="upper center", ncols=2, **options)


def _as_wide_as(width: float, make: Callable[..., Legend]) -> Legend:
    """A legend in as many columns as fit a width [pixels], three at most and one at least."""
    for columns in (3, 2):
        legend = make(ncols=columns)
        if legend.get_window_extent().width <= width:
            return legend
        legend.remove()
    return make(ncols=1)
