"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from energymargin.base.doors import check_doors
from energymargin.records.datasets.dataset import Dataset, load, open
from energymargin.records.datasets.future import Future
from energymargin.records.datasets.generation import generate
from energymargin.records.datasets.question import usual_future

__all__ = ["Dataset", "Future", "generate", "load", "open", "usual_future"]

check_doors(globals(), __all__)
