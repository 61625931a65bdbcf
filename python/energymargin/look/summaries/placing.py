"""Summaries of what is at rest, how things lie, and where they are set down."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from energymargin.base.summary import MOST_ROWS, Picture, Summary
from energymargin.base.table_text import DASH, sentence
from energymargin.look.summaries.searches import UNFINISHED

if TYPE_CHECKING:
    from energymargin.act.critical import CriticalValue
    from energymargin.placing import Placements, RestingBody, RestingPoses, Settled, StackRobustness


def settled(found: Settled) -> Summary:
    """A row for each body that does not stay, the farthest first."""
    head = ("body", "", "moved [mm]", "turned [deg]", "dropped [mm]", "from, to [s]", "rests on")
    rows = [_of_body(found[name]) for name in found.moved]
    count = len(found.bodies)
    verdict = "Nothing moves." if found.stays else f"{len(rows)} of {count} bodies move."
    notes = [f"{verdict} Simulated: {found.time:.3g} s, {found.steps} steps."]
    notes += [
        f"{a} and {b} overlap by {1e3 * d:.2g} mm at the start." for a, b, d in found.overlaps
    ]
    if found.unconverged:
        notes.append(f"{found.unconverged} steps did not converge.")
    notes += [] if found.complete else [UNFINISHED]
    return Summary("", rows, head if rows else (), notes)


def _of_body(body: RestingBody) -> tuple[str, ...]:
    ends = [f"{t:.3g}" if math.isfinite(t) else DASH for t in (body.moved_at, body.rest_at)]
    sizes = 1e3 * body.distance, math.degrees(body.turned), 1e3 * body.dropped
    numbers = (f"{size:.1f}" for size in sizes)
    return body.name, body.verdict, *numbers, ", ".join(ends), ", ".join(body.on) or DASH


def resting_poses(found: RestingPoses) -> Summary:
    """A row for each pose, the most probable first."""
    head = ("pose", "probability", "dropped", "height [mm]", "topples at [deg]", "least work [J]")
    rows = [
        (
            number,
            f"{one.probability:.3f}",
            DASH if math.isnan(one.dropped) else f"{one.dropped:.3f}",
            f"{1e3 * one.height:.1f}",
            f"{math.degrees(one.largest_tilt):.1f}",
            f"{one.least_work:.3g} to {min(one.work, key=one.work.__getitem__)}"
            if one.work
            else DASH,
        )
        for number, one in enumerate(found.poses[:MOST_ROWS])
    ]
    notes = [] if found.complete else [UNFINISHED]
    if found.drops:
        apart = f"they differ from the probabilities by {found.total_variation:.3f} in all."
        notes.append(f"Of {found.drops} simulated drops; {apart}")
    picture = Picture("plot_resting_pose", found, "the most probable pose") if rows else None
    return Summary("", rows, head, notes, total=len(found), picture=picture)


def stack_robustness(found: StackRobustness) -> Summary:
    """A row for each body, the weakest first; and what the support may do."""
    rows = [(push.body, *push_cells(push.effort, push.way, push.takes)) for push in found.pushes]
    asked = {
        "a tilt of {}": found.tilt,
        "an acceleration of {}": found.acceleration,
        "its plan {} times as fast": found.speed,
    }
    notes = [_of_support(words, one) for words, one in asked.items() if one is not None]
    notes += [] if found.complete else [UNFINISHED]
    return Summary("", rows, ("body", "least effort [J]", "it", "takes along"), notes)


def _of_support(words: str, one: CriticalValue) -> str:
    def said(value: float) -> str:
        if one.unit == "rad":
            return f"{math.degrees(value):.2f} deg"
        return f"{value:.3g} {one.unit}".rstrip()

    if one.side != "below":
        return f"The support takes {words.format(said(one.range[1]))}: {one.side}."
    most = words.format(f"up to {said(one.value)}").replace("of up", "up")
    return f"The support takes {most} ({said(one.low)} to {said(one.high)})."


def push_cells(effort: float, way: str, takes: tuple[str, ...]) -> tuple[str, str, str]:
    """The least push in words."""
    return (f"{effort:.3g}" if way else DASH), way or "does not fall", ", ".join(takes) or DASH


def placements(found: Placements) -> Summary:
    """The candidates from the best to the worst, beside their intervals and pushes."""
    head = ("", "candidate", "stays", "95 % interval", "least effort [J]", "it", "takes along")
    rows = []
    for place, one in enumerate(list(found)[:MOST_ROWS], 1):
        push = found.pushes.get(one.name)
        cells = push_cells(push.effort, push.way, push.takes) if push else (DASH,) * 3
        ends = f"{one.low:.2f} to {one.high:.2f}"
        rows.append((place, one.name, f"{one.score:.2f}", ends, *cells))
    notes = [sentence(found.ranking.decision)]
    if found.blocked:
        others = ", ".join(sorted(set(found.blocked.values())))
        notes.append(f"{len(found.blocked)} candidates have no room: {others}.")
    picture = Picture("plot_ranking", found.ranking, "the candidates with their intervals")
    return Summary("", rows, head, notes, total=len(found), picture=picture)
