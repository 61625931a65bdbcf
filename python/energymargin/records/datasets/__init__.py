"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from energymargin.base.doors import check_doors
from energymargin.records.datasets.dataset import Dataset, left_out_text, load, open, usual_future
from energymargin.records.datasets.future import Future
from energymargin.records.datasets.generation import generate, trajectories_kept

__all__ = [
    "Dataset",
    "Future",
    "generate",
    "left_out_text",
    "load",
    "open",
    "trajectories_kept",
    "usual_future",
]

check_doors(globals(), __all__)
