"""A dataset from its file: as a whole, or open, to be read in blocks.

Files of the versions 1 and 2 have a group for each trajectory; they are read whole.

    attributes          format, version, task, parameters (JSON), seed, count (of trajectories)
    trajectories/0000/  times (K,), states (K, n), captured (K,), contacts (C,)
                        attributes: success, seed, params (JSON)
                        with several objects also captured_any (K,) and the attribute success_any
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact
from energymargin.datasets.dataset import Dataset
from energymargin.datasets.files import Recorded, opened, reading
from energymargin.trajectories import Trajectory

__all__ = ["load", "open"]

_NUMBERS = ("position", "normal", "distance", "normal_force", "tangential_force", "friction")


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
        trajectories: Sequence[Trajectory] = _older_trajectories(file) if older else []
    if older:
        file.close()
    else:
        trajectories = Recorded(path, file)
    return Dataset(task, parameters, seed, trajectories)


def _older_trajectories(file: h5py.File) -> list[Trajectory]:
    """All of them. Raises an error of h5py's, or ValueError, if something is missing or odd."""
    groups = file["trajectories"]
    if len(groups) != file.attrs["count"] or len(groups) == 0:
        raise ValueError(f"it has {len(groups)} of {file.attrs['count']} trajectories")
    return [_trajectory(groups[name]) for name in sorted(groups, key=int)]


def _trajectory(group: h5py.Group) -> Trajectory:
    times, states, captured = (group[name][()] for name in ("times", "states", "captured"))
    success_any = group.attrs.get("success_any")
    return Trajectory(
        times=times,
        states=states,
        contacts=_contacts(group["contacts"][()], len(times)),
        captured=captured,
        success=bool(group.attrs["success"]),
        params=json.loads(group.attrs["params"]),
        seed=int(group.attrs["seed"]),
        captured_any=group["captured_any"][()] if "captured_any" in group else None,
        success_any=None if success_any is None else bool(success_any),
    )


def _contacts(rows: NDArray[np.void], frames: int) -> list[list[Contact]]:
    contacts: list[list[Contact]] = [[] for _ in range(frames)]
    for row in rows:
        if not 0 <= row["frame"] < frames:
            raise ValueError(f"a contact is of frame {row['frame']}, and there are {frames}")
        values: dict[str, Any] = {name: row[name] for name in _NUMBERS}
        bodies = {name: row[name].decode() for name in ("body_a", "body_b")}
        contacts[row["frame"]].append(Contact(**bodies, **values))
    return contacts
