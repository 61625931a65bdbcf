"""Smooth numbers and their rates from measured ones, how well both are known, and which measured
poses are none: gaps, a tracker that has lost the body, markers that jump.

Velocities come from a smoothing spline (`scipy.interpolate.make_smoothing_spline`) through the
poses at their own times, with unequal steps, number by number. It passes motion slower than 2 pi
times its time scale, and little that is faster. Where it would leave a measured number by more than
the noise, as at an impact, the time scale is shorter. docs/engineering/recordings.md has the
measurements behind it.

A cubic smoothing spline is the mean of a belief: that of a value whose acceleration is white noise,
seen with errors (Wahba, Improper priors, spline smoothing and the problem of guarding against model
errors in regression, 1978). The variances of that belief are those of two Kalman filters, forward
and back (Fraser and Potter, 1969); how large the errors are, the spline's residuals tell. So a
frame that was filled, or that is near an end, is known less well than one amid others.

A tracker that has lost a body may write zeros. A marker's jumps are found by a Hampel filter about
the motion's own slope. Seven frames around each one have a median slope, and about that line a
median and a median absolute deviation. A frame is an outlier if it lies farther from the median
than three times that deviation (scaled to a standard deviation), and farther than a least jump both
from the median and from the line between its neighbours, which would replace it. Two wrong frames
of seven change none of these medians by much; where the motion itself starts, stops or bounces
there is no outlier. Of an orientation the filter takes numbers that do not wrap.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from energymargin.base.aliases import Floats, Mask
from energymargin.records.recordings.poses import directions, positions

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


SMOOTHING = 0.06  # s; the least error of velocity at 33 Hz with 0.5 mm and 1 deg of noise
MEMORY = 10.0  # time scales; what is older changes the spline's end by a thousandth
LEAST_SCALE = 0.1  # of a frame's step: smooth no more
FARTHEST = 5.0  # standard deviations of noise, from a measured number to a smooth one
SIGMA_OF_MAD = 1.4826  # of a normal distribution
NOISE_OF_THIRD = math.sqrt(1 + 9 + 9 + 1)  # the third difference of noise has such a deviation
LEAST_FRAMES = 7  # a spline needs 5, the search for outliers 7
USUAL_STEPS = 95.0  # percent of a body's steps: outliers are fewer
LEAPS = 5.0  # of them; no body goes so far in one
WINDOW = 7  # frames
DEVIATIONS = 3.0  # Hampel's
USUAL_GAP = 1.5  # median steps of time; with a shorter one, no frame is missing
JITTER = 0.25  # of the median step of time: so much times are rounded, or late


class Smooth(NamedTuple):
    """Of M numbers at K times: arrays (K, M)."""

    values: Floats
    rates: Floats
    """[1/s]."""
    variances: Floats
    """Of the errors of these values."""
    rate_variances: Floats
    errors: Floats
    """Variances of the measured values' errors, about each time."""


def usual_step(times: Floats) -> float:
    """The median step of times; inf of one time alone."""
    return float(np.median(np.diff(times))) if len(times) > 1 else math.inf


def interpolated(at: Floats, times: Floats, values: Floats, outside: float | None = None) -> Floats:
    """Columns of values, shape (N, M), on lines at K times; `outside` of N, None: the ends."""
    columns = [np.interp(at, times, own, left=outside, right=outside) for own in values.T]
    return np.stack(columns, axis=1)


def smoothed(times: Floats, values: Floats, at: Floats, time_scale: float) -> Smooth:
    """M numbers, shape (N, M), at rising times [s], N >= 7: smooth at K times.

    The time scale [s] is halved until no smooth number is farther from the measured one than five
    standard deviations of the noise, which the third differences tell.
    """
    start, step = times[0], usual_step(times)
    moments = (times - start) / step  # in steps, so that the spline's equations are of the size 1
    wanted = (at - start) / step
    known = cache(lambda scale: unit_variances(moments, wanted, scale))  # columns share scales
    columns = []
    for column in values.T:
        spline, scale = _spline(moments, column, time_scale / step)
        (own, own_rate), at_moments = known(scale)[0].T, known(scale)[1]
        residuals = spline(moments) - column  # the variances add up to the number of parameters
        error = float((residuals**2).sum() / (len(residuals) - at_moments.sum()))
        variances = (error * own, error * own_rate / step**2, 0 * own + error)
        columns.append((spline(wanted), spline.derivative()(wanted) / step, *variances))
    return Smooth(*(np.stack(one, axis=1) for one in zip(*columns, strict=True)))


def causally_smoothed(times: Floats, values: Floats, at: Floats, time_scale: float) -> Smooth:
    """As `smoothed`, at each time by the numbers up to it alone.

    At least 7 are at or before the first of these times.
    """
    ends = np.searchsorted(times, at, side="right")
    begins = np.minimum(np.searchsorted(times, at - MEMORY * time_scale), ends - LEAST_FRAMES)
    windows = zip(at[:, None], begins, ends, strict=True)
    parts = [smoothed(times[a:b], values[a:b], own, time_scale) for own, a, b in windows]
    return Smooth(*map(np.concatenate, zip(*parts, strict=True)))


def _spline(moments: Floats, values: Floats, scale: float) -> tuple[BSpline, float]:
    """The spline, and its time scale in steps."""
    from scipy.interpolate import make_smoothing_spline

    third = np.abs(np.diff(values, 3))
    third = third[third > 0]  # from where values change: a tracker may hold still or round
    noise = SIGMA_OF_MAD * float(np.median(third)) / NOISE_OF_THIRD if len(third) else 0.0
    while True:
        spline = make_smoothing_spline(moments, values, lam=scale**4)
        if np.abs(spline(moments) - values).max() <= FARTHEST * noise or scale < LEAST_SCALE:
            return spline, scale
        scale /= 2


def unit_variances(moments: Floats, at: Floats, scale: float) -> tuple[Floats, Floats]:
    """Variances of the spline's value and rate at the K times `at`, shape (K, 2), and of its value
    at the N rising `moments` of the measurements, (N,), for errors of variance 1.

    Times and the spline's time scale are in steps. What is known from before and what from behind
    are added up, as inverses of covariances: at the ends one of them is nothing.
    """
    times = np.union1d(moments, at)
    looks = np.zeros((len(times), 2, 2))
    looks[np.isin(times, moments), 0, 0] = 1.0  # at the value, with an error of variance 1
    back = np.diag([1.0, -1.0])  # a rate changes its sign with the time's direction
    before = _known_before(np.diff(times), looks, scale**-4)
    behind = back @ _known_before(np.diff(times)[::-1], looks[::-1], scale**-4)[::-1] @ back
    smooth = np.diagonal(np.linalg.inv(before + looks + behind), axis1=1, axis2=2)
    return smooth[np.searchsorted(times, at)], smooth[np.searchsorted(times, moments), 0]


def _known_before(steps: Floats, looks: Floats, noise: float) -> Floats:
    """What is known at each of T times from the looks before it, of a white acceleration of this
    density: inverses of covariances of value and rate, (T, 2, 2)."""
    known = [np.zeros((2, 2))]
    for step, look in zip(steps, looks, strict=False):
        back = np.array([[1.0, -step], [0.0, 1.0]])
        moved = back.T @ (known[-1] + look) @ back
        added = noise * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
        known.append(np.linalg.solve(np.eye(2) + moved @ added, moved))
    return np.array(known)


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
