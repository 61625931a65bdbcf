"""Scores on disk: durable, shared by several scorers, and known by what was scored."""

from energymargin.store.export import curves_path, export, load
from energymargin.store.file import ScoreStore
from energymargin.store.given import add_scores
from energymargin.store.run import Run
from energymargin.store.scoring import begin_run, dataset_metrics, score_dataset, score_run

__all__ = [
    "Run",
    "ScoreStore",
    "add_scores",
    "begin_run",
    "curves_path",
    "dataset_metrics",
    "export",
    "load",
    "score_dataset",
    "score_run",
]
