"""Frames in which a marker jumped: a Hampel filter about the motion's own slope.

Seven frames around each one have a median slope, and about that line a median and a median absolute
deviation. A frame is an outlier if it lies farther from the median than three times that deviation
(scaled to a standard deviation), and farther than a least jump both from the median and from the
line between its neighbours, which would replace it. Two wrong frames of seven change none of these
medians by much; where the motion itself starts, stops or bounces there is no outlier. Of a yaw,
sine and cosine are looked at, which do not wrap.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from energymargin.recordings.smoothing import SIGMA_OF_MAD

__all__ = ["LEAST_JUMP", "LEAST_TURN", "jumps"]

LEAST_JUMP = 5e-3  # m; ten times a good camera's noise
LEAST_TURN = np.radians(5.0)  # rad
WINDOW = 7  # frames
DEVIATIONS = 3.0  # Hampel's


def jumps(
    times: NDArray[np.float64], poses: NDArray[np.float64], least: tuple[float, float]
) -> NDArray[np.bool_]:
    """Which of N >= 7 poses, shape (N, 3), are outliers, shape (N,).

    `least`: of the jump [m] and of the turn [rad]. Yaws may jump by 2 pi.
    """
    x, y, yaw = poses.T
    jump, turn = least
    columns = ((x, jump), (y, jump), (np.cos(yaw), turn), (np.sin(yaw), turn))
    return np.asarray(np.any([_jumps(times, *column) for column in columns], axis=0))


def _jumps(
    times: NDArray[np.float64], values: NDArray[np.float64], least: float
) -> NDArray[np.bool_]:
    from scipy.interpolate import make_interp_spline

    count = len(values)
    around = np.clip(np.arange(count) - WINDOW // 2, 0, count - WINDOW)
    near = sliding_window_view(values, WINDOW)[around]
    since = sliding_window_view(times, WINDOW)[around] - times[:, None]
    slope = np.median(np.diff(near, axis=1) / np.diff(since, axis=1), axis=1)
    level = near - slope[:, None] * since
    middle = np.median(level, axis=1)
    deviation = SIGMA_OF_MAD * np.median(np.abs(level - middle[:, None]), axis=1)
    far = np.abs(values - middle) > np.maximum(DEVIATIONS * deviation, least)
    if far.sum() > count - 2:
        return np.asarray(far)
    lines = (  # the same but at the ends, where a motion may start or stop
        make_interp_spline(times[~far], values[~far], k=1)(times),
        np.interp(times, times[~far], values[~far]),
    )
    return np.asarray(far & (np.abs(values - lines).min(axis=0) > least))
