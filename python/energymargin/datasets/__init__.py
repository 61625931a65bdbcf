"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from energymargin.datasets.dataset import Dataset, load, open
from energymargin.datasets.future import Future
from energymargin.datasets.generation import generate
from energymargin.datasets.question import usual_future
from energymargin.doors import check_doors

__all__ = ["Dataset", "Future", "generate", "load", "open", "usual_future"]

check_doors(globals(), __all__)
