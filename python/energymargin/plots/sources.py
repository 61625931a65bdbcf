"""Where the scores that are drawn come from."""

from __future__ import annotations

import os

from energymargin.evaluation import LabelledScores
from energymargin.store import Run, ScoreStore

__all__ = ["Scores", "labelled_scores"]

Scores = LabelledScores | Run | ScoreStore | str | os.PathLike[str]
"""Scores with their labels: in memory, of a run, or of the only run of a file, by its path too."""


def labelled_scores(scores: Scores) -> LabelledScores:
    """What there is; ValueError if it is none of these, or a file that has not just one run."""
    if isinstance(scores, LabelledScores):
        return scores
    if isinstance(scores, Run):
        return scores.labelled_scores()
    if isinstance(scores, ScoreStore):
        return scores.run().labelled_scores()
    if isinstance(scores, (str, os.PathLike)):
        with ScoreStore(scores) as store:
            return labelled_scores(store)
    raise ValueError(
        f"scores is a {type(scores).__name__}, expected LabelledScores, a Run or a ScoreStore, or "
        "the path of a file of scores"
    )
