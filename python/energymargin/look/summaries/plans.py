"""Summaries of choices between plans."""

from __future__ import annotations

from typing import TYPE_CHECKING

from energymargin.base.metrics import value_text
from energymargin.base.summary import Picture, Summary
from energymargin.base.table_text import sentence
from energymargin.look.summaries.words import SummaryRow, named

if TYPE_CHECKING:
    from energymargin.act.improvement import Improvement
    from energymargin.act.profile import MarginProfile
    from energymargin.act.ranking import Ranking


def ranking(result: Ranking) -> Summary:
    """The candidates from the best to the worst, beside their intervals; and the decision."""
    metric = result.metric
    rows = [
        (
            place,
            each.name,
            value_text(metric, each.score),
            f"{value_text(metric, each.low)} to {value_text(metric, each.high)}",
            each.draws,
            result.left(each.name),
        )
        for place, each in enumerate(result, 1)
    ]
    wild = [
        f"{each.diverged} of {each.draws} rollouts of {each.name} diverged, and do not count."
        for each in result
        if each.diverged
    ]
    head = ("", "candidate", named(metric), "95 % interval", "draws", "")
    picture = Picture("plot_ranking", result, "the candidates with their intervals")
    return Summary("", rows, head, [sentence(result.decision), *wild], picture=picture)


def improvement(result: Improvement) -> Summary:
    """The parameters before and after, and the last comparison."""
    start, found = result.start, result.values
    rows = [(name, f"{start[name]:.4g}", f"{found[name]:.4g}") for name in found]
    head, notes = ("parameter", "start", "found"), [sentence(result.decision)]
    return Summary("", rows, head, notes, further=ranking(result.ranking))


def margin_profile(result: MarginProfile) -> Summary:
    """Where it is weakest, beside the probability at each moment."""
    rows: list[SummaryRow] = [
        ("moments", len(result)),
        ("of them captured", int(result.captured.sum())),
        ("from, to", f"{result.times[0]:.4g} s, {result.times[-1]:.4g} s"),
    ]
    picture = Picture("plot_margin_profile", result, "the probability at each moment")
    return Summary("Margin along a plan", rows, notes=[f"{result.summary}."], picture=picture)
