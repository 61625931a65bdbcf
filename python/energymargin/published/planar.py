"""Tasks in the plane of x and y whose object is captured in what the effector is about to sweep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Region
from energymargin.published.task import PublishedTask
from energymargin.tasks.base import Params

__all__ = ["COLUMNS", "Sweep", "SweptTask", "between", "placed"]

COLUMNS = (
    *("xo", "yo", "thetao", "vxo", "vyo", "omegao"),
    *("xg", "yg", "thetag", "vxg", "vyg", "omegag"),
)
"""Of object and effector: position [m], yaw [rad], and their rates."""


@dataclass(frozen=True)
class Sweep:
    """The measures of a capture set."""

    half_width: float
    """On both sides of the effector's path [m]."""
    ahead: float
    """Of its motion [s]."""
    ends: float
    """Of its path, which counts in addition at both ends [m]."""
    least_speed: float
    """Below it the set is a disc [m/s]."""
    disc_radius: float
    """[m]"""

    def region(self, at: dict[str, Any] | None) -> Region:
        """From a fixed motion, or from where the effector is."""
        return regions.Swept(
            "object",
            by="effector",
            half_width=self.half_width,
            behind=self.ends,
            ahead=self.ahead,
            beyond=self.ends,
            least_speed=self.least_speed,
            disc_radius=self.disc_radius,
            at=at,
        )


class SweptTask(PublishedTask):
    """The object is captured in what the effector is about to sweep."""

    sweep: ClassVar[Sweep]

    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """What the effector is about to sweep from where it is at this state, shape (26,)."""
        effector = self.scene(params).unpack(state)["effector"]
        return self.sweep.region(
            {
                "position": effector["position"][:2],
                "velocity": effector["velocity"][:2],
                "yaw_rate": effector["angular_velocity"][2],
            }
        )

    def captured_throughout(self, params: Params) -> Region:
        """What the effector is about to sweep from where it has come to."""
        return self.sweep.region(None)


def placed(row: NDArray[np.float64], height: float) -> dict[str, Any]:
    """Keywords of `Scene.pack` for a body with x, y, yaw and their rates, shape (6,), at this
    height of its centre [m]."""
    x, y, yaw, vx, vy, yaw_rate = row.tolist()
    return {
        "position": (x, y, height),
        "yaw": yaw,
        "velocity": (vx, vy, 0.0),
        "angular_velocity": (0.0, 0.0, yaw_rate),
    }


def between(axis: tuple[float, float, float], low: float, high: float) -> Region:
    """The object's centre between two planes across an axis [m]."""
    normal = np.array(axis)
    return regions.HalfSpace("object", normal, high) & regions.HalfSpace("object", -normal, -low)
