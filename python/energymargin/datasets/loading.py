"""A dataset from its file: as a whole, or open, to be read in blocks."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import h5py

from energymargin.datasets.dataset import Dataset
from energymargin.datasets.files import Recorded, opened, reading
from energymargin.datasets.older_files import read_trajectories
from energymargin.tasks.base import Trajectory

__all__ = ["load", "open"]


def load(path: str | os.PathLike[str]) -> Dataset:
    """The dataset in a file, all of it in memory.

    Raises FileNotFoundError if there is none, and ValueError if it is not an HDF5 file, or a
    truncated one, or holds something else than a dataset, or comes from a newer version.
    """
    with open(path) as dataset:
        return Dataset(dataset.task, dataset.parameters, dataset.seed, list(dataset.trajectories))


def open(path: str | os.PathLike[str]) -> Dataset:
    """The dataset in a file, whose trajectories are read in blocks when they are asked for.

    Memory stays flat however many there are, except for a file of the versions 1 and 2. Close it,
    or use it in a `with` statement. Raises: as `load`, of what is damaged when that is read.
    """
    path = Path(path)
    file = opened(path)
    try:
        return _dataset(path, file)
    except BaseException:
        file.close()
        raise


def _dataset(path: Path, file: h5py.File) -> Dataset:
    with reading(path):
        parameters = json.loads(file.attrs["parameters"])
        if not isinstance(parameters, dict):
            raise ValueError(f"its parameters are {parameters!r}")
        task, seed = str(file.attrs["task"]), int(file.attrs["seed"])
        older = int(file.attrs["version"]) < 3
        trajectories: Sequence[Trajectory] = read_trajectories(file) if older else []
    if older:
        file.close()
    else:
        trajectories = Recorded(path, file)
    return Dataset(task, parameters, seed, trajectories)
