"""Summaries of searches, and of what is asked of them: problems, plans and scenes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import energymargin as em
from energymargin import _core
from energymargin.base.summary import Picture, Summary
from energymargin.base.table_text import sentence
from energymargin.evaluate.futures import plan_rows

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
    rows = [
        ("score", _without_noise(score.force)),
        ("distance of object and effector", f"{_without_noise(score.distance)} m"),
    ]
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
