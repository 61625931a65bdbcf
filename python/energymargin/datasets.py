"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from energymargin.records.datasets import *  # noqa: F403
from energymargin.records.datasets import __all__ as __all__  # noqa: PLC0414
