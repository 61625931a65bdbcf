"""A recording: when, where two bodies were and how they moved, and what was mended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Scene

__all__ = ["Mended", "Motion", "Recording"]


@dataclass(frozen=True)
class Motion:
    """One body in the plane, over K frames."""

    poses: NDArray[np.float64]
    """x, y [m] and yaw [rad, without jumps], shape (K, 3)."""
    velocities: NDArray[np.float64]
    """Their rates [m/s, rad/s], shape (K, 3)."""


@dataclass(frozen=True)
class Mended:
    """What was not as the camera saw it, by the numbers of the frames."""

    missing: tuple[int, ...] = ()
    """Frames that the file does not have: interpolated."""
    unseen: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """By body, the frames in which its marker was not seen: interpolated."""
    outliers: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """By body, the frames in which its marker jumped: interpolated."""
    left_out: tuple[int, ...] = ()
    """Frames before both bodies were first seen, or after they were last seen: left out."""

    @property
    def frames(self) -> tuple[int, ...]:
        """All frames with a pose that was not seen so."""
        numbers = {*self.missing}
        for by_body in (self.unseen, self.outliers):
            numbers.update(number for body in by_body.values() for number in body)
        return tuple(sorted(numbers))

    def __str__(self) -> str:
        """The counts, in words."""
        counts = [
            (len(self.missing), "missing frames filled"),
            *((len(n), f"poses of the {body} not seen, filled") for body, n in self.unseen.items()),
            *((len(n), f"outliers of the {body} replaced") for body, n in self.outliers.items()),
            (len(self.left_out), "frames at its ends left out"),
        ]
        return ", ".join(f"{count} {what}" for count, what in counts if count) or "nothing mended"


@dataclass(frozen=True)
class Recording:
    """K frames of two bodies in the plane, as a camera saw them."""

    name: str
    """The file's."""
    frames: NDArray[np.int64]
    """The camera's number of each frame, shape (K,)."""
    times: NDArray[np.float64]
    """[s], shape (K,); they rise, not always by the same step."""
    object: Motion
    effector: Motion
    mended: Mended

    def __len__(self) -> int:
        """K, the number of frames."""
        return len(self.times)

    def states(self, scene: Scene, **options: Any) -> NDArray[np.float64]:
        """The states of these frames in a scene, shape (K, n); options, errors: as of `placed`."""
        from energymargin.recordings.placement import placed

        return placed(self, scene, **options).states
