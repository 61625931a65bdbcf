"""A table becomes a recording: checked and repaired.

Gaps are frames that a camera dropped, by the steps of their numbers, and the time without a body.
Units that are wrong and columns that are swapped make motions that no camera sees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypedDict

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import numbers_of, positive_number, yes_or_no
from energymargin.records.recordings.outliers import jumps, lost
from energymargin.records.recordings.poses import (
    continuous,
    moved,
    planar,
    positions,
    steps,
    to_velocities,
    units,
)
from energymargin.records.recordings.recording import Motion, Recording, Repairs
from energymargin.records.recordings.smoothing import (
    LEAST_FRAMES,
    SMOOTHING,
    Smooth,
    causally_smoothed,
    interpolated,
    smoothed,
    usual_step,
)
from energymargin.records.recordings.table import Source, columns_of, require_whole

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_REPAIRED = 0.25  # of the frames
LEAST_STEP = 0.5  # of the median step of time, between frames that are filled in
USUAL_GAP = 1.5  # median steps of time; with a shorter one, no frame is missing
JITTER = 0.25  # of the median step of time: so much times are rounded, or late

COARSE = 0.1  # of a frame's step, by which times may be rounded
STEPS = (5e-4, 0.5)  # s; a frame's
FARTHEST = {"m": 50.0, "rad": 4 * math.pi}
FASTEST = {"m": 10.0, "rad": 20.0}  # a second
USUAL = 75.0  # percent of the frames, of which a rate is judged: outliers are fewer
DISAGREEMENT = 0.5  # of the larger velocity
LEAST_DISAGREEMENT = (0.01, 0.2)  # m/s, rad/s; three times what noise makes of poses


@dataclass(frozen=True)
class Rules:
    """What is repaired, and how. Raises ValueError on what cannot be."""

    repair: bool = True
    """False makes each frame that would be interpolated an error."""
    longest_gap: float = 0.1  # three frames at 33 Hz, in which a push of 5 cm/s goes 5 mm
    """The longest time over which poses are interpolated [s]."""
    least_jump: float = 5e-3  # ten times a good camera's noise
    """An outlier jumps by so much at least [m]."""
    least_turn: float = math.radians(5.0)
    """The same of its orientation [rad]."""
    smoothing: float = SMOOTHING
    """The largest time scale of the smoothing spline [s], which gives the velocities that the file
    does not have."""
    smooth_poses: bool = True
    """Whether the spline gives the poses of such a body, too."""
    causal: bool = False
    """Whether the spline of each frame goes through frames up to it alone, as a robot has them:
    foresight is then not helped by frames to come. The first six are left out."""

    def __post_init__(self) -> None:
        """Checks them."""
        for name in ("longest_gap", "least_jump", "least_turn", "smoothing"):
            positive_number(name, getattr(self, name))
        for name in ("repair", "smooth_poses", "causal"):
            yes_or_no(name, getattr(self, name))


class LooseRules(TypedDict, total=False):
    """The fields of Rules as keywords of a function."""

    repair: bool
    longest_gap: float
    least_jump: float
    least_turn: float
    smoothing: float
    smooth_poses: bool
    causal: bool


@dataclass(frozen=True, eq=False)
class _Track:
    """What the camera saw of one body, over the R rows of a table."""

    body: str
    poses: Floats
    """Shape (R, 3) or (R, 7), without jumps in the good rows."""
    velocities: Floats | None
    """Those of the file, shape (R, 3) or (R, 6)."""
    rates: list[str]
    """Names of the velocities' columns."""
    seen: Mask
    jumped: Mask
    good: Mask
    """The rows that are used: seen, no jump, and all bodies were seen before and after."""


def frame_origin(given: Sequence[float]) -> tuple[float, float, float]:
    """x, y [m] and yaw [rad] of a frame. Raises ValueError on anything else."""
    expected = "x, y [m] and yaw [rad]"
    x, y, yaw = numbers_of("origin", given, expected, (3,)).tolist()
    if max(abs(x), abs(y), abs(yaw)) > 1e6:
        raise ValueError(f"origin is {given!r}, expected {expected}")
    return x, y, yaw


def cleaned(
    table: pd.DataFrame, source: Source, rules: Rules, origin: tuple[float, float, float]
) -> Recording:
    """The recording in a table, checked and repaired. Errors as `read_csv`."""
    require_whole("the table", table.columns)
    if "frame" not in table:
        table = table.assign(frame=np.arange(len(table)))
    table = table.astype({"frame": np.int64})
    _require_enough(source, len(table), "rows")
    _require_clock(source, table, rules.smoothing)
    tracks = [_track(table, source, body, rules) for body in columns_of(table.columns)]
    ends = np.array([np.flatnonzero(track.good)[[0, -1]] for track in tracks])
    rows = np.arange(ends[:, 0].max(), ends[:, 1].min() + 1)  # between the ends of all
    inside = np.isin(np.arange(len(table)), rows)
    tracks = [replace(track, good=track.good & inside) for track in tracks]
    for track in tracks:
        others = "both" if len(tracks) == 2 else "all others"
        _require_enough(source, int(track.good.sum()), f"rows with the {track.body} and {others}")
        _require_short_gaps(table, source, track, rules.longest_gap)
    times = table["time"].to_numpy()
    frames, at = _filled_clock(table.iloc[rows], source)
    repairs = _repairs(table, tracks, frames)
    _require_few(table, source, repairs, len(frames), repair=rules.repair)
    if rules.causal:
        known = [track.good for track in tracks if track.velocities is None]
        since = max((times[good][LEAST_FRAMES - 1] for good in known), default=-math.inf)
        frames, at = frames[at >= since], at[at >= since]
        repairs = _repairs(table, tracks, frames)
    motions = {track.body: _motion(times, source, track, at, rules, origin) for track in tracks}
    return Recording(source.path.name, frames, at, motions, repairs)


def _require_enough(source: Source, count: int, what: str) -> None:
    if count < LEAST_FRAMES:
        raise source.error(f"has {count} {what}, expected at least {LEAST_FRAMES}")


def _require_clock(source: Source, table: pd.DataFrame, smoothing: float) -> None:
    """Raises ValueError unless frames and times rise, in steps of a camera, and for long enough."""
    times = table["time"].to_numpy()
    step, length = usual_step(times), float(np.ptp(times))
    mean = length / (len(times) - 1)
    rounded = float(np.spacing(np.float32(np.abs(times).max())))
    if (times == times.astype(np.float32)).all() and rounded > COARSE * max(mean, STEPS[0]):
        raise source.error(
            f"its times are in single precision, which at {times[0]:.10g} s has steps of "
            f"{rounded:.3g} s, and its frames are {mean:.3g} s apart: expected double precision, "
            "or times since the first frame"
        )
    for name in ("frame", "time"):
        source.require_rising(name, table[name].to_numpy(float), table.index.to_numpy())
    if not STEPS[0] <= step <= STEPS[1]:
        raise source.error(
            f"its frames are {step:.3g} s apart, expected {STEPS[0]:g} to {STEPS[1]:g} s. "
            f"{source.hint}"
        )
    if smoothing > length:
        raise ValueError(
            f"smoothing is {smoothing:g}, expected at most the recording's {length:g} s"
        )


def _track(table: pd.DataFrame, source: Source, body: str, rules: Rules) -> _Track:
    """One body's poses and velocities in the rows of a table, with outliers marked."""
    of_poses, of_rates = columns_of(table.columns)[body]
    times, poses = table["time"].to_numpy(), table[of_poses].to_numpy(float)
    velocities = table[of_rates].to_numpy(float) if of_rates[0] in table else None
    _require_units(table, source, body, poses)
    seen = np.asarray(np.isfinite(poses).all(axis=1)) & ~lost(poses, rules.least_jump)
    if velocities is not None:
        seen &= np.isfinite(velocities).all(axis=1)
    _require_enough(source, int(seen.sum()), f"rows in which the {body} was seen")
    if not planar(poses):
        source.require_poses(body, poses[seen], table.index.to_numpy()[seen])
    jumped = np.zeros_like(seen)
    jumped[seen] = jumps(times[seen], poses[seen], rules.least_jump, rules.least_turn)
    good = seen & ~jumped
    _require_enough(source, int(good.sum()), f"rows without a jump of the {body}")
    poses[good] = continuous(poses[good])
    return _Track(body, poses, velocities, of_rates, seen, jumped, good)


def _require_units(table: pd.DataFrame, source: Source, body: str, poses: Floats) -> None:
    """Raises ValueError unless positions, angles and their rates are plausible on a table."""
    rates = np.abs(steps(poses)) / np.diff(table["time"].to_numpy())[:, None]
    for k, speeds in enumerate(rates.T):
        axis, unit = ("xyz"[k], "m") if k < positions(poses).shape[1] else ("yaw", "rad")
        name = f"{body}_{axis if planar(poses) or unit == 'm' else 'orientation'}"
        far = np.abs(poses[:, k]) > FARTHEST[unit]
        if far.any():
            row = int(np.argmax(far))
            is_far = f"{poses[row, k]:.6g} {unit}, expected at most {FARTHEST[unit]:.4g}"
            raise source.error(f"{name} is {is_far}. {source.hint}", int(table.index[row]))
        seen = speeds[np.isfinite(speeds)]
        if len(seen) and (rate := np.percentile(seen, USUAL)) > FASTEST[unit]:
            is_fast = f"{rate:.3g} {unit}/s, expected at most {FASTEST[unit]:g}"
            raise source.error(f"{name} changes by {is_fast}. {source.hint}")


def gap_limits(longest_gap: float, times: Floats) -> tuple[float, float]:
    """The longest time without a pose that is filled, of a slow camera a bit more than its step;
    and by how much rounded and jittering times may be beyond it [s]."""
    step = usual_step(times)
    return max(longest_gap, USUAL_GAP * step), JITTER * step


def _require_short_gaps(
    table: pd.DataFrame, source: Source, track: _Track, longest_gap: float
) -> None:
    """Raises ValueError with the line after a longer time without a good pose of this body."""
    good = table[track.good]
    gaps = np.diff(good["time"].to_numpy())
    longest, jitter = gap_limits(longest_gap, table["time"].to_numpy())
    if (gaps > longest + jitter).any():
        k = int(np.argmax(gaps > longest + jitter))
        before, after = good["frame"].iloc[k : k + 2]
        raise source.error(
            f"the {track.body} was not seen for {gaps[k]:.3g} s, from frame {before} "
            f"to {after}, expected at most {longest:g} s: cut the recording there, "
            "or allow a larger longest_gap",
            int(good.index[k + 1]),
        )


def _filled_clock(table: pd.DataFrame, source: Source) -> tuple[NDArray[np.int64], Floats]:
    """Numbers and times [s] of all K frames of a table, and of those between that are missing.

    If a camera drops all but every n-th frame, numbers rise by n. Raises ValueError
    with the line where numbers jump and the time does not.
    """
    frames, times = table["frame"].to_numpy(), table["time"].to_numpy()
    steps, stride = np.diff(times), max(1, int(np.median(np.diff(frames))))
    missing = np.maximum(-(-np.diff(frames) // stride) - 1, 0)
    crowded = (missing > 0) & (steps / (missing + 1) < LEAST_STEP * np.median(steps))
    if crowded.any():
        k = int(np.argmax(crowded))
        raise source.error(
            f"frame is {frames[k + 1]} after {frames[k]}, but the time rises by {steps[k]:.3g} s: "
            "expected the frames between to have time, or all frames numbered through",
            int(table.index[k + 1]),
        )
    pairs = zip(frames[:-1], frames[1:], strict=True)
    everything = np.concatenate([*(np.arange(a, b, stride) for a, b in pairs), frames[-1:]])
    return everything, np.interp(everything.astype(float), frames.astype(float), times)


def _repairs(table: pd.DataFrame, tracks: Sequence[_Track], frames: NDArray[np.int64]) -> Repairs:
    """Which of these frames are interpolated, and which of the table's are left out."""
    known = table["frame"].to_numpy()
    used = np.isin(known, frames)

    def by_body(masks: dict[str, Mask]) -> dict[str, tuple[int, ...]]:
        return {
            b: tuple(known[mask & used].tolist())
            for b, mask in masks.items()
            if (mask & used).any()
        }

    return Repairs(
        tuple(np.setdiff1d(frames, known).tolist()),
        by_body({track.body: ~track.seen for track in tracks}),
        by_body({track.body: track.jumped for track in tracks}),
        tuple(known[~used].tolist()),
    )


def _require_few(
    table: pd.DataFrame, source: Source, repairs: Repairs, frames: int, *, repair: bool
) -> None:
    """Raises ValueError if too many frames are repaired, or any with `repair` False."""
    wrong = sorted({*repairs.frames, *repairs.left_out})
    if wrong and not repair:
        after = min(int(table["frame"].searchsorted(wrong[0])), len(table) - 1)
        raise source.error(
            f"frame {wrong[0]} needs repair ({repairs}), which repair=False forbids",
            int(table.index[after]),
        )
    if len(repairs.frames) > MOST_REPAIRED * frames:
        raise source.error(
            f"{len(repairs.frames)} of {frames} frames need repair ({repairs}), "
            f"expected at most {MOST_REPAIRED:.0%}"
        )


def _motion(
    times: Floats,
    source: Source,
    track: _Track,
    at: Floats,
    rules: Rules,
    origin: tuple[float, float, float],
) -> Motion:
    """A body's at all frames, in the scene's frame. Raises ValueError if velocities of the file
    contradict its poses."""
    times, poses = times[track.good], track.poses[track.good]
    smoother = causally_smoothed if rules.causal and track.velocities is None else smoothed
    smooth = smoother(times, poses, at, rules.smoothing)
    if track.velocities is not None or not rules.smooth_poses:
        smooth = smooth._replace(values=interpolated(at, times, poses), variances=smooth.errors)
    motion = _of_numbers(smooth, origin)
    if track.velocities is None:
        return motion
    turn = moved(poses, origin)[1]
    velocities = interpolated(at, times, track.velocities[track.good]) @ turn.T
    _require_agreement(source, track.rates, velocities, motion.velocities)
    return replace(motion, velocities=velocities, velocity_covariances=None)


def _of_numbers(smooth: Smooth, origin: tuple[float, float, float]) -> Motion:
    """The motion of the numbers of a pose, in the scene's frame."""
    poses, turn = moved(units(smooth.values), origin)
    made = to_velocities(smooth.values)
    velocities = (made @ smooth.rates[:, :, None])[:, :, 0] @ turn.T
    ways = turn @ made
    covariances = [
        (ways * variances[:, None, :]) @ ways.transpose(0, 2, 1)
        for variances in (smooth.variances, smooth.rate_variances)
    ]
    return Motion(poses, velocities, *covariances)


def _require_agreement(source: Source, names: list[str], given: Floats, derived: Floats) -> None:
    """Raises ValueError if a file's velocities, shape (N, D), contradict those of its poses.

    The root mean square of their difference may be half of the larger one's, and a bit more.
    """
    split = 2 if len(names) == 3 else 3  # in the plane, in space
    for columns, least in zip(
        (slice(0, split), slice(split, None)), LEAST_DISAGREEMENT, strict=True
    ):
        own, of_poses, apart = (
            float(np.sqrt(np.mean(np.sum(np.square(rates[:, columns]), axis=1))))
            for rates in (given, derived, given - derived)
        )
        if apart > DISAGREEMENT * max(own, of_poses) + least:
            raise source.error(
                f"{', '.join(names[columns])} contradict the poses: {own:.3g} a second (root mean "
                f"square), {of_poses:.3g} by the poses, {apart:.3g} apart. {source.hint}"
            )
