"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from energymargin.datasets.dataset import Dataset, Label
from energymargin.datasets.future import Future
from energymargin.datasets.generation import generate, load_or_generate
from energymargin.datasets.generation_to_file import generate_file, trajectories_kept
from energymargin.datasets.loading import load, open

__all__ = [
    "Dataset",
    "Future",
    "Label",
    "generate",
    "generate_file",
    "load",
    "load_or_generate",
    "open",
    "trajectories_kept",
]
