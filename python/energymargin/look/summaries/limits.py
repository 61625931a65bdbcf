"""Summaries of how much something can take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from energymargin.base.summary import Picture, Summary
from energymargin.base.table_text import DASH
from energymargin.look.summaries.searches import UNFINISHED

if TYPE_CHECKING:
    from energymargin.act.critical import CriticalValue
    from energymargin.act.limits import CriticalCurve, CriticalValues
    from energymargin.act.outcomes import OutcomeComparison
    from energymargin.grasps import GraspLimits
    from energymargin.mujoco import Diagnosis


def critical_value(one: CriticalValue) -> Summary:
    """Where it holds, with the interval, and what it took."""
    holds, ends = _where_it_holds(one)
    rows = [
        ("holds", holds),
        (f"{one.confidence:.0%} interval", ends),
        ("captured with probability", f"{one.probability:g}"),
        ("rollouts", one.rollouts),
    ]
    notes = ["Not monotone: new draws have tested the ends."] if one.monotone is False else []
    notes += [] if one.complete else [UNFINISHED]
    picture = Picture("plot_critical_value", one, "What is known of the probability.")
    return Summary(f"Critical {one.quantity}", rows, notes=notes, picture=picture)


def critical_values(found: CriticalValues) -> Summary:
    """A row for each: nominal value, where it holds, with the interval, and margin."""
    rows = [
        (one.quantity, _with_unit(nominal, one.unit), *_where_it_holds(one), _margin(margin))
        for one, nominal, margin in zip(found, found.nominals, found.margins, strict=True)
    ]
    first = found.tightest
    notes = [found.question] + ([] if first is None else [f"Tightest: {first.quantity}."])
    notes += [] if found.complete else [UNFINISHED]
    head = ("quantity", "nominal", "holds", "interval", "margin")
    picture = Picture("plot_critical_values", found, "How far each is from where it fails.")
    return Summary("", rows, head, notes, picture=picture)


def critical_curve(curve: CriticalCurve) -> Summary:
    """A row for each point."""
    rows = [
        (_with_unit(value, curve.unit), *_where_it_holds(one))
        for value, one in zip(curve.values, curve.found, strict=True)
    ]
    notes = [f"All intervals together cover the line with {curve.confidence:.0%}."]
    notes += [] if curve.complete else [UNFINISHED]
    picture = Picture("plot_critical_curve", curve, "The line between held and lost.")
    head = (curve.quantity, curve.found[0].quantity, "interval")
    return Summary("", rows, head, notes, picture=picture)


def grasp_limits(found: GraspLimits) -> Summary:
    """A row for each grasp, with where it holds and the interval for each quantity."""
    columns = found.limits.values()
    rows = [
        (name, *(_of_grasp(column[k], found.errors.get(k)) for column in columns))
        for k, name in enumerate(found.grasps.names)
    ]
    notes = [] if found.complete else [UNFINISHED]
    return Summary("", rows, ("grasp", *found.limits), notes)


def _of_grasp(one: CriticalValue | None, error: str | None) -> str:
    if one is None:
        return error or "not made"
    return f"{_where_it_holds(one)[0]}\n{_where_it_holds(one)[1]}"


def diagnosis(found: Diagnosis) -> Summary:
    """A row for each finding."""
    rows = [(one.kind, one.where, one.text) for one in found.findings]
    return Summary("", rows, ("what", "where", "how"), [] if rows else ["Nothing was found."])


def outcome_comparison(found: OutcomeComparison) -> Summary:
    """Both means, who won how often, and since when it is sure."""
    rows = [
        (name, f"{mean:.3g}", "" if math.isnan(low) else f"{low:.2f} to {high:.2f}", won)
        for name, mean, (low, high), won in zip(
            "ab", found.means, found.intervals, (found.wins, found.losses), strict=True
        )
    ]
    said = f"{found.better} is better, with {found.confidence:.0%} since pair {found.decided}."
    note = said if found.better else f"After {found.pairs} pairs neither is sure to be better."
    return Summary("", rows, ("", "mean", "interval", "did better"), [note])


def _where_it_holds(one: CriticalValue) -> tuple[str, str]:
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
