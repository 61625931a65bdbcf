"""Velocities of poses that were measured: a smoothing spline through them, at their own times.

The spline (`scipy.interpolate.make_smoothing_spline`) takes unequal steps as they are. It passes
motion slower than 2 pi times its time scale, and little of what is faster; where it would leave a
measured pose by more than noise does, as at an impact, the body gets a shorter time scale.
docs/recordings.md has the measurement that chose it, and its time scale.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.recording import Motion

__all__ = ["LEAST_FRAMES", "SMOOTHING", "smoothed"]

SMOOTHING = 0.06  # s; the least error of velocity at 33 Hz with 0.5 mm and 1 deg of noise
LEAST_SCALE = 0.1  # of a frame's step: smooth no more
LEAST_FRAMES = 7  # a spline needs 5, the search for outliers 7


def smoothed(
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    at: NDArray[np.float64],
    time_scale: float,
    noise: tuple[float, float],
) -> Motion:
    """Poses, shape (N, 3), at rising times [s], N >= 7: smooth, and their rates, at K times.

    The time scale [s] is halved until no smooth pose is farther from the measured one than `noise`
    [m, rad].
    """
    from scipy.interpolate import make_smoothing_spline

    start, step = times[0], float(np.median(np.diff(times)))
    moments = (times - start) / step  # so that the spline's equations are of the size 1
    scale = time_scale / step
    while True:
        spline = make_smoothing_spline(moments, poses, lam=scale**4)
        away = np.abs(spline(moments) - poses).max(axis=0)
        if (away <= [noise[0], noise[0], noise[1]]).all() or scale < LEAST_SCALE:
            break
        scale /= 2
    wanted = (at - start) / step
    return Motion(spline(wanted), spline.derivative()(wanted) / step)
