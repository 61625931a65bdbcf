"""What results look like in a notebook: a small table in HTML, of a problem with its
picture and of a probability with its curve.

Nothing here is in the way of a cell: what cannot be shown is shown as text.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from energymargin._core import (
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    EscapeEnergy,
    ForceScore,
    Plan,
    Problem,
    Scene,
    Tree,
)
from energymargin.datasets import Dataset
from energymargin.evaluation import Evaluation, LabelledScores
from energymargin.notebook import data, probabilities, problems, results
from energymargin.scoring import ScoreTable
from energymargin.store import Run, ScoreStore
from energymargin.tasks.base import Trajectory

__all__ = ["attach"]

METHOD = "_repr_html_"  # which a notebook asks for
SHOWN: dict[type, Callable[[Any], str]] = {
    CaptureProbability: probabilities.capture_probability,
    CaptureScore: results.capture_score,
    EscapeEffort: results.escape_effort,
    EscapeEnergy: results.escape_energy,
    ForceScore: results.force_score,
    Tree: results.tree,
    Plan: problems.plan,
    Problem: problems.problem,
    Scene: problems.scene,
    Dataset: data.dataset,
    Evaluation: data.evaluation,
    LabelledScores: data.labelled_scores,
    Run: data.run,
    ScoreStore: data.score_store,
    ScoreTable: data.score_table,
    Trajectory: data.trajectory,
}


def attach() -> None:
    """Lets notebooks show the results, as `_repr_html_` of their classes."""
    for kind, shown in SHOWN.items():
        setattr(kind, METHOD, _safe(shown))


def _safe(shown: Callable[[Any], str]) -> Callable[[Any], str]:
    """The same, that shows text instead of raising."""

    def shown_or_text(self: Any) -> str:
        try:
            return shown(self)
        except Exception as error:  # a damaged thing is shown as far as it can be
            return f"<pre>{escape(_plain(self))}\ncannot be shown: {escape(_plain(error))}</pre>"

    return shown_or_text


def _plain(thing: object) -> str:
    try:
        return repr(thing)
    except Exception:
        return f"<{type(thing).__name__}>"
