"""Summaries of choices between plans, and of how much something can take."""

from __future__ import annotations

import math

import numpy as np

import energymargin as em
from energymargin.base.metrics import value_text
from energymargin.base.summary import Picture, Summary
from energymargin.base.table_text import DASH, sentence
from energymargin.look.summaries.scores import named

WILD = "{0.diverged} of {0.draws} rollouts of {0.name} diverged, and do not count."


def ranking(result: em.Ranking) -> Summary:
    """The candidates from the best to the worst, beside their intervals; and the decision."""
    metric = result.metric
    rows = []
    for place, one in enumerate(result, 1):
        score, low, high = (value_text(metric, each) for each in (one.score, one.low, one.high))
        rows.append((place, one.name, score, f"{low} to {high}", one.draws, result.left(one.name)))
    wild = [WILD.format(one) for one in result if one.diverged]
    head = ("", "candidate", named(metric), "95 % interval", "draws", "")
    picture = Picture("plot_ranking", result, "the candidates with their intervals")
    return Summary("", rows, head, [sentence(result.decision), *wild], picture=picture)


def improvement(result: em.Improvement) -> Summary:
    """The parameters before and after, and the last comparison."""
    start, found = result.start, result.values
    rows = [(name, f"{start[name]:.4g}", f"{found[name]:.4g}") for name in found]
    head, notes = ("parameter", "start", "found"), [sentence(result.decision)]
    return Summary("", rows, head, notes, further=ranking(result.ranking))


def margin_profile(result: em.MarginProfile) -> Summary:
    """Where it is weakest, beside the probability at each moment."""
    rows = [
        ("moments", len(result)),
        ("of them captured", int(result.captured.sum())),
        ("from, to", f"{result.times[0]:.4g} s, {result.times[-1]:.4g} s"),
    ]
    picture = Picture("plot_margin_profile", result, "the probability at each moment")
    return Summary("Margin along a plan", rows, notes=[f"{result.summary}."], picture=picture)


def critical_value(one: em.CriticalValue) -> Summary:
    """Where it holds, with the interval, and what it took."""
    holds, ends = _where_it_holds(one)
    rows = [
        ("holds", holds),
        (f"{one.confidence:.0%} interval", ends),
        ("captured with probability", f"{one.probability:g}"),
        ("rollouts", one.rollouts),
    ]
    notes = ["Not monotone: new draws have tested the ends."] if one.monotone is False else []
    picture = Picture("plot_critical_value", one, "What is known of the probability.")
    return Summary(f"Critical {one.quantity}", rows, notes=notes, picture=picture)


def critical_values(found: em.actions.CriticalValues) -> Summary:
    """A row for each: nominal value, where it holds, with the interval, and margin."""
    rows = [
        (one.quantity, _with_unit(nominal, one.unit), *_where_it_holds(one), _margin(margin))
        for one, nominal, margin in zip(found, found.nominals, found.margins, strict=True)
    ]
    first = found.tightest
    notes = [found.question] + ([] if first is None else [f"Tightest: {first.quantity}."])
    head = ("quantity", "nominal", "holds", "interval", "margin")
    picture = Picture("plot_critical_values", found, "How far each is from where it fails.")
    return Summary("", rows, head, notes, picture=picture)


def critical_curve(curve: em.CriticalCurve) -> Summary:
    """A row for each point."""
    points = zip(curve.values, curve.found, strict=True)
    rows = [(_with_unit(value, curve.unit), *_where_it_holds(one)) for value, one in points]
    notes = [f"All intervals together cover the line with {curve.confidence:.0%}."]
    picture = Picture("plot_critical_curve", curve, "The line between held and lost.")
    head = (curve.quantity, curve.found[0].quantity, "interval")
    return Summary("", rows, head, notes, picture=picture)


def grasp_limits(found: em.grasps.GraspLimits) -> Summary:
    """A row for each grasp, with where it holds and the interval for each quantity."""
    columns = found.limits.values()
    rows = [
        (name, *(_of_grasp(column[k], found.errors.get(k)) for column in columns))
        for k, name in enumerate(found.grasps.names)
    ]
    return Summary("", rows, ("grasp", *found.limits))


def _of_grasp(one: em.CriticalValue | None, error: str | None) -> str:
    if one is None:
        return error or "not made"
    return f"{_where_it_holds(one)[0]}\n{_where_it_holds(one)[1]}"


def diagnosis(found: em.mujoco.Diagnosis) -> Summary:
    """A row for each finding."""
    rows = [(one.kind, one.where, one.text) for one in found.findings]
    return Summary("", rows, ("what", "where", "how"), [] if rows else ["Nothing was found."])


def outcome_comparison(found: em.actions.OutcomeComparison) -> Summary:
    """Both means, who won how often, and since when it is sure."""
    won, rows = (found.wins, found.losses), []
    for k, (mean, (low, high)) in enumerate(zip(found.means, found.intervals, strict=True)):
        interval = "" if math.isnan(low) else f"{low:.2f} to {high:.2f}"
        rows.append(("ab"[k], f"{mean:.3g}", interval, won[k]))
    said = f"{found.better} is better, with {found.confidence:.0%} since pair {found.decided}."
    note = said if found.better else f"After {found.pairs} pairs neither is sure to be better."
    return Summary("", rows, ("", "mean", "interval", "did better"), [note])


def engine_comparison(found: em.EngineComparison) -> Summary:
    """A row for each engine; all but the first beside that."""
    rows, first = [], found.exit_times[0]
    for i, (name, p) in enumerate(zip(found.engines, found.probabilities, strict=True)):
        low, high = p.interval()
        here = found.exit_times[i]
        pairs = (here, first), (first, here)
        lost = [int((np.isfinite(one) & np.isinf(other)).sum()) for one, other in pairs]
        both = np.isfinite(first) & np.isfinite(here)
        later = float(np.median(here[both] - first[both])) if both.any() else 0.0
        beside = (*lost, f"{1000 * later:+.3g} ms", f"{1000 * found.distances[i, -1]:.3g} mm")
        captured = f"{p.captured:.3g} [{low:.3g}, {high:.3g}]"
        rows.append((name, captured, *(beside if i else (DASH,) * 4)))
    head = ("engine", "captured", "lost here alone", "lost there alone", "lost later by")
    return Summary("", rows, (*head, "undisturbed, apart"))


def _where_it_holds(one: em.CriticalValue) -> tuple[str, str]:
    """In words, and the intervals, a part for each crossing."""
    if not one.crossings:
        low, high = (_with_unit(end, one.unit) for end in one.range)
        return "not known" if one.side == "unknown" else one.side, f"asked from {low} to {high}"
    holds = [f"{side} {_with_unit(value, one.unit)}" for value, _, _, side in one.crossings]
    ends = [f"{low:.4g} to {_with_unit(high, one.unit)}" for _, low, high, _ in one.crossings]
    return " and ".join(holds), " and ".join(ends)


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _margin(margin: float) -> str:
    if math.isnan(margin):
        return "not known"
    return f"{margin:+.0%}" if math.isfinite(margin) else DASH
