"""What the panel says: small pieces of HTML."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from energymargin.metrics import ANY, with_unit
from energymargin.plots.styles import (
    BODY_COLORS,
    CAPTURED_COLOR,
    COSTS,
    LOST_COLOR,
    SUCCEEDED_COLOR,
)
from energymargin.viewer.search import Scored
from energymargin.viewer.sources import Frames

__all__ = ["drawn_text", "escape_text", "frame_text", "legend", "plain", "score_table"]

STYLE = "font-size:0.85em;line-height:1.5;padding:0.1em 0.9em 0.4em"
NAMES = {
    "capture": "capture score",
    "success": "success score",
    "capture_any": "capture, at least one",
    "success_any": "success, at least one",
    "effort": "effort of escape",
    "force": "force score",
}
# The store's names of the same scores; the effort there is searched for as published.
STORED = {
    "capture": "capture",
    "success": "success",
    "capture_any": "capture" + ANY,
    "success_any": "success" + ANY,
    "effort": "effort/est",
    "force": "force",
}


def plain(text: str) -> str:
    """A line of text."""
    return f'<div style="{STYLE}">{escape(text)}</div>'


def frame_text(frames: Frames, frame: int) -> str:
    """When a frame is, and its labels."""
    words = [f"<b>t = {frames.times[frame]:.2f} s</b>"]
    if frames.captured is not None:
        lost = f'<b style="color:{LOST_COLOR}">not captured</b>'
        words.append("captured" if frames.captured[frame] else lost)
    if frames.success is not None:
        words.append(f"the trajectory {'succeeds' if frames.success else 'fails'}")
    return f'<div style="{STYLE}">{" &middot; ".join(words)}</div>'


def score_table(
    scored: Scored | None, nodes: int, rate: float, stored: Mapping[str, float] | None
) -> str:
    """The scores of the tree that is shown, of its first `nodes` nodes at this lambda, beside those
    of a file of scores."""
    live = {} if scored is None else _live(scored, nodes, rate)
    kept = {name: stored[key] for name, key in STORED.items() if stored and key in stored}
    rows = [name for name in NAMES if name in live or name in kept]
    if not rows:
        return plain("Not scored yet.")
    columns = [("this tree", live)] + ([("stored", kept)] if stored is not None else [])
    head = "".join(f'<th scope="col" style="text-align:right">{title}</th>' for title, _ in columns)
    body = "".join(
        f'<tr><th scope="row" style="text-align:left;font-weight:normal">{NAMES[name]}</th>'
        + "".join(_cell(name, values.get(name)) for _, values in columns)
        + "</tr>"
        for name in rows
    )
    notes = "" if scored is None else f"<div>{_notes(scored, nodes)}</div>"
    table = f'<table style="width:100%"><tr><td></td>{head}</tr>{body}</table>'
    return f'<div style="{STYLE}">{table}{notes}</div>'


def escape_text(scored: Scored | None, moment: int = 0) -> str:
    """How far it is on the way out."""
    if scored is None:
        return plain("Score this state to see the way out.")
    way = scored.way_out
    if scored.escape.nodes == 0 and way is None:
        return plain("Stopped before a way out was looked for.")
    if way is None:
        return plain(f"No way out was found with {scored.escape.nodes:,} nodes.")
    if len(way.times) == 1:
        return plain("It is out already: no effort is needed.")
    return plain(
        f"Out with {scored.escape.effort:.3g} J in {way.times[-1]:.2f} s. "
        f"At this moment: {way.costs[moment]:.3g} J, {way.times[moment]:.2f} s."
    )


def drawn_text(dots: int, edges: int) -> str:
    """How much of the tree is drawn."""
    return plain(f"{dots:,} dots and {edges:,} edges are drawn") if dots else ""


def legend(scored: Scored | None) -> str:
    """What the colours mean."""
    most = None if scored is None else float(scored.capture.tree.costs.max())
    marks = [
        (BODY_COLORS["object"], "object"),
        (BODY_COLORS["effector"], "effector"),
        (CAPTURED_COLOR, "capture set"),
        (SUCCEEDED_COLOR, "success set"),
        (LOST_COLOR, "edge out of the capture set"),
    ]
    squares = " ".join(
        f'<span style="white-space:nowrap"><span style="color:{color}">&#9632;</span> {text}</span>'
        for color, text in marks
    )
    return f'<div style="{STYLE}">{"" if most is None else _scale(most)}{squares}</div>'


def _live(scored: Scored, nodes: int, rate: float) -> dict[str, float]:
    values = scored.memberships.scores(min(nodes, scored.capture.nodes), rate)
    values["effort"] = scored.escape.effort
    if scored.force is not None:
        values["force"] = scored.force.force
    return values


def _cell(name: str, value: float | None) -> str:
    return f'<td style="text-align:right" data-score="{name}">{_value(name, value)}</td>'


def _value(name: str, value: float | None) -> str:
    if value is None or math.isnan(value):
        return "&ndash;"
    return with_unit(STORED[name], value)


def _notes(scored: Scored, nodes: int) -> str:
    grown = scored.capture.nodes
    notes = [f"capture and success of {min(nodes, grown):,} of {grown:,} nodes"]
    if not scored.complete:
        notes.append("stopped early")
    if scored.force is None:
        notes.append("no effector, so no force score")
    return "; ".join(notes)


def _scale(most: float) -> str:
    """The colours of the costs."""
    stops = ",".join(to_hex(matplotlib.colormaps[COSTS](share)) for share in np.linspace(0, 1, 7))
    bar = f'<div style="height:0.7em;background:linear-gradient(to right,{stops})"></div>'
    ends = f"<span>0</span><span>cost of a node</span><span>{most:.3g} J</span>"
    return f'{bar}<div style="display:flex;justify-content:space-between">{ends}</div>'
