"""Summaries of grasps, and of what was asked about them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from energymargin.base.summary import MOST_ROWS, Picture, Summary
from energymargin.base.table_text import DASH, sentence
from energymargin.look.summaries.words import SummaryRow, stacked

if TYPE_CHECKING:
    from energymargin.grasps import GraspCalibration, GraspComparison, GraspScores
    from energymargin.grasps.trials import GraspTrials


_MOVED = (
    "in {:.0%} of the trials the hand was in the object or the table and got another pose: it may "
    "look better than it is"
)


def grasp_scores(scores: GraspScores) -> Summary:
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
    lead = f"{_counted(n, 'grasp')}, {_counted(trials, 'trial')} of {scores.horizon:g} s each"
    lead += "; the best, the most doubtful and the worst" * (len(ranks) < len(order))
    notes = [sentence(note) for note in _grasp_notes(scores) if note]
    picture = Picture("plot_grasps", scores, "probabilities with their 95 % intervals, by rank")
    rows = list(zip(*table.values(), strict=True))
    return Summary("", rows, tuple(table), notes, lead=lead, picture=picture)


def grasp_calibration(found: GraspCalibration) -> Summary:
    """A row for each group: how far it was moved back, and what that made possible."""
    columns = (found.groups, found.count, found.offsets, found.before, found.after)
    rows = [
        (name, count, f"{1e3 * back:.0f} mm", f"{before:.0%}", f"{after:.0%}")
        for name, count, back, before, after in zip(*columns, strict=True)
    ]
    head = ("group", "grasps", "moved back", "possible before", "possible after")
    return Summary(
        "", rows, head, ["Possible: the open hand is free, the object between the pads."]
    )


def grasp_trials(asked: GraspTrials) -> Summary:
    """What was asked about grasps: object, hand, protocol, belief and disturbance."""
    from energymargin.grasps import words

    rows: list[SummaryRow] = [
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


def _grasp_notes(scores: GraspScores) -> list[str]:
    """What there is to know about the table."""
    n, made = len(scores.grasps), (scores.endings != -1).sum()
    missing = int((scores.endings == -1).any(axis=1).sum()) - len(scores.errors)
    moved = scores.colliding.sum() if scores.trials.colliding != "lost" else 0
    return [
        _against_labels(scores),
        _MOVED.format(moved / made) if moved else "",
        *scores.warnings,
        f"not complete: {missing} of {n} grasps were not scored" if missing else "",
    ]


def grasp_comparison(result: GraspComparison) -> Summary:
    """AUC and AP of each score, of the pairs within an object, and how far it is behind."""
    head = ("score", "AUC/AP", "AUC within an object", "behind the probability")
    rows = [
        (
            name,
            stacked(one.cell),
            _with_span(one.within, one.within_interval),
            DASH if one.ahead_interval is None else _with_span(one.ahead, one.ahead_interval),
        )
        for name, one in result.scores.items()
    ]
    things = ", ".join(result.objects)
    lead = f"{result.held} of {result.grasps} grasps hold ({things})."
    notes = [f"{result.left_out} grasps have no label or no probability."] * (result.left_out > 0)
    return Summary("Which grasps hold", rows, head, notes, lead=lead)


def _with_span(value: float, interval: tuple[float, float] | None) -> str:
    """A value and below it its interval, with a sign where it may be negative."""
    ends = [] if interval is None else [" to ".join(f"{end:.2f}" for end in interval)]
    return DASH if math.isnan(value) else "\n".join([f"{value:.3f}", *ends])


def _against_labels(scores: GraspScores) -> str:
    """The AUC of the probabilities, if there are labels of both kinds."""
    from energymargin.grasps import compare

    try:
        found = compare({"": scores}, columns={"": {}})
    except ValueError:
        return ""
    cell = found.scores["probability"].cell
    low, high = cell.auc_interval or (0.0, 1.0)
    lost = found.grasps - found.held
    within = f"AUC {cell.auc:.2f} ({low:.2f} to {high:.2f})"
    return f"{within} against the labels: {found.held} held, {lost} lost"


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'s' * (number != 1)}"
