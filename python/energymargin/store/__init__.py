"""Scores on disk: durable, and known by what was scored."""

from energymargin.doors import check_doors
from energymargin.store.export import export, load
from energymargin.store.file import ScoreStore, add_scores
from energymargin.store.lerobot import export_lerobot
from energymargin.store.run import Run
from energymargin.store.scoring import score_dataset

__all__ = ["Run", "ScoreStore", "add_scores", "export", "export_lerobot", "load", "score_dataset"]

check_doors(globals(), __all__)
