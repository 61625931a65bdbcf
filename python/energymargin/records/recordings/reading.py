"""What a file says of two bodies, frame by frame, becomes a recording: checked and repaired.

Units that are wrong and columns that are swapped make motions that no camera sees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import numbers_of, positive_number, yes_or_no
from energymargin.base.reprs import Record
from energymargin.records.recordings import cleaning
from energymargin.records.recordings.recording import Motion, Recording, Repairs

Floats = NDArray[np.float64]

BODIES = ("object", "effector")
POSE = ("x", "y", "yaw")
VELOCITY = ("vx", "vy", "yaw_rate")

LONGEST_GAP = 0.1  # s; three frames at 33 Hz, in which a push of 5 cm/s goes 5 mm
MOST_REPAIRED = 0.25  # of the frames
LEAST_STEP = 0.5  # of the median step of time, between frames that are filled in

COARSE = 0.1  # of a frame's step, by which times may be rounded
STEPS = (5e-4, 0.5)  # s; a frame's
FARTHEST = (50.0, 50.0, 4 * math.pi)  # m and rad, of x, y and yaw
FASTEST = (10.0, 10.0, 20.0)  # m/s and rad/s
USUAL = 75.0  # percent of the frames, of which a rate is judged: outliers are fewer
DISAGREEMENT = 0.5  # of the larger velocity
LEAST_DISAGREEMENT = (0.01, 0.2)  # m/s, rad/s; three times what noise makes of poses


@dataclass(frozen=True)
class SourceFile:
    """A file that errors name."""

    path: Path
    row: str = "line"
    """What one of its rows is called."""
    hint: str = "Are columns swapped, or units others (mm, deg, ms)? columns= says so"
    """What to do about numbers that no camera sees."""

    def error(self, text: str, line: int | None = None) -> ValueError:
        """A ValueError that names the file and the line."""
        where = "" if line is None else f", {self.row} {line}"
        return ValueError(f"{self.path}{where}: {text}")


@dataclass(frozen=True, eq=False, repr=False)
class FrameTable(Record):
    """R rows of a file, a row a frame, in SI units."""

    source: SourceFile
    lines: NDArray[np.int64]
    """The line of each row in the file, shape (R,)."""
    frames: NDArray[np.int64]
    """The camera's number of each frame, shape (R,)."""
    times: Floats
    poses: Mapping[str, Floats]
    """By body: x, y [m] and yaw [rad], shape (R, 3); NaN where it was not seen."""
    velocities: Mapping[str, Floats]
    """By body, if the file has them: their rates, shape (R, 3)."""

    def error(self, text: str, row: int) -> ValueError:
        """A ValueError that names the file and the line of a row."""
        return self.source.error(text, int(self.lines[row]))


@dataclass(frozen=True)
class Rules:
    """What is repaired, and how; the arguments of `read_csv`, which it checks."""

    repair: bool
    longest_gap: float
    least_jump: float
    least_turn: float
    smoothing: float
    smooth_poses: bool
    causal: bool

    def __post_init__(self) -> None:
        """Checks them."""
        for name in ("longest_gap", "least_jump", "least_turn", "smoothing"):
            positive_number(name, getattr(self, name))
        for name in ("repair", "smooth_poses", "causal"):
            yes_or_no(name, getattr(self, name))


@dataclass(frozen=True, eq=False)
class _Track:
    """What the camera saw of one body, over the R rows of a file."""

    body: str
    poses: Floats
    """Shape (R, 3), the yaw without jumps of 2 pi in the good rows."""
    velocities: Floats | None
    """Those of the file, shape (R, 3)."""
    seen: NDArray[np.bool_]
    jumped: NDArray[np.bool_]
    good: NDArray[np.bool_]
    """The rows that are used: seen, no jump, and both bodies were seen before and after."""


def frame_origin(given: Sequence[float]) -> tuple[float, float, float]:
    """x, y [m] and yaw [rad] of a frame. Raises ValueError on anything else."""
    expected = "x, y [m] and yaw [rad]"
    x, y, yaw = numbers_of("origin", given, expected, (3,)).tolist()
    if max(abs(x), abs(y), abs(yaw)) > 1e6:
        raise ValueError(f"origin is {given!r}, expected {expected}")
    return x, y, yaw


def recording_of(table: FrameTable, rules: Rules, origin: tuple[float, float, float]) -> Recording:
    """The recording in a table, checked and repaired. Errors as `read_csv`."""
    _require_enough(table, len(table.times), "rows")
    _require_clock(table, rules.smoothing)
    tracks = [_track(table, body, rules) for body in BODIES]
    firsts, lasts = zip(*(np.flatnonzero(t.good)[[0, -1]].tolist() for t in tracks), strict=True)
    rows = np.arange(max(firsts), min(lasts) + 1)  # between the ends of both
    inside = np.isin(np.arange(len(table.times)), rows)
    tracks = [replace(track, good=track.good & inside) for track in tracks]
    for track in tracks:
        _require_enough(table, int(track.good.sum()), f"rows with the {track.body} and both")
        _require_short_gaps(table, track, rules.longest_gap)
    frames, times = _filled_clock(table, rows)
    repairs = _repairs(table, tracks, frames)
    _require_few(table, repairs, len(frames), repair=rules.repair)
    if rules.causal:
        known = [t.good for t in tracks if t.velocities is None]
        sevenths = (table.times[good][cleaning.LEAST_FRAMES - 1] for good in known)
        since = max(sevenths, default=-math.inf)
        frames, times = frames[times >= since], times[times >= since]
        repairs = _repairs(table, tracks, frames)
    object_, effector = (_moved(_motion(table, t, times, rules), origin) for t in tracks)
    return Recording(table.source.path.name, frames, times, object_, effector, repairs)


def require_rising(source: SourceFile, name: str, values: Floats, lines: NDArray[np.int64]) -> None:
    """Raises ValueError with the line where these values of a file, shape (R,), do not rise."""
    falls = np.flatnonzero(np.diff(values) <= 0) + 1
    if len(falls):
        k = falls[0]
        raise source.error(
            f"{name} is {values[k]:.10g} after {values[k - 1]:.10g}, expected it to rise. Are "
            f"these {len(falls) + 1} episodes, or was the clock set? Cut the recording there",
            int(lines[k]),
        )


def _require_enough(table: FrameTable, count: int, what: str) -> None:
    if count < cleaning.LEAST_FRAMES:
        raise table.source.error(f"has {count} {what}, expected at least {cleaning.LEAST_FRAMES}")


def _require_clock(table: FrameTable, smoothing: float) -> None:
    """Raises ValueError unless frames and times rise, in steps of a camera, and for long enough."""
    _require_precise(table)
    require_rising(table.source, "frame", table.frames.astype(float), table.lines)
    require_rising(table.source, "time", table.times, table.lines)
    step, length = cleaning.usual_step(table.times), float(np.ptp(table.times))
    if not STEPS[0] <= step <= STEPS[1]:
        raise table.source.error(
            f"its frames are {step:.3g} s apart, expected {STEPS[0]:g} to {STEPS[1]:g} s. "
            f"{table.source.hint}"
        )
    if smoothing > length:
        raise ValueError(
            f"smoothing is {smoothing:g}, expected at most the recording's {length:g} s"
        )


def _require_precise(table: FrameTable) -> None:
    """Raises ValueError on times in single precision that are too late for it, as since 1970."""
    times = table.times
    rounded = float(np.spacing(np.float32(np.abs(times).max())))
    length = float(np.ptp(times)) / (len(times) - 1)
    if (times == times.astype(np.float32)).all() and rounded > COARSE * max(length, STEPS[0]):
        raise table.source.error(
            f"its times are in single precision, which at {times[0]:.10g} s has steps of "
            f"{rounded:.3g} s, and its frames are {length:.3g} s apart: expected double precision, "
            "or times since the first frame"
        )


def _track(table: FrameTable, body: str, rules: Rules) -> _Track:
    """One body's poses and velocities in the rows of a file, with outliers marked."""
    _require_units(table, body)
    poses, velocities = table.poses[body].copy(), table.velocities.get(body)
    seen = np.asarray(np.isfinite(poses).all(axis=1))
    if velocities is not None:
        seen &= np.isfinite(velocities).all(axis=1)
    seen &= ~cleaning.lost(poses, rules.least_jump)
    _require_enough(table, int(seen.sum()), f"rows in which the {body} was seen")
    jumped = np.zeros_like(seen)
    least = (rules.least_jump, rules.least_turn)
    jumped[seen] = cleaning.jumps(table.times[seen], poses[seen], least)
    good = seen & ~jumped
    _require_enough(table, int(good.sum()), f"rows without a jump of the {body}")
    poses[good, 2] = np.unwrap(poses[good, 2])
    return _Track(body, poses, velocities, seen, jumped, good)


def _require_units(table: FrameTable, body: str) -> None:
    """Raises ValueError unless positions, angles and their rates are plausible on a table."""
    steps = np.diff(table.poses[body], axis=0)
    steps[:, 2] = np.angle(np.exp(1j * steps[:, 2]))
    rates = np.abs(steps) / np.diff(table.times)[:, None]
    for k, axis in enumerate(POSE):
        unit, hint = "rad" if axis == "yaw" else "m", table.source.hint
        column = table.poses[body][:, k]
        far = np.abs(column) > FARTHEST[k]
        if far.any():
            row = int(np.argmax(far))
            is_far = f"{column[row]:.6g} {unit}, expected at most {FARTHEST[k]:.4g}"
            raise table.error(f"{body}_{axis} is {is_far}. {hint}", row)
        seen = rates[np.isfinite(rates[:, k]), k]
        if len(seen) and (rate := np.percentile(seen, USUAL)) > FASTEST[k]:
            is_fast = f"{rate:.3g} {unit}/s, expected at most {FASTEST[k]:g}"
            raise table.source.error(f"{body}_{axis} changes by {is_fast}. {hint}")


def _require_short_gaps(table: FrameTable, track: _Track, longest_gap: float) -> None:
    """Raises ValueError with the line after a longer time without a good pose of this body."""
    rows = np.flatnonzero(track.good)
    gaps = np.diff(table.times[rows])
    longest, jitter = cleaning.gap_limits(longest_gap, table.times)
    if (gaps > longest + jitter).any():
        k = int(np.argmax(gaps > longest + jitter))
        before, after = rows[k], rows[k + 1]
        raise table.error(
            f"the {track.body} was not seen for {gaps[k]:.3g} s, from frame {table.frames[before]} "
            f"to {table.frames[after]}, expected at most {longest:g} s: cut the recording there, "
            "or allow a larger longest_gap",
            after,
        )


def _filled_clock(table: FrameTable, rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], Floats]:
    """Numbers and times [s] of all K frames in these rows, and of those between that are missing.

    If a camera drops all but every n-th frame, numbers rise by n. Raises ValueError
    with the line where numbers jump and the time does not.
    """
    frames, times = table.frames[rows], table.times[rows]
    steps, stride = np.diff(times), max(1, int(np.median(np.diff(frames))))
    missing = np.maximum(-(-np.diff(frames) // stride) - 1, 0)
    crowded = (missing > 0) & (steps / (missing + 1) < LEAST_STEP * np.median(steps))
    if crowded.any():
        k = int(np.argmax(crowded))
        raise table.error(
            f"frame is {frames[k + 1]} after {frames[k]}, but the time rises by {steps[k]:.3g} s: "
            "expected the frames between to have time, or all frames numbered through",
            rows[k + 1],
        )
    added = [frames[k] + stride * np.arange(1, n + 1) for k, n in enumerate(missing) if n > 0]
    everything = np.sort(np.concatenate([frames, *added]))
    return everything, np.interp(everything.astype(float), frames.astype(float), times)


def _repairs(table: FrameTable, tracks: Sequence[_Track], frames: NDArray[np.int64]) -> Repairs:
    """Which of these frames are interpolated, and which of the file's are left out."""
    used = np.isin(table.frames, frames)
    unseen = {t.body: tuple(table.frames[used & ~t.seen].tolist()) for t in tracks}
    outliers = {t.body: tuple(table.frames[used & t.jumped].tolist()) for t in tracks}
    return Repairs(
        tuple(np.setdiff1d(frames, table.frames).tolist()),
        {body: numbers for body, numbers in unseen.items() if numbers},
        {body: numbers for body, numbers in outliers.items() if numbers},
        tuple(table.frames[~used].tolist()),
    )


def _require_few(table: FrameTable, repairs: Repairs, frames: int, *, repair: bool) -> None:
    """Raises ValueError if too many frames are repaired, or any with `repair` False."""
    wrong = sorted({*repairs.frames, *repairs.left_out})
    if wrong and not repair:
        after = min(int(np.searchsorted(table.frames, wrong[0])), len(table.lines) - 1)
        raise table.error(
            f"frame {wrong[0]} needs repair ({repairs}), which repair=False forbids", after
        )
    if len(repairs.frames) > MOST_REPAIRED * frames:
        raise table.source.error(
            f"{len(repairs.frames)} of {frames} frames need repair ({repairs}), "
            f"expected at most {MOST_REPAIRED:.0%}"
        )


def _motion(table: FrameTable, track: _Track, at: Floats, rules: Rules) -> Motion:
    """A body's at all frames. Raises ValueError if velocities of the file contradict its poses."""
    times, poses = table.times[track.good], track.poses[track.good]
    causal = rules.causal and track.velocities is None
    smoother = cleaning.causally_smoothed if causal else cleaning.smoothed
    smooth, errors = smoother(times, poses, at, rules.smoothing)
    if track.velocities is None and rules.smooth_poses:
        return smooth
    measured = cleaning.interpolated(at, times, poses)
    known = cleaning.diagonal(np.broadcast_to(errors, measured.shape))
    as_seen = replace(smooth, poses=measured, pose_covariances=known)
    if track.velocities is None:
        return as_seen
    velocities = cleaning.interpolated(at, times, track.velocities[track.good])
    _require_agreement(table.source, track.body, velocities, smooth.velocities)
    return replace(as_seen, velocities=velocities, velocity_covariances=None)


def _require_agreement(source: SourceFile, body: str, given: Floats, derived: Floats) -> None:
    """Raises ValueError if a file's velocities, shape (N, 3), contradict those of its poses.

    The root mean square of their difference may be half of the larger one's, and a bit more.
    """
    for columns, least in zip((slice(0, 2), slice(2, 3)), LEAST_DISAGREEMENT, strict=True):
        own, of_poses, apart = (
            float(np.sqrt(np.mean(np.sum(np.square(rates[:, columns]), axis=1))))
            for rates in (given, derived, given - derived)
        )
        if apart > DISAGREEMENT * max(own, of_poses) + least:
            rates = ", ".join(f"{body}_{axis}" for axis in VELOCITY[columns])
            raise source.error(
                f"{rates} contradict the poses: {own:.3g} a second (root mean square), "
                f"{of_poses:.3g} by the poses, {apart:.3g} apart. {source.hint}"
            )


def _moved(motion: Motion, origin: tuple[float, float, float]) -> Motion:
    """From the camera's frame to the scene's."""
    yaw = origin[2]
    turn = np.eye(3)
    turn[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    poses, velocities = motion.pose_covariances, motion.velocity_covariances
    return Motion(
        motion.poses @ turn.T + origin,
        motion.velocities @ turn.T,
        None if poses is None else turn @ poses @ turn.T,
        None if velocities is None else turn @ velocities @ turn.T,
    )
