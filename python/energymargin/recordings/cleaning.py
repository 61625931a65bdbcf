"""Gaps, outliers and noise of measured poses.

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
an impact, the time scale is shorter. docs/guides/recordings.md has the measurements behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from energymargin.recordings.csv_files import FrameTable, of_body
from energymargin.recordings.deviations import error_variance, unit_variances
from energymargin.recordings.recording import Motion
from energymargin.reprs import short_repr

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

__all__ = [
    "LEAST_FRAMES",
    "LEAST_JUMP",
    "LEAST_TURN",
    "SIGMA_OF_MAD",
    "SMOOTHING",
    "Clock",
    "causally_smoothed",
    "diagonal",
    "filled_clock",
    "gap_limits",
    "jumps",
    "lost",
    "require_short_gaps",
    "smoothed",
]

USUAL = 1.5  # median steps of time; with a shorter one, no frame is missing
JITTER = 0.25  # of the median step of time: so much times are rounded, or late
LEAST_STEP = 0.5  # of the median step of time, between frames that are filled in

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


@dataclass(frozen=True, eq=False)
class Clock:
    """Numbers and times [s] of all K frames, also of those that the file does not have."""

    __repr__ = short_repr

    frames: NDArray[np.int64]
    times: NDArray[np.float64]
    missing: tuple[int, ...]
    """Numbers of the frames that the file does not have."""

    def since(self, time: float) -> Clock:
        """The frames from a time on."""
        later = self.times >= time
        frames = self.frames[later]
        missing = tuple(number for number in self.missing if number >= frames[0])
        return Clock(frames, self.times[later], missing)


def require_short_gaps(
    table: FrameTable, body: str, good: NDArray[np.bool_], longest_gap: float
) -> None:
    """Raises ValueError with the line after a longer time without a good pose of this body."""
    times = table.values["time"]
    rows = np.flatnonzero(good)
    gaps = np.diff(times[rows])
    longest, jitter = gap_limits(longest_gap, times)
    if (gaps > longest + jitter).any():
        k = int(np.argmax(gaps > longest + jitter))
        before, after = rows[k], rows[k + 1]
        numbers = table.values["frame"]
        poses = np.stack([table.values[name] for name in of_body(body)[0]], axis=1)
        zeros = " (its pose is 0, 0, 0 there)" if _zeros(poses[before:after]).any() else ""
        raise table.source.error(
            f"the {body} was not seen for {gaps[k]:.3g} s, from frame {numbers[before]:.0f} to "
            f"{numbers[after]:.0f}{zeros}, expected at most {longest:g} s: cut the recording "
            "there, or allow a larger longest_gap",
            int(table.lines[after]),
        )


def gap_limits(longest_gap: float, times: NDArray[np.float64]) -> tuple[float, float]:
    """The longest time without a pose that is filled, of a slow camera a bit more than its step;
    and by how much rounded and jittering times may be beyond it [s]."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    return max(longest_gap, USUAL * step), JITTER * step


def lost(poses: NDArray[np.float64], least_jump: float) -> NDArray[np.bool_]:
    """Of N poses, shape (N, 3), those, shape (N,), of a tracker that has lost the body and writes
    x = y = yaw = 0; a pose that was not seen is NaN.

    They are those of zeros that the motion does not lead to: before or behind them the body is
    farther away than it usually goes in a step, and than `least_jump` [m].
    """
    seen, zeros = np.asarray(np.isfinite(poses).all(axis=1)), _zeros(poses)
    moving = seen & ~zeros
    steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)[moving[1:] & moving[:-1]]
    usual = float(np.percentile(steps, USUAL_STEPS)) if len(steps) else 0.0
    far = moving & (np.linalg.norm(poses[:, :2], axis=1) > max(least_jump, LEAPS * usual))
    found = np.zeros_like(zeros)
    for first, end in _runs(zeros):
        before, after = np.flatnonzero(seen[:first])[-1:], end + np.flatnonzero(seen[end:])[:1]
        found[first:end] = far[before].any() or far[after].any()
    return found


def _zeros(poses: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray((poses == 0.0).all(axis=1))


def _runs(rows: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and end of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def filled_clock(table: FrameTable) -> Clock:
    """All frames of a file, and those whose numbers are missing, at times in between.

    If a camera drops all but every n-th frame, numbers rise by n. Raises ValueError
    with the line where numbers jump and the time does not.
    """
    frames, times = table.values["frame"].astype(np.int64), table.values["time"]
    steps, stride = np.diff(times), max(1, int(np.median(np.diff(frames))))
    missing = np.maximum(-(-np.diff(frames) // stride) - 1, 0)
    crowded = (missing > 0) & (steps / (missing + 1) < LEAST_STEP * np.median(steps))
    if crowded.any():
        k = int(np.argmax(crowded))
        raise table.source.error(
            f"frame is {frames[k + 1]} after {frames[k]}, but the time rises by {steps[k]:.3g} s: "
            "expected the frames between to have time, or all frames numbered through",
            int(table.lines[k + 1]),
        )
    numbers = [
        frames[k] + stride * np.arange(1, count + 1) for k, count in enumerate(missing) if count > 0
    ]
    added = np.concatenate([np.zeros(0, np.int64), *numbers])
    everything = np.sort(np.concatenate([frames, added]))
    filled = np.interp(everything.astype(float), frames.astype(float), times)
    return Clock(everything, filled, tuple(added.tolist()))


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


def smoothed(
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    at: NDArray[np.float64],
    time_scale: float,
) -> tuple[Motion, NDArray[np.float64]]:
    """Poses, shape (N, 3), at rising times [s], N >= 7: smooth, and their rates, at K times, with
    the covariances of both; and the variances of the measured poses, (3,).

    The time scale [s] is halved until no smooth pose is farther from the measured one than five
    standard deviations of the noise, which the third differences of the poses tell.
    """
    start, step = times[0], float(np.median(np.diff(times)))
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
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    at: NDArray[np.float64],
    time_scale: float,
) -> tuple[Motion, NDArray[np.float64]]:
    """As `smoothed`, at each time by the poses up to it alone; the variances have the shape (K, 3).

    At least 7 poses are at or before the first of these times.
    """
    ends = np.searchsorted(times, at, side="right")
    begins = np.searchsorted(times, at - MEMORY * time_scale)
    parts = [
        smoothed(times[begin:end], poses[begin:end], at[k : k + 1], time_scale)
        for k, (begin, end) in enumerate(
            zip(np.minimum(begins, ends - LEAST_FRAMES), ends, strict=True)
        )
    ]
    fields = ("poses", "velocities", "pose_covariances", "velocity_covariances")
    joined = (np.concatenate([getattr(own, name) for own, _ in parts]) for name in fields)
    return Motion(*joined), np.array([errors for _, errors in parts])


def diagonal(variances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Covariances (K, 3, 3) of independent errors, from their variances (K, 3)."""
    return np.asarray(variances[:, :, None] * np.eye(3))


def _noise(values: NDArray[np.float64]) -> float:
    """Standard deviation of noise, from where values change: a tracker may hold still or round."""
    third = np.abs(np.diff(values, 3))
    if not third.any():
        return 0.0
    return SIGMA_OF_MAD * float(np.median(third[third > 0])) / NOISE_OF_THIRD


def _spline(
    moments: NDArray[np.float64], values: NDArray[np.float64], scale: float
) -> tuple[BSpline, float]:
    """The spline, and its time scale in steps."""
    from scipy.interpolate import make_smoothing_spline

    noise = _noise(values)
    while True:
        spline = make_smoothing_spline(moments, values, lam=scale**4)
        away = np.abs(spline(moments) - values).max()
        if away <= FARTHEST * noise or scale < LEAST_SCALE:
            return spline, scale
        scale /= 2
