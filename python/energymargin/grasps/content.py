"""What a file of grasps says, in its own frames and units, between its format and a GraspSet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import shown
from energymargin.grasps.grasp_set import ROUNDED

Column = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Content:
    """n rows, and what is not of a row."""

    format: str
    poses: NDArray[np.float64]
    """Shape (n, 4, 4)."""
    columns: dict[str, Column] = field(default_factory=dict)
    """By name, each of shape (n,); labels and openings too."""
    names: tuple[str, ...] = ()
    object: Mapping[str, Any] = field(default_factory=dict)
    """What is said of the object: file, scale, mass, com, inertia, friction."""
    header: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    opening: str = ""


def nested(columns: Mapping[str, Column], k: int) -> dict[str, Any]:
    """Row k as plain values, "a/b" as b within a; without what it does not have."""
    row: dict[str, Any] = {}
    for name, column in columns.items():
        value = column[k]
        if value is not None:
            *outer, last = name.split("/")
            place = row
            for key in outer:
                place = place.setdefault(key, {})
            place[last] = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    return row


def column_of(values: Sequence[Any]) -> Column:
    """Values of n rows as an array (n, ...) of numbers or text, or else (n,) of objects."""
    try:
        column = np.asarray(values)
    except ValueError:  # of several lengths
        column = np.empty(0, object)
    if column.dtype.kind in "biufU" and len(column) == len(values):
        return column
    column = np.empty(len(values), object)
    column[:] = values
    return column


def without_nan(column: Column) -> Column:
    """Shape (n,), None where it is NaN; as it is if it has none."""
    if column.dtype.kind != "f" or column.ndim > 1 or not np.isnan(column).any():
        return column
    plain = column.astype(object)
    plain[np.isnan(column)] = None
    return plain


def as_numbers(name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A list of numbers of a file, also as text; -1 in `shape` is any length."""
    expected = f"numbers of shape {tuple('n' if size < 0 else size for size in shape)}"
    try:
        numbers = np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is no array of {expected}: {error}".replace("'", "")) from error
    right = numbers.ndim == len(shape) and all(
        size in (-1, found) for size, found in zip(shape, numbers.shape, strict=True)
    )
    if not right:
        raise ValueError(f"{name} has the shape {numbers.shape}, expected {expected}")
    return numbers


def poses_of(positions: NDArray[np.float64], quaternions: NDArray[np.float64]) -> NDArray[Any]:
    """Poses (n, 4, 4) from positions (n, 3) and unit quaternions x, y, z, w (n, 4).

    Raises ValueError that names the first row, from 1 on, whose quaternion has another norm.
    """
    from scipy.spatial.transform import Rotation

    norms = np.linalg.norm(quaternions, axis=1)
    if not (np.abs(norms - 1) <= ROUNDED).all():
        k = int(np.argmin(np.abs(norms - 1) <= ROUNDED))
        raise ValueError(
            f"the quaternion of grasp {k + 1} is {shown(tuple(quaternions[k].tolist()))} (x, y, z, "
            f"w) with the norm {norms[k]:.4g}, expected 1: are its columns the ones that are meant?"
        )
    poses = np.broadcast_to(np.eye(4), (len(positions), 4, 4)).copy()
    poses[:, :3, 3] = positions
    poses[:, :3, :3] = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix()
    return poses


def quaternions_of(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions x, y, z, w with w >= 0, shape (n, 4)."""
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    return np.asarray(quaternions * np.where(quaternions[:, 3:] < 0, -1.0, 1.0))
