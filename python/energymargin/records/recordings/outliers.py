"""Which measured poses are none: gaps, a tracker that has lost the body, markers that jump.

A tracker that has lost a body may write zeros. A marker's jumps are found by a Hampel filter about
the motion's own slope. Seven frames around each one have a median slope, and about that line a
median and a median absolute deviation. A frame is an outlier if it lies farther from the median
than three times that deviation (scaled to a standard deviation), and farther than a least jump both
from the median and from the line between its neighbours, which would replace it. Two wrong frames
of seven change none of these medians by much; where the motion itself starts, stops or bounces
there is no outlier. Of an orientation the filter takes numbers that do not wrap.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from energymargin.records.recordings.poses import directions, positions
from energymargin.records.recordings.smoothing import SIGMA_OF_MAD, usual_step
from energymargin.records.recordings.table import Floats, Mask

USUAL_STEPS = 95.0  # percent of a body's steps: outliers are fewer
LEAPS = 5.0  # of them; no body goes so far in one
WINDOW = 7  # frames
DEVIATIONS = 3.0  # Hampel's
USUAL_GAP = 1.5  # median steps of time; with a shorter one, no frame is missing
JITTER = 0.25  # of the median step of time: so much times are rounded, or late


def gap_limits(longest_gap: float, times: Floats) -> tuple[float, float]:
    """The longest time without a pose that is filled, of a slow camera a bit more than its step;
    and by how much rounded and jittering times may be beyond it [s]."""
    step = usual_step(times)
    return max(longest_gap, USUAL_GAP * step), JITTER * step


def lost(poses: Floats, least_jump: float) -> Mask:
    """Poses at which a tracker has lost the body and writes zeros, but for a quaternion's w: a mask
    (N,) of N poses; a pose that was not seen is NaN.

    They are those of zeros that the motion does not lead to: before or behind them the body is
    farther away than it usually goes in a step, and than `least_jump` [m].
    """
    seen = np.asarray(np.isfinite(poses).all(axis=1))
    at_zero = np.asarray((poses[:, :6] == 0.0).all(axis=1))
    moving, places = seen & ~at_zero, positions(poses)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)[moving[1:] & moving[:-1]]
    usual = float(np.percentile(steps, USUAL_STEPS)) if len(steps) else 0.0
    far = moving & (np.linalg.norm(places, axis=1) > max(least_jump, LEAPS * usual))
    found = np.zeros_like(at_zero)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at_zero, [False]]).astype(np.int8)))
    for first, end in edges.reshape(-1, 2):
        before, after = np.flatnonzero(seen[:first])[-1:], end + np.flatnonzero(seen[end:])[:1]
        found[first:end] = far[before].any() or far[after].any()
    return found


def jumps(times: Floats, poses: Floats, least_jump: float, least_turn: float) -> Mask:
    """Which of N >= 7 poses are outliers, shape (N,): by so much at least [m, rad]."""
    columns = [(column, least_jump) for column in positions(poses).T]
    columns += [(column, least_turn) for column in directions(poses).T]
    return np.asarray(np.any([_jumps(times, *column) for column in columns], axis=0))


def _jumps(times: Floats, values: Floats, least: float) -> Mask:
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
