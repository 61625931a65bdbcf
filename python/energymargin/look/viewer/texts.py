"""The texts of a shot, as HTML. What comes from a file or a user is escaped."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from html import escape

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

import energymargin as em
from energymargin.base.metrics import TIMED, with_unit
from energymargin.base.table_text import DASH, counted
from energymargin.look.plots import styles
from energymargin.look.viewer.shots import FUTURE_COLOR
from energymargin.look.viewer.sources import EFFORT, Frames, Scored

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
    return box(escape(text))


def box(*parts: str) -> str:
    """Parts of HTML in the look of all texts."""
    return f'<div style="{STYLE}">{"".join(parts)}</div>'


def _alarming(text: str) -> str:
    """Words in bold, in the colour of what is lost."""
    return f'<b style="color:{styles.LOST_COLOR}">{text}</b>'


def frame_text(frames: Frames, frame: int) -> str:
    """When a frame is, and its labels."""
    words = [f"<b>t = {frames.times[frame]:.2f} s</b>"] if len(frames.times) > 1 else []
    if frames.captured is not None:
        words.append("captured" if frames.captured[frame] else _alarming("not captured"))
    if frames.success is not None:
        words.append(f"the trajectory {'succeeds' if frames.success else 'fails'}")
    if frames.captured_any is not None and frames.captured_any[frame]:
        words.append("at least one object captured")
    return box(" &middot; ".join(words))


def score_table(
    scored: Scored | None, stored: Sequence[tuple[str, Mapping[str, float]]] = ()
) -> str:
    """The scores of a state beside those of a file of scores: columns with their titles."""
    live: dict[str, float] = {}
    found = None if scored is None else scored.probability
    if scored is not None:
        live = scored.values | {EFFORT: scored.escape.effort}
        if scored.force is not None:
            live["force"] = scored.force.force
    there = live.keys() | {name for _, values in stored for name in values}
    if not there & NAMES.keys():
        return ""
    timed = "probability" in there if scored is None else scored.capture is None
    columns = [("scored now" if timed else "this tree", live), *stored]
    rows = []
    for name, title in NAMES.items():
        if name in there:
            interval = ""
            if found is not None and name in live and name in TIMED:
                low, high = found.interval(which=TIMED[name])
                interval = f" ({low:.2f} to {high:.2f})"
            values = [of.get(name, math.nan) for _, of in columns]
            texts = [DASH if math.isnan(value) else with_unit(name, value) for value in values]
            rows.append((title + interval, *texts))
    head = ("", *(title for title, _ in columns))
    if scored is None:
        return box(em.summary.Summary("", rows, head).to_html())
    searches = [one for one in (scored.capture, found, scored.escape) if one is not None]
    warnings = dict.fromkeys(text for search in searches for text in search.warnings)
    lines = [f'<div style="color:{styles.LOST_COLOR}">{escape(text)}</div>' for text in warnings]
    return box(em.summary.Summary("", rows, head, [_notes(scored)]).to_html(), *lines)


def escape_text(scored: Scored) -> str:
    """Effort and time of the escape."""
    way = scored.way_out
    if way is None:
        return plain(f"No escape was found with {counted(scored.escape.nodes, 'node')}.")
    if len(way.times) == 1:
        return plain("It is out already: no effort is needed.")
    by_itself = ", by itself," if scored.escape.effort == 0.0 else ""
    return plain(f"Out with {scored.escape.effort:.3g} J{by_itself} in {way.times[-1]:.2f} s.")


def future_text(problem: em.Problem, future: em.futures.Undisturbed | None, why: str = "") -> str:
    """The question's horizon and plan, and what becomes of the objects undisturbed; `why` it
    cannot be simulated."""
    table = em.summary.Summary("", em.futures.future_rows(problem)).to_html()
    if future is None:
        return box(table, f"<div>It cannot be simulated: {escape(why)}</div>" if why else "")
    words = future.words if future.exit is None else _alarming(future.words)
    return box(table, f"<div>{words}</div>")


def drawn_text(dots: int, edges: int) -> str:
    """How much of the tree is drawn."""
    return plain(f"{counted(dots, 'dot')} and {counted(edges, 'edge')} are drawn") if dots else ""


def sets_text(problem: em.Problem, drawn: Collection[str]) -> str:
    """Which sets are not drawn."""
    sets = {"capture set": problem.captured, "success set": problem.succeeded}
    missing = [name for name, region in sets.items() if region is not None and name not in drawn]
    if not missing:
        return ""
    why = "all of the view or none of it is in it, or it depends on more than the place"
    return plain(f"Not drawn: the {' and the '.join(missing)} ({why}).")


def legend(
    problem: em.Problem, scored: Scored | None, future: em.futures.Undisturbed | None = None
) -> str:
    """What the colours and marks mean, of what there is."""
    square, line, diamond = "&#9632;", "&#9473;", "&#9670;"
    roles = {body.role for body in problem.scene.bodies}
    shown = sorted(roles - {"none"}, reverse=True)
    marks = [(square, styles.BODY_COLORS[role], str(role)) for role in shown]
    marks.append((square, styles.CAPTURED_COLOR, "capture set"))
    if problem.succeeded is not None:
        marks.append((square, styles.SUCCEEDED_COLOR, "success set"))
    if scored is not None:
        marks += [("&#9679;", INK, "node"), (diamond, INK, "node out of the capture set")]
        marks.append((line, styles.LOST_COLOR, "edge to such a node"))
    if scored is not None and scored.way_out is not None:
        marks += [(line, "black", "cheapest escape"), (square, PALE, "object at its end")]
    if future is not None:
        marks.append((line, FUTURE_COLOR, "undisturbed path"))
    if future is not None and future.exit is not None:
        marks.append((diamond, styles.LOST_COLOR, "where it leaves"))
    words = " ".join(
        f'<span style="white-space:nowrap"><span style="color:{color}">{mark}</span> {text}</span>'
        for mark, color, text in marks
    )
    return box("" if scored is None else _scale(scored), words)


def _notes(scored: Scored) -> str:
    """How many nodes or rollouts are behind the scores, and under which disturbance."""
    notes, found = [], scored.probability
    if scored.capture is not None:
        notes.append(f"of {counted(scored.nodes, 'node')}")
        if scored.force is None:
            notes.append("no effector, so no force score")
    elif found is not None:
        model = scored.disturbance
        words = str(getattr(model, "__name__", repr(model)))
        if isinstance(model, em.disturbances.Uniform):
            words = em.futures.uniform_in_words(model)
        diverged = f", {found.diverged} diverged" if found.diverged else ""
        notes += [f"{counted(found.rollouts, 'rollout')}{diverged} under {words}", "95 % intervals"]
        notes.append(f"captured for {found.mean_time:.3g} s on average")
    return "; ".join(notes)


def _scale(scored: Scored) -> str:
    """The colours of the costs, if there are any."""
    if not scored.tree.costs.max() > 0.0:
        return ""
    stops = ",".join(map(to_hex, matplotlib.colormaps[styles.COSTS](np.linspace(0, 1, 7))))
    bar = f'<div style="height:0.7em;background:linear-gradient(to right,{stops})"></div>'
    more = " or more" if scored.tree.costs.max() > scored.most else ""
    ends = f"<span>0</span><span>cost of a node</span><span>{scored.most:.3g} J{more}</span>"
    return f'{bar}<div style="display:flex;justify-content:space-between">{ends}</div>'
