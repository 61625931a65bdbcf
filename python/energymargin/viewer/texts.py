"""The texts of the panel, as HTML. What comes from a file or a user is escaped."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from html import escape

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from energymargin._core import CaptureProbability, Problem
from energymargin.actions.trials import Disturbance
from energymargin.disturbances import Uniform
from energymargin.futures import Undisturbed, future_rows, uniform_in_words
from energymargin.metrics import with_unit
from energymargin.plots.styles import (
    BODY_COLORS,
    CAPTURED_COLOR,
    COSTS,
    LOST_COLOR,
    SUCCEEDED_COLOR,
)
from energymargin.summary import Summary
from energymargin.table_text import DASH
from energymargin.viewer.search import Scored
from energymargin.viewer.sources import EFFORT, Frames
from energymargin.viewer.trees import FUTURE_COLOR

INK, PALE = "#3A3A3A", "#F3E3B6"  # of a dot whose colour is its cost; of a ghost on white
STYLE = "font-size:0.85em;line-height:1.5;padding:0.1em 0.9em 0.4em"
NAMES = {
    "probability": "stays captured",
    "probability/success": "is successful then",
    "probability/any": "at least one stays captured",
    "capture": "capture score",
    "success": "success score",
    "capture/any": "capture, at least one",
    "success/any": "success, at least one",
    EFFORT: "effort of escape",
    "force": "force score",
}


def plain(text: str) -> str:
    """A line of text."""
    return f'<div style="{STYLE}">{escape(text)}</div>'


def frame_text(frames: Frames, frame: int) -> str:
    """When a frame is, and its labels."""
    words = [f"<b>t = {frames.times[frame]:.2f} s</b>"] if len(frames.times) > 1 else []
    if frames.captured is not None:
        lost = f'<b style="color:{LOST_COLOR}">not captured</b>'
        words.append("captured" if frames.captured[frame] else lost)
    if frames.success is not None:
        words.append(f"the trajectory {'succeeds' if frames.success else 'fails'}")
    if frames.captured_any is not None and frames.captured_any[frame]:
        words.append("at least one object captured")
    return f'<div style="{STYLE}">{" &middot; ".join(words)}</div>'


def score_table(
    scored: Scored | None,
    nodes: int,
    rate: float,
    stored: Sequence[tuple[str, Mapping[str, float]]] = (),
) -> str:
    """The scores of the tree that is shown, of its first `nodes` nodes at this lambda, beside those
    of a file of scores: columns with their titles."""
    live = {} if scored is None else _live(scored, nodes, rate)
    there = {name for _, values in [("", live), *stored] for name in values}
    rows = [name for name in NAMES if name in there]
    if not rows:
        return plain("Not scored yet.")
    timed = "probability" in there if scored is None else scored.capture is None
    columns = [("scored now" if timed else "this tree", live), *stored]
    intervals = {} if scored is None else _intervals(scored)
    table = Summary(
        "",
        [
            (
                NAMES[name] + intervals.get(name, ""),
                *(_value(name, of.get(name)) for _, of in columns),
            )
            for name in rows
        ],
        head=("", *(title for title, _ in columns)),
        notes=[] if scored is None else [_notes(scored, nodes)],
    )
    warnings = "" if scored is None else _warnings(scored)
    return f'<div style="{STYLE}">{table.to_html()}{warnings}</div>'


def escape_text(scored: Scored | None, moment: int = 0) -> str:
    """Effort and time of the escape, and of a moment on it."""
    if scored is None:
        return plain("Score this state to see its escape.")
    way = scored.way_out
    if scored.escape.nodes == 0 and way is None:
        return plain("Stopped before an escape was searched for.")
    if way is None:
        return plain(f"No escape was found with {_counted(scored.escape.nodes, 'node')}.")
    if len(way.times) == 1:
        return plain("It is out already: no effort is needed.")
    by_itself = ", by itself," if scored.escape.effort == 0.0 else ""
    return plain(
        f"Out with {scored.escape.effort:.3g} J{by_itself} in {way.times[-1]:.2f} s. "
        f"At this moment: {way.costs[moment]:.3g} J, {way.times[moment]:.2f} s."
    )


def future_text(
    problem: Problem, future: Undisturbed | None, moment: int = 0, why: str = ""
) -> str:
    """The question's horizon and plan, and what becomes of the objects undisturbed; `why` it
    cannot be simulated."""
    table = Summary("", future_rows(problem)).to_html()
    return f'<div style="{STYLE}">{table}{_undisturbed(future, moment, why)}</div>'


def _undisturbed(future: Undisturbed | None, moment: int, why: str) -> str:
    if future is None:
        return f"<div>It cannot be simulated: {escape(why)}</div>" if why else ""
    now = float(future.times[moment])
    words = f"<b>{now:.2f} s ahead</b>"
    if future.exit is None:
        return f"<div>{words} &middot; undisturbed it stays captured</div>"
    leaves = f'<b style="color:{LOST_COLOR}">undisturbed it leaves at {future.exit:.2f} s</b>'
    return f"<div>{words} &middot; {leaves}</div>"


def drawn_text(dots: int, edges: int) -> str:
    """How much of the tree is drawn."""
    return plain(f"{_counted(dots, 'dot')} and {_counted(edges, 'edge')} are drawn") if dots else ""


def sets_text(problem: Problem, drawn: Collection[str]) -> str:
    """Which sets are not drawn."""
    sets = {"capture set": problem.captured, "success set": problem.succeeded}
    missing = [name for name, region in sets.items() if region is not None and name not in drawn]
    if not missing:
        return ""
    why = "all of the view or none of it is in it, or it depends on more than the place"
    return plain(f"Not drawn: the {' and the '.join(missing)} ({why}).")


def legend(problem: Problem, scored: Scored | None, future: Undisturbed | None = None) -> str:
    """What the colours and marks mean, of what there is."""
    roles = {body.role for body in problem.scene.bodies}
    marks: list[tuple[str, str, str]] = [
        ("&#9632;", BODY_COLORS[role], role) for role in ("object", "effector") if role in roles
    ]
    marks.append(("&#9632;", CAPTURED_COLOR, "capture set"))
    if problem.succeeded is not None:
        marks.append(("&#9632;", SUCCEEDED_COLOR, "success set"))
    if scored is not None:
        marks += [("&#9679;", INK, "node"), ("&#9670;", INK, "node out of the capture set")]
        marks.append(("&#9473;", LOST_COLOR, "edge to such a node"))
    if scored is not None and scored.way_out is not None:
        marks.append(("&#9473;", "black", "cheapest escape"))
        marks.append(("&#9632;", PALE, "object at its end"))
    if future is not None:
        marks.append(("&#9473;", FUTURE_COLOR, "undisturbed path"))
        if future.exit is not None:
            marks.append(("&#9670;", LOST_COLOR, "where it leaves"))
    words = " ".join(
        f'<span style="white-space:nowrap"><span style="color:{color}">{mark}</span> {text}</span>'
        for mark, color, text in marks
    )
    scale = "" if scored is None else _scale(scored)
    return f'<div style="{STYLE}">{scale}{words}</div>'


def _counted(number: int, thing: str) -> str:
    return f"{number:,} {thing}{'s' * (number != 1)}"


def _live(scored: Scored, nodes: int, rate: float) -> dict[str, float]:
    values = scored.values(nodes, rate)
    if scored.escape.nodes > 0 or scored.way_out is not None:  # it may have been stopped before
        values[EFFORT] = scored.escape.effort
    if scored.force is not None:
        values["force"] = scored.force.force
    return values


def _intervals(scored: Scored) -> dict[str, str]:
    """95 % intervals of the probabilities, in words."""
    found = scored.probability
    if found is None:
        return {}
    asked = {"probability": "captured"}
    if found.success is not None:
        asked["probability/success"] = "success"
    if found.any is not None:
        asked["probability/any"] = "any"
    ends = {name: found.interval(which=which) for name, which in asked.items()}
    return {name: f" ({low:.2f} to {high:.2f})" for name, (low, high) in ends.items()}


def _value(name: str, value: float | None) -> str:
    if value is None or math.isnan(value):
        return DASH
    return with_unit(name, value)


def _notes(scored: Scored, nodes: int) -> str:
    notes = [] if scored.complete else ["stopped early"]
    if scored.probability is not None and scored.disturbance is not None:
        notes = [_rollouts(scored.probability, scored.disturbance), *notes]
    if scored.capture is not None:
        several = "success" in scored.inside
        counted = "capture and success count" if several else "it counts"
        of = _counted(scored.nodes, "node")
        notes = [f"{counted} {min(nodes, scored.nodes):,} of {of}", *notes]
        if scored.force is None:
            notes.append("no effector, so no force score")
    return "; ".join(notes)


def _warnings(scored: Scored) -> str:
    """What speaks against the scores."""
    searches = (scored.capture, scored.probability, scored.escape)
    texts = [text for search in searches if search is not None for text in search.warnings]
    unique = dict.fromkeys(texts)
    return "".join(f'<div style="color:{LOST_COLOR}">{escape(text)}</div>' for text in unique)


def _rollouts(found: CaptureProbability, disturbance: Disturbance) -> str:
    """The rollouts behind the probabilities, and their disturbance, in words."""
    diverged = f", {found.diverged} diverged" if found.diverged else ""
    return (
        f"{_counted(found.rollouts, 'rollout')}{diverged} under {_in_words(disturbance)}; "
        f"95 % intervals; captured for {found.mean_time:.3g} s on average"
    )


def _in_words(disturbance: Disturbance) -> str:
    """A disturbance in words: a model by its numbers, a function by its name."""
    if isinstance(disturbance, Uniform):
        return uniform_in_words(disturbance)
    return str(getattr(disturbance, "__name__", repr(disturbance)))


def _scale(scored: Scored) -> str:
    """The colours of the costs, if there are any."""
    if not scored.tree.costs.max() > 0.0:
        return ""
    stops = ",".join(to_hex(matplotlib.colormaps[COSTS](share)) for share in np.linspace(0, 1, 7))
    bar = f'<div style="height:0.7em;background:linear-gradient(to right,{stops})"></div>'
    more = " or more" if scored.tree.costs.max() > scored.most else ""
    ends = f"<span>0</span><span>cost of a node</span><span>{scored.most:.3g} J{more}</span>"
    return f'{bar}<div style="display:flex;justify-content:space-between">{ends}</div>'
