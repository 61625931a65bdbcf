"""Bodies in the plane of x and y, as the authors record them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Region

__all__ = ["COLUMNS", "between", "placed", "swept"]

COLUMNS = (
    *("xo", "yo", "thetao", "vxo", "vyo", "omegao"),
    *("xg", "yg", "thetag", "vxg", "vyg", "omegag"),
)
"""Of object and effector: position [m], yaw [rad], and their rates."""


def placed(row: NDArray[np.float64], height: float) -> dict[str, Any]:
    """Keywords of `Scene.pack` for a body of this height of its centre [m]."""
    x, y, yaw, vx, vy, yaw_rate = row.tolist()
    return {
        "position": (x, y, height),
        "yaw": yaw,
        "velocity": (vx, vy, 0.0),
        "angular_velocity": (0.0, 0.0, yaw_rate),
    }


def swept(
    half_width: float, ahead: float, ends: float, least_speed: float, at: dict[str, Any] | None
) -> Region:
    """What the effector is about to sweep: `ends` [m] of its path more at both ends, and a disc of
    twice the half width while it is slow."""
    return regions.Swept(
        "object",
        by="effector",
        half_width=half_width,
        behind=ends,
        ahead=ahead,
        beyond=ends,
        least_speed=least_speed,
        disc_radius=2 * half_width,
        at=at,
    )


def between(axis: tuple[float, float, float], low: float, high: float) -> Region:
    """The object's centre between two planes across an axis [m]."""
    normal = np.array(axis)
    return regions.HalfSpace("object", normal, high) & regions.HalfSpace("object", -normal, -low)
