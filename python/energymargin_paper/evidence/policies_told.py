"""Questions about environments of others: what is told, and what it is worth.

Told is the probability with the policy in the loop, and along its plan; against what happened it
has an AUC with an interval, and a calibration error.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from energymargin._core import Cancel, Plan, Problem, capture_probability
from energymargin.base.aliases import Floats
from energymargin.base.table_text import markdown_table
from energymargin.records.evaluation.bootstrap import auc_ap, bootstrap_weights, intervals, ranked
from energymargin_paper.evidence.calibration import calibration_error, reliability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Question", "answered", "draw", "missing", "questions", "report"]

DRAWS = 2000  # of the bootstrap, over questions
FIRST = 10_000  # seed of the first question; those from 0 on were seen before
LOOP, OPEN, FORCE = "the policy in the loop", "its plan", "the strength of the forces alone"

Forces = Callable[[np.random.Generator, int], Floats]
"""Draws so many pieces of forces on an object, shape (pieces, 6)."""


def missing(package: str, module: str, install: str) -> str:
    """What to install; empty if all is there."""
    if find_spec(module):
        return ""
    return f"Left out: the package {package} is missing. `pip install {install}` installs it."


def questions(settings: Any) -> list[str]:
    """The cases, a question each."""
    return [f"question {k}" for k in range(settings.questions)]


class Question(NamedTuple):
    """A policy in a world of others, at a state."""

    asked: Problem
    """That world as a scene of ours, with the policy in the loop."""
    alone: Plan
    """What the policy does if nothing disturbs it."""
    forces: Forces
    strength: float
    """Of the forces [N]."""
    stays: Callable[[Floats], bool]
    """Whether the object stays there, under forces that change each `duration` of the problem."""


def answered(
    question_of: Callable[[np.random.Generator], Question],
    case: str,
    settings: Any,
    cancel: Cancel,
) -> dict[str, Any]:
    """What is told of a question, which is drawn, and what happened there."""
    seed = FIRST + int(case.split()[1])
    random = np.random.default_rng([settings.seed, seed])
    one = question_of(random)
    asked = one.asked

    def forced(random: np.random.Generator, times: Floats) -> Floats:
        piece = np.floor(times / asked.duration + 1e-9).astype(int)
        return np.asarray(one.forces(random, int(piece[-1]) + 1)[piece])

    told = {
        name: capture_probability(
            problem,
            disturbance=forced,
            rollouts=settings.rollouts,
            seed=seed,
            threads=1,
            undisturbed=False,
            cancel=cancel,
        ).captured
        for name, problem in ((LOOP, asked), (OPEN, asked.replace(plan=one.alone)))
    }
    pieces = int(np.ceil((asked.horizon or 0.0) / asked.duration - 1e-9))
    stays = one.stays(one.forces(random, pieces))
    return {**told, "stays": stays, "strength": one.strength}


def _gathered(found: dict[str, Any], name: str) -> Floats:
    """A number of each question, shape (N,)."""
    return np.array([one[name] for one in found.values()], dtype=float)


def report(text: str, settings: Any, found: dict[str, Any]) -> str:
    """A text, and what was told and what happened."""
    return f"{text}\n\n{table(found)}"


def table(found: dict[str, Any]) -> str:
    """A row for each probability of the questions; "stays" is what happened."""
    header = ["probability with", "questions", "told", "happened", "AUC", "calibration error"]
    stays = _gathered(found, "stays")
    rows = [_row(name, _gathered(found, name), stays) for name in (LOOP, OPEN)]
    alone = _row(FORCE, -_gathered(found, "strength"), stays)
    return markdown_table(header, [*rows, [*alone[:2], "", *alone[3:5], ""]])


def _row(name: str, told: Floats, stays: Floats) -> list[str]:
    counts = [name, str(len(stays)), f"{told.mean():.2f}", f"{stays.mean():.2f}"]
    if len(np.unique(stays)) < 2:
        return [*counts, "-", "-"]
    label, places = stays.astype(bool), np.arange(len(stays))
    weights = bootstrap_weights(len(stays), DRAWS, 0)
    low, high = intervals(ranked(told), label, places, weights)[0] or (np.nan, np.nan)
    auc = auc_ap(told, label)[0]
    return [*counts, f"**{auc:.3f}** {low:.3f} to {high:.3f}", _calibration(told, stays)]


def _calibration(told: Floats, stays: Floats) -> str:
    """With what a perfectly calibrated probability would have with so few questions, in the mean
    of draws: an error is never zero."""
    random = np.random.default_rng(0)
    perfect = [
        calibration_error(told, (random.random(len(told)) < told).astype(float)) for _ in range(200)
    ]
    error = calibration_error(told, stays)
    return f"**{error:.3f}** ({np.mean(perfect):.3f} if perfect)"


def draw(ax: Axes, found: dict[str, Any]) -> None:
    """What happened over what was told, in bins."""
    for name in (LOOP, OPEN):
        bins = reliability(_gathered(found, name), _gathered(found, "stays"))
        ax.plot(bins.predicted, bins.happened, "o-", ms=3, label=name)
    ax.plot([0, 1], [0, 1], color="black", lw=0.8, ls=":")
    ax.set(xlabel="probability told", ylabel="share that stayed")
    ax.legend(fontsize=7, frameon=False)
