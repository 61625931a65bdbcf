"""Files of the versions 1 and 2, which have a group for each trajectory; they are read whole.

attributes          format, version, task, parameters (JSON), seed, count (of trajectories)
trajectories/0000/  times (K,), states (K, n), captured (K,), contacts (C,)
                    attributes: success, seed, params (JSON)
                    with several objects also captured_any (K,) and the attribute success_any
"""

from __future__ import annotations

import json
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact
from energymargin.tasks.base import Trajectory

__all__ = ["read_trajectories"]

_NUMBERS = ("position", "normal", "distance", "normal_force", "tangential_force", "friction")


def read_trajectories(file: h5py.File) -> list[Trajectory]:
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
