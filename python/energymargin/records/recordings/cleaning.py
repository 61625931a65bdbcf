"""Gaps, outliers and noise of measured poses, and how well they are known.

Gaps: frames that a camera dropped, by the steps of their numbers, and the time without a body. A
tracker that has lost a body may write zeros.

Outliers: frames in which a marker jumped, by a Hampel filter about the motion's own slope. Seven
frames around each one have a median slope, and about that line a median and a median absolute
deviation. A frame is an outlier if it lies farther from the median than three times that deviation
(scaled to a standard deviation), and farther than a least jump both from the median and from the
line between its neighbours, which would replace it. Two wrong frames of seven change none of these
medians by much; where the motion itself starts, stops or bounces there is no outlier. Of a yaw the
filter takes sine and cosine, which do not wrap.

Noise: velocities come from a smoothing spline (`scipy.interpolate.make_smoothing_spline`) through
the poses at their own times, with unequal steps. It passes motion slower than 2 pi times its time
scale, and little that is faster. Where it would leave a measured pose by more than the noise, as at
an impact, the time scale is shorter. docs/engineering/recordings.md has the measurements behind it.

Errors: a cubic smoothing spline is the mean of a belief: that of a value whose acceleration is
white noise, seen with errors (Wahba, Improper priors, spline smoothing and the problem of guarding
against model errors in regression, 1978). The variances of that belief are those of two Kalman
filters, forward and back (Fraser and Potter, 1969); how large the errors are, the spline's
residuals tell. So a frame that was filled, or that is near an end, is known less well than one amid
others.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from energymargin.records.recordings.recording import Motion

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Floats = NDArray[np.float64]


USUAL = 1.5  # median steps of time; with a shorter one, no frame is missing
JITTER = 0.25  # of the median step of time: so much times are rounded, or late

LEAST_JUMP = 5e-3  # m; ten times a good camera's noise
LEAST_TURN = np.radians(5.0)  # rad
USUAL_STEPS = 95.0  # percent of a body's steps: outliers are fewer
LEAPS = 5.0  # of them; no body goes so far in one
WINDOW = 7  # frames
DEVIATIONS = 3.0  # Hampel's

SMOOTHING = 0.06  # s; the least error of velocity at 33 Hz with 0.5 mm and 1 deg of noise
MEMORY = 10.0  # time scales; what is older changes the spline's end by a thousandth
LEAST_SCALE = 0.1  # of a frame's step: smooth no more
FARTHEST = 5.0  # standard deviations of noise, from a measured pose to a smooth one
SIGMA_OF_MAD = 1.4826  # of a normal distribution
NOISE_OF_THIRD = math.sqrt(1 + 9 + 9 + 1)  # the third difference of noise has such a deviation
LEAST_FRAMES = 7  # a spline needs 5, the search for outliers 7


def usual_step(times: Floats) -> float:
    """The median step of times; inf of one time alone."""
    return float(np.median(np.diff(times))) if len(times) > 1 else math.inf


def interpolated(at: Floats, times: Floats, values: Floats, outside: float | None = None) -> Floats:
    """Columns of values, shape (N, M), on lines at K times; `outside` of N, None: the ends."""
    columns = [np.interp(at, times, own, left=outside, right=outside) for own in values.T]
    return np.stack(columns, axis=1)


def gap_limits(longest_gap: float, times: Floats) -> tuple[float, float]:
    """The longest time without a pose that is filled, of a slow camera a bit more than its step;
    and by how much rounded and jittering times may be beyond it [s]."""
    step = usual_step(times)
    return max(longest_gap, USUAL * step), JITTER * step


def lost(poses: Floats, least_jump: float) -> NDArray[np.bool_]:
    """Poses at which a tracker has lost the body and writes x = y = yaw = 0: a mask (N,) of N
    poses, shape (N, 3); a pose that was not seen is NaN.

    They are those of zeros that the motion does not lead to: before or behind them the body is
    farther away than it usually goes in a step, and than `least_jump` [m].
    """
    seen = np.asarray(np.isfinite(poses).all(axis=1))
    at_zero = np.asarray((poses == 0.0).all(axis=1))
    moving = seen & ~at_zero
    steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)[moving[1:] & moving[:-1]]
    usual = float(np.percentile(steps, USUAL_STEPS)) if len(steps) else 0.0
    far = moving & (np.linalg.norm(poses[:, :2], axis=1) > max(least_jump, LEAPS * usual))
    found = np.zeros_like(at_zero)
    for first, end in _runs(at_zero):
        before, after = np.flatnonzero(seen[:first])[-1:], end + np.flatnonzero(seen[end:])[:1]
        found[first:end] = far[before].any() or far[after].any()
    return found


def _runs(rows: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and end of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def jumps(times: Floats, poses: Floats, least: tuple[float, float]) -> NDArray[np.bool_]:
    """Which of N >= 7 poses, shape (N, 3), are outliers, shape (N,).

    `least`: of the jump [m] and of the turn [rad]. Yaws may jump by 2 pi.
    """
    x, y, yaw = poses.T
    jump, turn = least
    columns = ((x, jump), (y, jump), (np.cos(yaw), turn), (np.sin(yaw), turn))
    return np.asarray(np.any([_jumps(times, *column) for column in columns], axis=0))


def _jumps(times: Floats, values: Floats, least: float) -> NDArray[np.bool_]:
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


def smoothed(times: Floats, poses: Floats, at: Floats, time_scale: float) -> tuple[Motion, Floats]:
    """Poses, shape (N, 3), at rising times [s], N >= 7: smooth, and their rates, at K times, with
    the covariances of both; and the variances of the measured poses, (3,).

    The time scale [s] is halved until no smooth pose is farther from the measured one than five
    standard deviations of the noise, which the third differences of the poses tell.
    """
    start, step = times[0], usual_step(times)
    moments = (times - start) / step  # in steps, so that the spline's equations are of the size 1
    splines = [_spline(moments, column, time_scale / step) for column in poses.T]
    wanted = (at - start) / step
    errors, units = np.empty(3), np.empty((3, len(at), 2))  # of value and rate
    for k, (column, (spline, scale)) in enumerate(zip(poses.T, splines, strict=True)):
        units[k], at_moments = unit_variances(moments, wanted, scale)
        errors[k] = error_variance(spline(moments) - column, at_moments)
    motion = Motion(
        np.stack([spline(wanted) for spline, _ in splines], axis=1),
        np.stack([spline.derivative()(wanted) / step for spline, _ in splines], axis=1),
        diagonal(errors * units[..., 0].T),
        diagonal(errors * units[..., 1].T / step**2),
    )
    return motion, errors


def causally_smoothed(
    times: Floats, poses: Floats, at: Floats, time_scale: float
) -> tuple[Motion, Floats]:
    """As `smoothed`, at each time by the poses up to it alone; the variances have the shape (K, 3).

    At least 7 poses are at or before the first of these times.
    """
    ends = np.searchsorted(times, at, side="right")
    begins = np.searchsorted(times, at - MEMORY * time_scale)
    begins = np.minimum(begins, ends - LEAST_FRAMES)
    parts = [
        smoothed(times[begin:end], poses[begin:end], at[k : k + 1], time_scale)
        for k, (begin, end) in enumerate(zip(begins, ends, strict=True))
    ]
    fields = ("poses", "velocities", "pose_covariances", "velocity_covariances")
    joined = (np.concatenate([getattr(own, name) for own, _ in parts]) for name in fields)
    return Motion(*joined), np.array([errors for _, errors in parts])


def diagonal(variances: Floats) -> Floats:
    """Covariances (K, 3, 3) of independent errors, from their variances (K, 3)."""
    return np.asarray(variances[:, :, None] * np.eye(3))


def _noise(values: Floats) -> float:
    """Standard deviation of noise, from where values change: a tracker may hold still or round."""
    third = np.abs(np.diff(values, 3))
    if not third.any():
        return 0.0
    return SIGMA_OF_MAD * float(np.median(third[third > 0])) / NOISE_OF_THIRD


def _spline(moments: Floats, values: Floats, scale: float) -> tuple[BSpline, float]:
    """The spline, and its time scale in steps."""
    from scipy.interpolate import make_smoothing_spline

    noise = _noise(values)
    while True:
        spline = make_smoothing_spline(moments, values, lam=scale**4)
        away = np.abs(spline(moments) - values).max()
        if away <= FARTHEST * noise or scale < LEAST_SCALE:
            return spline, scale
        scale /= 2


def unit_variances(moments: Floats, at: Floats, scale: float) -> tuple[Floats, Floats]:
    """Variances of the spline's value and rate at the K times `at`, each (K,), and of its value at
    the N rising `moments` of the measurements, (N,), for errors of variance 1.

    Times and the spline's time scale are in steps; shape (K, 2) and (N,).
    """
    times = np.union1d(moments, at)
    seen = np.isin(times, moments)
    smooth = _variances(times, seen, scale**-4)
    return smooth[np.searchsorted(times, at)], smooth[seen, 0]


def error_variance(residuals: Floats, unit: Floats) -> float:
    """Variance of the measurements' errors, from the spline's residuals at them, shape (N,), and
    its variances there for errors of variance 1. Those add up to the number of its parameters."""
    return float((residuals**2).sum() / (len(residuals) - unit.sum()))


def _variances(times: Floats, seen: NDArray[np.bool_], noise: float) -> Floats:
    """Variances of value and rate at each time, (T, 2), of a white acceleration of this density.

    What is known from before and what from behind are added up, as inverses of covariances: at the
    ends one of them is nothing.
    """
    steps = np.diff(times)
    look = np.diag([1.0, 0.0])  # at the value, with an error of variance 1
    looks = [look if one else np.zeros((2, 2)) for one in seen]
    forward = [looks[0]]
    for step, own in zip(steps, looks[1:], strict=True):
        forward.append(_ahead(forward[-1], step, noise) + own)
    behind = [np.zeros((2, 2))]
    for step, own in zip(steps[::-1], looks[:0:-1], strict=True):
        behind.append(_back(behind[-1] + own, step, noise))
    both = np.array(forward) + np.array(behind[::-1])
    return np.asarray(np.diagonal(np.linalg.inv(both), axis1=1, axis2=2))


def _ahead(known: Floats, step: float, noise: float) -> Floats:
    """What was known, as the inverse of a covariance, after a step of a white acceleration."""
    back = np.array([[1.0, -step], [0.0, 1.0]])
    moved = back.T @ known @ back
    return np.asarray(np.linalg.solve(np.eye(2) + moved @ _added(step, noise), moved))


def _back(known: Floats, step: float, noise: float) -> Floats:
    """What was known, as the inverse of a covariance, before a step of a white acceleration."""
    ahead = np.array([[1.0, step], [0.0, 1.0]])
    return np.asarray(
        ahead.T @ np.linalg.solve(np.eye(2) + known @ _added(step, noise), known) @ ahead
    )


def _added(step: float, noise: float) -> Floats:
    """The covariance that a white acceleration adds in a step."""
    return noise * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
