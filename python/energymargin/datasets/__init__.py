"""Recorded trajectories of a task, with their labels: made, saved and loaded (HDF5)."""

from typing import TYPE_CHECKING

from energymargin.datasets.dataset import Dataset, load, open
from energymargin.datasets.future import Future
from energymargin.datasets.generation import generate
from energymargin.deprecations import moved_names

__all__ = ["Dataset", "Future", "generate", "load", "open"]

if not TYPE_CHECKING:
    __getattr__ = moved_names(
        __name__,
        {
            "Label": f"{__name__}.dataset.Label",
            "generate_file": f"{__name__}.generation.generate_file",
            "load_or_generate": f"{__name__}.generation.load_or_generate",
            "trajectories_kept": f"{__name__}.generation.trajectories_kept",
        },
        instead={"generate_file": f"{__name__}.generate(task, path=...)"},
    )
