"""Scores on disk: durable, and known by what was scored."""

from energymargin.base.doors import check_doors
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.records.store.export import curves_path, export, export_lerobot, load
from energymargin.records.store.file import ScoreStore, add_scores
from energymargin.records.store.run import Run
from energymargin.records.store.scoring import begin_run, dataset_metrics, score_dataset, score_run

__all__ = [
    "AnswerFile",
    "Run",
    "ScoreStore",
    "add_scores",
    "begin_run",
    "curves_path",
    "dataset_metrics",
    "export",
    "export_lerobot",
    "load",
    "score_dataset",
    "score_run",
]

check_doors(globals(), __all__)
