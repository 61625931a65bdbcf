"""Velocities of poses that were measured: a smoothing spline through them, at their own times.

The spline (`scipy.interpolate.make_smoothing_spline`) takes unequal steps as they are. It passes
motion slower than 2 pi times its time scale, and little of what is faster; where it would leave a
measured pose by more than its noise does, as at an impact, the time scale is shorter.
docs/guides/recordings.md has the measurements that chose it, and its time scale.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.recording import Motion

__all__ = ["LEAST_FRAMES", "SIGMA_OF_MAD", "SMOOTHING", "smoothed"]

SMOOTHING = 0.06  # s; the least error of velocity at 33 Hz with 0.5 mm and 1 deg of noise
LEAST_SCALE = 0.1  # of a frame's step: smooth no more
FARTHEST = 5.0  # standard deviations of noise, from a measured pose to a smooth one
SIGMA_OF_MAD = 1.4826  # of a normal distribution
NOISE_OF_THIRD = math.sqrt(1 + 9 + 9 + 1)  # the third difference of noise has such a deviation
LEAST_FRAMES = 7  # a spline needs 5, the search for outliers 7


def smoothed(
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    at: NDArray[np.float64],
    time_scale: float,
) -> Motion:
    """Poses, shape (N, 3), at rising times [s], N >= 7: smooth, and their rates, at K times.

    The time scale [s] is halved until no smooth pose is farther from the measured one than five
    standard deviations of the noise, which the third differences of the poses tell.
    """
    start, step = times[0], float(np.median(np.diff(times)))
    moments = (times - start) / step  # in steps, so that the spline's equations are of the size 1
    splines = [_spline(moments, column, time_scale / step) for column in poses.T]
    wanted = (at - start) / step
    return Motion(
        np.stack([spline(wanted) for spline in splines], axis=1),
        np.stack([spline.derivative()(wanted) / step for spline in splines], axis=1),
    )


def _noise(values: NDArray[np.float64]) -> float:
    """Its standard deviation, from where the values change: a tracker may hold still or round."""
    third = np.abs(np.diff(values, 3))
    if not third.any():
        return 0.0
    return SIGMA_OF_MAD * float(np.median(third[third > 0])) / NOISE_OF_THIRD


def _spline(moments: NDArray[np.float64], values: NDArray[np.float64], scale: float) -> Any:
    from scipy.interpolate import make_smoothing_spline

    noise = _noise(values)
    while True:
        spline = make_smoothing_spline(moments, values, lam=scale**4)
        away = np.abs(spline(moments) - values).max()
        if away <= FARTHEST * noise or scale < LEAST_SCALE:
            return spline
        scale /= 2
