"""Summaries of searches, of what is asked of them, of choices between plans, and of how much
something can take."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

import energymargin as em
from energymargin import _core
from energymargin.base.metrics import value_text
from energymargin.base.summary import Picture, Summary
from energymargin.base.table_text import DASH, sentence
from energymargin.evaluate.futures import plan_rows
from energymargin.look.summaries.scores import named

NONE_FOUND = "infinite: no way out was found"
NOTHING_SEARCHED = "It was stopped before anything was searched: there is no value."
NOISE = 1e-12  # N, or m; what is less is left of numbers that cancel out
EQUAL = 1e-9  # of their number: weights that differ by less do not
DETAIL = 150  # cells of the sets along the longer side of a state's picture, which is quick
STATE = "the state: object orange, effector green, capture set blue, success set grey and dashed"
MOST_NAMES = 4  # of bodies


def capture_score(score: _core.CaptureScore) -> Summary:
    """Likelihoods with their standard errors, if there are several trees."""
    rows: dict[str, object] = {}
    for name in ("capture", "success", "capture_any", "success_any"):
        value, stderr = getattr(score, name), getattr(score, f"{name}_stderr")
        if value is not None:
            error = "" if stderr is None else f" ± {stderr:.3f} (standard error)"
            rows[name.replace("_any", ", at least one object")] = f"{value:.3f}{error}"
    rows["no score is finer than"] = f"{score.resolution:.2g}"
    rows["trees"] = f"{len(score.capture_by_tree)} of {score.nodes} nodes"
    return _search("Capture score", rows, score, score.nodes)


def escape_effort(result: _core.EscapeEffort) -> Summary:
    """The effort, and when it was found."""
    rows: dict[str, object] = {"effort": _energy(result.effort)}
    if math.isfinite(result.effort):
        rows["path"] = f"{max(len(result.path) - 1, 0)} edges"
        rows["found at node"] = result.history[-1][0] if result.history else 0
    return _search("Effort of escape", {**rows, "nodes": result.nodes}, result, result.nodes)


def escape_energy(result: _core.EscapeEnergy) -> Summary:
    """The barrier, and how it was found."""
    rows: dict[str, object] = {"energy": _energy(result.energy)}
    if math.isfinite(result.energy):
        rows["path"] = f"{len(result.path)} states, the barrier at row {result.barrier}"
    rows["poses drawn"] = result.samples
    return _search("Escape energy", rows, result, result.samples)


def _search(title: str, rows: Mapping[str, object], result: Any, size: int) -> Summary:
    """A search of that size, which may have been stopped before it found anything."""
    if not (size or result.complete):
        return Summary(title, notes=[NOTHING_SEARCHED])
    return Summary(title, list(rows.items()), notes=_notes(result))


def force_score(score: _core.ForceScore) -> Summary:
    """The score and its terms."""
    rows = [("score", _without_noise(score.force))]
    rows.append(("distance of object and effector", f"{_without_noise(score.distance)} m"))
    for name, terms in (("effector", score.effector), ("all else", score.ground)):
        rows.append((f"{name}: normal forces", f"{_without_noise(terms.engage)} N"))
        rows.append((f"{name}: to the friction cones' edges", f"{_without_noise(terms.stick)} N"))
    return Summary("Force score", rows)


def _without_noise(value: float) -> str:
    return f"{value:.4g}" if abs(value) > NOISE else "0"


def tree(found: _core.Tree) -> Summary:
    """The size of a search tree."""
    rows = [
        ("nodes", f"{len(found) - 1} and the root"),
        ("numbers in a state", found.states.shape[1]),
        ("largest cost", _energy(float(found.costs.max()))),
        ("longest edge", f"{float(found.durations.max()):.3g} s"),
    ]
    return Summary("Search tree", rows)


def _energy(energy: float) -> str:
    return f"{energy:.4g} J" if math.isfinite(energy) else NONE_FOUND


def _notes(result: Any) -> list[str]:
    """Warnings as sentences."""
    return [sentence(warning) for warning in getattr(result, "warnings", ())]


def capture_probability(found: _core.CaptureProbability) -> Summary:
    """The probability with its interval, what happens undisturbed, and the curve beside."""

    def with_interval(value: float, which: str) -> str:
        low, high = found.interval(which=which)
        return f"{value:.3f} ({low:.3f} to {high:.3f} with 95 % confidence)"

    undisturbed = "stays captured" if found.undisturbed else "was not asked for"
    if found.undisturbed is False:
        undisturbed = f"leaves at {found.undisturbed_time:.3g} s"
    if found.undisturbed_success is not None:
        undisturbed += ", succeeds" if found.undisturbed_success else ", does not succeed"
    rollouts = str(found.rollouts)
    if abs(found.effective - found.rollouts) > EQUAL * found.rollouts:
        rollouts += f", worth {found.effective:.3g} of equal weight"
    if found.diverged:
        rollouts += f", and {found.diverged} that diverged and do not count"
    rows = {
        f"captured for {found.times[-1]:.3g} s": with_interval(found.captured, "captured"),
        "mean time captured": f"{found.mean_time:.3g} s",
        "undisturbed": undisturbed,
    }
    if found.success is not None:
        rows["success at the end"] = with_interval(found.success, "success")
    if found.any is not None:
        rows["captured, at least one object"] = with_interval(found.any.captured, "any")
    rows |= {f"captured, {name}": f"{one.captured:.3f}" for name, one in found.by_object.items()}
    rows["rollouts"] = rollouts
    curve = Picture("plot_probability", found, "its curve", {"legend": False})
    return Summary("Probability", list(rows.items()), notes=_notes(found), picture=curve)


# Questions


def problem(asked: _core.Problem) -> Summary:
    """The question, beside a picture of the state."""
    sets = {
        "capture set": asked.captured,
        "success set": asked.succeeded,
        "capture set of at least one object": asked.captured_any,
        "bounds of the search": asked.within,
    }
    contacts = asked.contacts
    rows = [
        ("bodies", _bodies_in_words(asked.scene)),
        ("largest force", _vector(asked.force, "N")),
        ("largest torque", _vector(asked.torque, "N m")),
        ("longest edge", f"{asked.duration:g} s"),
        ("effector", {"coast": "coasts", "drive": "is driven"}[asked.effector]),
        ("rate λ", f"{asked.rate:g} 1/J"),
        ("sets", ", ".join(name for name, region in sets.items() if region is not None)),
        ("measured contacts", "none" if contacts is None else len(contacts)),
        *em.futures.future_rows(asked),
    ]
    return Summary("Problem", rows, picture=Picture("plot_state", asked, STATE, {"detail": DETAIL}))


def plan(of_robot: _core.Plan) -> Summary:
    """What the robot does, and how long."""
    return Summary(type(of_robot).__name__, plan_rows(of_robot))


def scene(made: _core.Scene) -> Summary:
    """Its bodies, a row each."""
    head = ("body", "role", "shape", "mass [kg]", "friction")
    bodies = []
    for body in made.bodies:
        moves = "kinematic" if body.kinematic else f"{body.mass:.4g}"
        role, shape = body.role.replace("none", ""), type(body.shape).__name__
        mass = "fixed" if body.fixed else moves
        bodies.append((body.name, role, shape, mass, f"{body.friction:.3g}"))
    note = f"{len(made.joints)} joints, {len(made.springs)} springs, gravity "
    note += f"{_vector(made.gravity, 'm/s²')}, {made.dimension} numbers in a state"
    if made.friction_rule != "product":
        note += f", friction by the {made.friction_rule} of two coefficients"
    if made.pair_frictions:
        note += f", coefficients of pairs: {len(made.pair_frictions)}"
    return Summary("Scene", bodies, head, [note])


def scene_report(report: em.scenes.SceneReport) -> Summary:
    """What became of the files of a scene, a row each."""
    notes = [] if report else ["Nothing was left out, left loose, or stated."]
    return Summary("Report of a scene", [row[:3] for row in report], ("what", "name", ""), notes)


def _vector(values: Iterable[float], unit: str) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)}) {unit}"


def _bodies_in_words(scene: _core.Scene) -> str:
    parts = []
    for role, title in {"object": "object", "effector": "effector", "none": "others"}.items():
        names = [body.name for body in scene.bodies if body.role == role]
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        parts += [f"{title}: {', '.join(names[:MOST_NAMES])}{more}"] if names else []
    return "; ".join(parts)


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
