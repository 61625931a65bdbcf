"""Summaries of grasps, and of what is at rest, how things lie, and where they are set down."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

import energymargin as em
from energymargin.base.summary import MOST_ROWS, Picture, Summary
from energymargin.base.table_text import DASH, counted, sentence
from energymargin.look.summaries.scores import stacked

if TYPE_CHECKING:
    from energymargin.grasps.trials import GraspTrials

_MOVED = (
    "in {:.0%} of the trials the hand was in the object or the table and got another pose: it may "
    "look better than it is"
)
OVERLAP = "{} and {} overlap by {:.2g} mm at the start."


def grasp_scores(scores: em.grasps.GraspScores) -> Summary:
    """The ranked grasps: all of a few, of many the best, the most doubtful and the worst."""
    n, trials = scores.endings.shape
    order = scores.ranked
    ranks = np.arange(len(order))
    if len(order) > MOST_ROWS:
        third = MOST_ROWS // 3
        doubt = np.abs(scores.probabilities[order] - 0.5)[third:-third]
        doubtful = third + np.sort(np.argsort(doubt, kind="stable")[:third])
        ranks = np.concatenate([ranks[:third], doubtful, ranks[-third:]])
    table = scores.table(ranks.tolist())
    lead = f"{counted(n, 'grasp')}, {counted(trials, 'trial')} of {scores.horizon:g} s each"
    lead += "; the best, the most doubtful and the worst" * (len(ranks) < len(order))
    notes = [sentence(note) for note in _grasp_notes(scores) if note]
    picture = Picture("plot_grasps", scores, "probabilities with their 95 % intervals, by rank")
    rows = list(zip(*table.values(), strict=True))
    return Summary("", rows, tuple(table), notes, lead=lead, picture=picture)


def grasp_calibration(found: em.grasps.GraspCalibration) -> Summary:
    """A row for each group: how far it was moved back, and what that made possible."""
    columns = (found.groups, found.count, found.offsets, found.before, found.after)
    rows = [
        (name, count, f"{1e3 * back:.0f} mm", f"{before:.0%}", f"{after:.0%}")
        for name, count, back, before, after in zip(*columns, strict=True)
    ]
    head = ("group", "grasps", "moved back", "possible before", "possible after")
    note = "Possible: the open hand is free, the object between the pads."
    return Summary("", rows, head, [note])


def grasp_trials(asked: GraspTrials) -> Summary:
    """What was asked about grasps: object, hand, protocol, belief and disturbance."""
    from energymargin.grasps import words

    rows = [
        ("object", str(asked.object)),
        ("hand", words.of_hand(asked.hand)),
        ("protocol", words.of_protocol(asked.protocol)),
        ("lost", words.of_loss(asked.protocol)),
        ("not known", words.of_belief(asked.belief)),
        ("disturbance", words.of_disturbance(asked)),
        ("a hand in the object", words.OF_COLLIDING[asked.colliding]),
        ("seed", asked.seed),
    ]
    return Summary("What was asked", rows)


def _grasp_notes(scores: em.grasps.GraspScores) -> list[str]:
    """What there is to know about the table."""
    n, made = len(scores.grasps), (scores.endings != -1).sum()
    missing = int((scores.endings == -1).any(axis=1).sum()) - len(scores.errors)
    moved = scores.colliding.sum() if scores.trials.colliding != "lost" else 0
    return [
        _against_labels(scores),
        _MOVED.format(moved / made) if moved else "",
        *scores.warnings,
        f"{missing} of {n} grasps were not scored" if missing else "",
    ]


def grasp_comparison(result: em.grasps.GraspComparison) -> Summary:
    """AUC and AP of each score, of the pairs within an object, and how far it is behind."""
    head = ("score", "AUC/AP", "AUC within an object", "behind the probability")
    rows = []
    for name, one in result.scores.items():
        ahead = DASH if one.ahead_interval is None else _with_span(one.ahead, one.ahead_interval)
        rows.append((name, stacked(one.cell), _with_span(one.within, one.within_interval), ahead))
    lead = f"{result.held} of {result.grasps} grasps hold ({', '.join(result.objects)})."
    notes = [f"{result.left_out} grasps have no label or no probability."] * (result.left_out > 0)
    return Summary("Which grasps hold", rows, head, notes, lead=lead)


def _with_span(value: float, interval: tuple[float, float] | None) -> str:
    """A value and below it its interval, with a sign where it may be negative."""
    ends = [] if interval is None else [" to ".join(f"{end:.2f}" for end in interval)]
    return DASH if math.isnan(value) else "\n".join([f"{value:.3f}", *ends])


def _against_labels(scores: em.grasps.GraspScores) -> str:
    """The AUC of the probabilities, if there are labels of both kinds."""
    try:
        found = em.grasps.compare({"": scores}, columns={"": {}})
    except ValueError:
        return ""
    cell = found.scores["probability"].cell
    low, high = cell.auc_interval or (0.0, 1.0)
    lost = found.grasps - found.held
    within = f"AUC {cell.auc:.2f} ({low:.2f} to {high:.2f})"
    return f"{within} against the labels: {found.held} held, {lost} lost"


def settled(found: em.placing.Settled) -> Summary:
    """A row for each body that does not stay, the farthest first."""
    head = ("body", "", "moved [mm]", "turned [deg]", "dropped [mm]", "from, to [s]", "rests on")
    rows = [_of_body(found[name]) for name in found.moved]
    some = f"{len(rows)} of {len(found.bodies)} bodies move."
    verdict = "Nothing moves." if found.stays else some
    notes = [f"{verdict} Simulated: {found.time:.3g} s, {found.steps} steps."]
    notes += [OVERLAP.format(a, b, 1e3 * depth) for a, b, depth in found.overlaps]
    if found.unconverged:
        notes.append(f"{found.unconverged} steps did not converge.")
    return Summary("", rows, head if rows else (), notes)


def _of_body(body: em.placing.RestingBody) -> tuple[str, ...]:
    ends = [f"{t:.3g}" if math.isfinite(t) else DASH for t in (body.moved_at, body.rest_at)]
    sizes = 1e3 * body.distance, math.degrees(body.turned), 1e3 * body.dropped
    numbers = (f"{size:.1f}" for size in sizes)
    return body.name, body.verdict, *numbers, ", ".join(ends), ", ".join(body.on) or DASH


def resting_poses(found: em.placing.RestingPoses) -> Summary:
    """A row for each pose, the most probable first."""
    head = ("pose", "probability", "dropped", "height [mm]", "topples at [deg]", "least work [J]")
    rows = []
    for number, one in enumerate(found.poses[:MOST_ROWS]):
        dropped = DASH if math.isnan(one.dropped) else f"{one.dropped:.3f}"
        size = f"{1e3 * one.height:.1f}", f"{math.degrees(one.largest_tilt):.1f}"
        way = min(one.work, key=one.work.__getitem__, default=None)
        work = DASH if way is None else f"{one.least_work:.3g} to {way}"
        rows.append((number, f"{one.probability:.3f}", dropped, *size, work))
    apart = f"they differ from the probabilities by {found.total_variation:.3f} in all."
    notes = [f"Of {found.drops} simulated drops; {apart}"] if found.drops else []
    picture = Picture("plot_resting_pose", found, "the most probable pose") if rows else None
    return Summary("", rows, head, notes, total=len(found), picture=picture)


def stack_robustness(found: em.placing.StackRobustness) -> Summary:
    """A row for each body, the weakest first; and what the support may do."""
    rows = [(push.body, *push_cells(push.effort, push.way, push.takes)) for push in found.pushes]
    asked = {
        "a tilt of {}": found.tilt,
        "an acceleration of {}": found.acceleration,
        "its plan {} times as fast": found.speed,
    }
    notes = [_of_support(words, one) for words, one in asked.items() if one is not None]
    return Summary("", rows, ("body", "least effort [J]", "it", "takes along"), notes)


def _of_support(words: str, one: em.CriticalValue) -> str:
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


def placements(found: em.placing.Placements) -> Summary:
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
