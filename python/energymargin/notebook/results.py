"""What searches, scores and probabilities of one problem look like in a notebook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    EscapeEnergy,
    ForceScore,
    Tree,
)
from energymargin.notebook.tables import NamedValue, beside, drawn, table

__all__ = [
    "capture_probability",
    "capture_score",
    "escape_effort",
    "escape_energy",
    "force_score",
    "tree",
]

NONE_FOUND = "infinite: no way out was found"
NOTHING_SEARCHED = "It was stopped before anything was searched: there is no value."
NOISE = 1e-12  # N, or m; what is less is left of numbers that cancel out

SIZE = (4.5, 3.0)  # inch, of the curve
EQUAL = 1e-9  # of their number: weights that differ by less do not


def capture_score(score: CaptureScore) -> str:
    """Likelihoods with their standard errors, if there are several trees."""
    if not (score.nodes or score.complete):
        return table("Capture score", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = []
    for which in ("capture", "success", "capture_any", "success_any"):
        value = getattr(score, which)
        if value is not None:
            rows.append((_of_any(which), _likelihood(value, getattr(score, f"{which}_stderr"))))
    trees = len(score.capture_by_tree)
    rows.append(("no score is finer than", f"{score.resolution:.2g}"))
    rows.append(("trees", f"{trees} of {score.nodes} nodes"))
    return table("Capture score", rows, _said(_unfinished(score.complete), score.doubts))


def _of_any(which: str) -> str:
    name = which.removesuffix("_any")
    return name if name == which else f"{name}, at least one object"


def _likelihood(value: float, stderr: float | None) -> str:
    return f"{value:.3f}" if stderr is None else f"{value:.3f} ± {stderr:.3f} (standard error)"


def escape_effort(result: EscapeEffort) -> str:
    """The effort, and when it was found."""
    if not (result.nodes or result.complete):
        return table("Effort of escape", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = [("effort", _energy(result.effort))]
    if math.isfinite(result.effort):
        rows.append(("path", f"{max(len(result.path) - 1, 0)} edges"))
        rows.append(("found at node", result.history[-1][0] if result.history else 0))
    rows.append(("nodes", result.nodes))
    return table("Effort of escape", rows, _unfinished(result.complete))


def escape_energy(result: EscapeEnergy) -> str:
    """The barrier, and how it was found."""
    if not (result.samples or result.complete):
        return table("Escape energy", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = [("energy", _energy(result.energy))]
    if math.isfinite(result.energy):
        rows.append(("path", f"{len(result.path)} states, the barrier at row {result.barrier}"))
    rows.append(("poses drawn", result.samples))
    return table("Escape energy", rows, _unfinished(result.complete))


def force_score(score: ForceScore) -> str:
    """The score, and what it is made of."""
    return table(
        "Force score",
        [
            ("score", _without_noise(score.force)),
            ("distance of object and effector", f"{_without_noise(score.distance)} m"),
            ("effector: normal forces", f"{_without_noise(score.effector.engage)} N"),
            ("effector: to the friction cones' edges", f"{_without_noise(score.effector.stick)} N"),
            ("all else: normal forces", f"{_without_noise(score.ground.engage)} N"),
            ("all else: to the friction cones' edges", f"{_without_noise(score.ground.stick)} N"),
        ],
    )


def _without_noise(value: float) -> str:
    return f"{value:.4g}" if abs(value) > NOISE else "0"


def tree(found: Tree) -> str:
    """How large a search tree is."""
    rows: list[NamedValue] = [
        ("nodes", f"{len(found) - 1} and the root"),
        ("numbers in a state", found.states.shape[1]),
        ("largest cost", _energy(float(found.costs.max()))),
        ("longest edge", f"{float(found.durations.max()):.3g} s"),
    ]
    return table("Search tree", rows)


def _energy(energy: float) -> str:
    return f"{energy:.4g} J" if math.isfinite(energy) else NONE_FOUND


def _said(unfinished: str, doubts: Sequence[str]) -> str:
    """As sentences, in a line."""
    sentences = [f"{doubt[0].upper()}{doubt[1:]}." for doubt in doubts]
    return " ".join([*sentences, unfinished]).strip()


def _unfinished(complete: bool) -> str:
    return "" if complete else "Not complete: it was stopped before its end."


def capture_probability(found: CaptureProbability) -> str:
    """The probability with its interval, what became of it undisturbed, and the curve beside."""
    horizon = float(found.times[-1])
    rows: list[NamedValue] = [
        (f"captured for {horizon:.3g} s", _with_interval(found, found.captured, "captured")),
        ("mean time captured", f"{found.mean_time:.3g} s"),
        ("undisturbed", _undisturbed(found)),
    ]
    if found.success is not None:
        rows.append(("success at the end", _with_interval(found, found.success, "success")))
    if found.any is not None:
        value = _with_interval(found, found.any.captured, "any")
        rows.append(("captured, at least one object", value))
    rows += [
        (f"captured, object {number}", f"{one.captured:.3f}")
        for number, one in enumerate(found.by_object)
    ]
    rows.append(("rollouts", _rollouts(found)))
    said = "" if found.complete else "Not complete: it was stopped before its end."
    return beside(table("Probability", rows, said), drawn(_draw(found), SIZE), "its curve")


def _with_interval(found: CaptureProbability, value: float, which: str) -> str:
    low, high = found.interval(which=which)
    return f"{value:.3f} ({low:.3f} to {high:.3f} with 95 % confidence)"


def _undisturbed(found: CaptureProbability) -> str:
    stays = "stays captured" if found.undisturbed else f"leaves at {found.undisturbed_time:.3g} s"
    if found.undisturbed_success is None:
        return stays
    return f"{stays}, {'succeeds' if found.undisturbed_success else 'does not succeed'}"


def _rollouts(found: CaptureProbability) -> str:
    words = [str(found.rollouts)]
    if abs(found.effective - found.rollouts) > EQUAL * found.rollouts:
        words.append(f"worth {found.effective:.3g} of equal weight")
    if found.diverged:
        words.append(f"and {found.diverged} that diverged and do not count")
    return ", ".join(words)


def _draw(found: CaptureProbability) -> Any:
    def draw(ax: Any) -> None:
        from energymargin.plots import plot_probability

        plot_probability(found, ax, legend=False)

    return draw
