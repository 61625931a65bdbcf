"""What a file of grasps says, in its own frames and units, between its format and a GraspSet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import shown
from energymargin.grasps.grasp_set import ROUNDED, Column, Poses


@dataclass(frozen=True, eq=False)
class Content:
    """n rows, and what is not of a row."""

    format: str
    poses: Poses
    """Shape (n, 4, 4)."""
    columns: dict[str, Column] = field(default_factory=dict)
    """By name, each of length n; labels and openings too. "a/b" is b within a."""
    names: tuple[str, ...] = ()
    object: Mapping[str, Any] = field(default_factory=dict)
    """What is said of the object: file, scale, mass, com, inertia, friction."""
    header: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    opening: str = ""
    frame: str | None = None
    """The frame of the hand, by name, if all files of the format have the same."""


def column_of(values: Sequence[Any]) -> Column:
    """Values of n rows as an array (n, ...) of numbers or text, or else (n,) of objects."""
    try:
        column = np.asarray(values)
    except ValueError:  # of several lengths
        column = np.empty(0, object)
    if column.dtype.kind not in "biufU":
        column = np.empty(len(values), object)
        column[:] = values
    return column


def plain(column: Column) -> list[Any]:
    """Values of Python, None for NaN."""
    if column.dtype.kind == "f" and column.ndim == 1 and np.isnan(column).any():
        column = np.where(np.isnan(column), np.array(None), column)
    return list(column.tolist())


def flat(entries: Mapping[Any, Any], prefix: str = "") -> dict[str, Any]:
    """Entries by name, b within a as "a/b"."""
    found: dict[str, Any] = {}
    for key, value in entries.items():
        name = f"{prefix}{key}"
        found |= flat(value, f"{name}/") if isinstance(value, dict) else {name: value}
    return found


def nested(entries: Mapping[str, Any]) -> dict[str, Any]:
    """What `flat` was given."""
    whole: dict[str, Any] = {}
    for name, value in entries.items():
        *outer, last = name.split("/")
        place = whole
        for key in outer:
            place = place.setdefault(key, {})
        place[last] = value
    return whole


def poses_of(positions: NDArray[np.float64], quaternions: NDArray[np.float64]) -> Poses:
    """Poses (n, 4, 4) from positions (n, 3) and unit quaternions x, y, z, w (n, 4).

    Raises ValueError that names the first row, from 1 on, whose quaternion has another norm.
    """
    from scipy.spatial.transform import Rotation

    norms = np.linalg.norm(quaternions, axis=1)
    right = np.abs(norms - 1) <= ROUNDED
    if not right.all():
        k = int(np.argmin(right))
        raise ValueError(
            f"the quaternion of grasp {k + 1} is {shown(tuple(quaternions[k].tolist()))} (x, y, z, "
            f"w) with the norm {norms[k]:.4g}, expected 1: are its columns the ones that are meant?"
        )
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    if len(poses):
        poses[:, :3, :3] = Rotation.from_quat(quaternions).as_matrix()
    return poses


def quaternions_of(poses: Poses) -> NDArray[np.float64]:
    """Quaternions x, y, z, w with w >= 0, shape (n, 4)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(poses[:, :3, :3]).as_quat(canonical=True))
