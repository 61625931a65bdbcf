"""Scores on disk: durable, shared by several scorers, and known by what was scored."""

from typing import TYPE_CHECKING

from energymargin.deprecations import moved_names
from energymargin.store.export import export, load
from energymargin.store.file import ScoreStore, add_scores
from energymargin.store.run import Run
from energymargin.store.scoring import score_dataset

__all__ = ["Run", "ScoreStore", "add_scores", "export", "load", "score_dataset"]

if not TYPE_CHECKING:
    __getattr__ = moved_names(
        __name__,
        {
            "begin_run": f"{__name__}.scoring.begin_run",
            "curves_path": f"{__name__}.export.curves_path",
            "dataset_metrics": f"{__name__}.scoring.dataset_metrics",
            "score_run": f"{__name__}.scoring.score_run",
        },
    )
