"""Velocities of poses that were measured: a smoothing spline through them, at their own times.

The spline (`scipy.interpolate.make_smoothing_spline`) takes unequal steps as they are. It passes
motion slower than 2 pi times its time scale, and little of what is faster. docs/recordings.md has
the measurement that chose it, and its time scale.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.recording import Motion

__all__ = ["LEAST_FRAMES", "SMOOTHING", "smoothed"]

SMOOTHING = 0.06  # s; the least error of velocity at 33 Hz with 0.5 mm and 1 deg of noise
LEAST_FRAMES = 7  # a spline needs 5, the search for outliers 7


def smoothed(
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    at: NDArray[np.float64],
    time_scale: float,
) -> Motion:
    """Poses, shape (N, 3), at rising times [s], N >= 7: smooth, and their rates, at K times."""
    from scipy.interpolate import make_smoothing_spline

    start, step = times[0], float(np.median(np.diff(times)))
    # In steps, so that the spline's equations are of the size 1; a kernel of this time scale.
    spline = make_smoothing_spline((times - start) / step, poses, lam=(time_scale / step) ** 4)
    moments = (at - start) / step
    return Motion(spline(moments), spline.derivative()(moments) / step)
