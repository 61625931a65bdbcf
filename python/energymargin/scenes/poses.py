"""Poses as matrices, shape (4, 4), which take points of the inner frame to the outer one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Compound, MassProperties, Part

__all__ = ["Pose", "moved", "place", "pose", "vector"]

Pose = NDArray[np.float64]


def pose(position: Sequence[float], orientation: Sequence[float]) -> Pose:
    """From a position (3,) [m] and a unit quaternion x, y, z, w; ValueError on anything else."""
    from scipy.spatial.transform import Rotation

    quaternion = vector("orientation", orientation, 4)
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-6:
        raise ValueError(f"orientation is {orientation!r}, expected a unit quaternion x, y, z, w")
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    matrix[:3, 3] = vector("position", position, 3)
    return matrix


def place(matrix: Pose) -> dict[str, NDArray[np.float64]]:
    """The keywords position (3,) and orientation (4,) of a pose."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True)
    return {"position": matrix[:3, 3], "orientation": turn}


def moved(compound: Compound, matrix: Pose) -> Compound:
    """A compound whose parts stand at their frame, moved to a pose."""
    from scipy.spatial.transform import Rotation

    parts = [Part(part.shape, **place(matrix)) for part in compound.parts]
    if compound.solid is None:
        return Compound(parts)
    solid = compound.solid
    turned = Rotation.from_matrix(matrix[:3, :3]) * Rotation.from_quat(solid.axes)
    center = matrix[:3, :3] @ solid.center + matrix[:3, 3]
    return Compound(
        parts, solid=MassProperties(solid.volume, center, solid.moments, turned.as_quat())
    )


def vector(name: str, given: Any, size: int) -> NDArray[np.float64]:
    """An argument of `size` finite numbers; ValueError on anything else."""
    values = np.asarray(given, float)
    if values.shape != (size,) or not np.isfinite(values).all():
        raise ValueError(f"{name} is {given!r}, expected {size} finite numbers")
    return values
