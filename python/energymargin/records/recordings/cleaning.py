"""A table becomes a recording: checked and repaired.

Gaps are frames that a camera dropped, by the steps of their numbers, and the time without a body.
Units that are wrong and columns that are swapped make motions that no camera sees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from energymargin.base.aliases import Floats, Ints, Mask
from energymargin.base.checks import numbers_of, positive_number, yes_or_no
from energymargin.records.recordings import poses as se3, smoothing
from energymargin.records.recordings.recording import Motion, Recording, Repairs
from energymargin.records.recordings.table import FileSource, columns_of, first

if TYPE_CHECKING:
    import pandas as pd

MOST_REPAIRED = 0.25  # of the frames
LEAST_STEP = 0.5  # of the median step of time, between frames that are filled in
COARSE = 0.1  # of a frame's step, by which times may be rounded
STEPS = (5e-4, 0.5)  # s; a frame's
FARTHEST = {"m": 50.0, "rad": 4 * math.pi}
FASTEST = {"m": 10.0, "rad": 20.0}  # a second
USUAL = 75.0  # percent of the frames, of which a rate is judged: outliers are fewer
DISAGREEMENT = 0.5  # of the larger velocity
LEAST_DISAGREEMENT = (0.01, 0.2)  # m/s, rad/s; three times what noise makes of poses


@dataclass(frozen=True, eq=False)
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
    smoothing: float = smoothing.SMOOTHING
    """The largest time scale of the smoothing spline [s], which gives the velocities that the file
    does not have."""
    smooth_poses: bool = True
    """Whether the spline gives the poses of such a body, too."""
    causal: bool = False
    """Whether the spline of each frame goes through frames up to it alone, as a robot has them:
    foresight is then not helped by frames to come. The first six are left out."""
    origin: Sequence[float] | None = None
    """Pose of the camera's frame in the scene's: x, y [m] and yaw [rad]; None: that of `columns`,
    or the same frame."""

    def __post_init__(self) -> None:
        """Checks them."""
        for name in ("longest_gap", "least_jump", "least_turn", "smoothing"):
            positive_number(name, getattr(self, name))
        for name in ("repair", "smooth_poses", "causal"):
            yes_or_no(name, getattr(self, name))
        require_origin((0.0, 0.0, 0.0) if self.origin is None else self.origin)

    def in_frame(self, origin: Sequence[float]) -> Rules:
        """These rules, with this origin unless they have one."""
        return self if self.origin is not None else replace(self, origin=origin)


class LooseRules(TypedDict, total=False):
    """The fields of Rules as keywords of a function."""

    repair: bool
    longest_gap: float
    least_jump: float
    least_turn: float
    smoothing: float
    smooth_poses: bool
    causal: bool
    origin: Sequence[float] | None


@dataclass(frozen=True, eq=False)
class _Track:
    """What the camera saw of one body, over the R rows of a table."""

    body: str
    poses: Floats
    """Shape (R, 3) or (R, 7), without jumps in the good rows."""
    velocities: Floats | None
    """Those of the file, shape (R, 3) or (R, 6)."""
    rates: list[str]
    """Names of their columns."""
    seen: Mask
    jumped: Mask
    good: Mask
    """The rows that are used: seen, no jump, and all bodies were seen before and after."""


def require_origin(given: Sequence[float]) -> None:
    """Raises ValueError on anything else than x, y [m] and yaw [rad] of a frame."""
    expected = "x, y [m] and yaw [rad]"
    if np.abs(numbers_of("origin", given, expected, (3,))).max() > 1e6:
        raise ValueError(f"origin is {given!r}, expected {expected}")


def cleaned(table: pd.DataFrame, source: FileSource, rules: Rules) -> Recording:
    """The recording in a table, checked and repaired. Errors as `read_csv`."""
    _require_enough(source, len(table), "rows")
    if "frame" not in table:
        table = table.assign(frame=np.arange(len(table)))
    table = table.astype({"frame": np.int64, "time": float})
    _require_clock(source, table, rules.smoothing)
    tracks = [_track(source, table, body, rules) for body in columns_of(table.columns)]
    ends = np.array([np.flatnonzero(track.good)[[0, -1]] for track in tracks])
    rows = np.arange(ends[:, 0].max(), ends[:, 1].min() + 1)  # between the ends of all
    inside = np.isin(np.arange(len(table)), rows)
    tracks = [replace(track, good=track.good & inside) for track in tracks]
    for track in tracks:
        others = "both" if len(tracks) == 2 else "all others"
        _require_enough(source, int(track.good.sum()), f"rows with the {track.body} and {others}")
        _require_short_gaps(source, table, track, rules.longest_gap)
    frames, at = _filled_clock(source, table.iloc[rows])
    repairs = _repairs(table, tracks, frames)
    _require_few(source, table, repairs, len(frames), repair=rules.repair)
    times = table["time"].to_numpy()
    if rules.causal:
        known = [track.good for track in tracks if track.velocities is None]
        since = max((times[good][smoothing.LEAST_FRAMES - 1] for good in known), default=-math.inf)
        frames, at = frames[at >= since], at[at >= since]
        repairs = _repairs(table, tracks, frames)
    motions = {track.body: _motion(source, times, track, at, rules) for track in tracks}
    return Recording(source.path.name, frames, at, motions, repairs)


def _require_enough(source: FileSource, count: int, what: str) -> None:
    if count < smoothing.LEAST_FRAMES:
        raise source.error(f"has {count} {what}, expected at least {smoothing.LEAST_FRAMES}")


def _require_clock(source: FileSource, table: pd.DataFrame, smoothing_time: float) -> None:
    """Raises ValueError unless frames and times rise, in steps of a camera, and for long enough."""
    times = table["time"].to_numpy()
    step, length = smoothing.usual_step(times), float(np.ptp(times))
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
    least, most = STEPS
    if not least <= step <= most:
        expected = f"expected {least:g} to {most:g} s. {source.hint}"
        raise source.error(f"its frames are {step:.3g} s apart, {expected}")
    if smoothing_time > length:
        expected = f"expected at most the recording's {length:g} s"
        raise ValueError(f"smoothing is {smoothing_time:g}, {expected}")


def _track(source: FileSource, table: pd.DataFrame, body: str, rules: Rules) -> _Track:
    """One body's poses and velocities in the rows of a table, with outliers marked."""
    of_poses, of_rates = columns_of(table.columns)[body]
    times, poses = table["time"].to_numpy(), table[of_poses].to_numpy(float)
    velocities = table[of_rates].to_numpy(float) if of_rates[0] in table else None
    _require_units(source, table, body, poses)
    seen = np.asarray(np.isfinite(poses).all(axis=1)) & ~smoothing.lost(poses, rules.least_jump)
    if velocities is not None:
        seen &= np.isfinite(velocities).all(axis=1)
    _require_enough(source, int(seen.sum()), f"rows in which the {body} was seen")
    if not se3.planar(poses):
        source.require_poses(body, poses[seen], table.index.to_numpy()[seen])
    jumped = np.zeros_like(seen)
    jumped[seen] = smoothing.jumps(times[seen], poses[seen], rules.least_jump, rules.least_turn)
    good = seen & ~jumped
    _require_enough(source, int(good.sum()), f"rows without a jump of the {body}")
    poses[good] = se3.continuous(poses[good])
    return _Track(body, poses, velocities, of_rates, seen, jumped, good)


def _require_units(source: FileSource, table: pd.DataFrame, body: str, poses: Floats) -> None:
    """Raises ValueError unless positions, angles and their rates are plausible on a table."""
    rates = np.abs(se3.steps(poses)) / np.diff(table["time"].to_numpy())[:, None]
    axes = ("x", "y", "yaw") if se3.planar(poses) else ("x", "y", "z", "orientation")
    for k, axis in enumerate(axes):
        name, unit = f"{body}_{axis}", "m" if axis in "xyz" else "rad"
        if (row := first(np.abs(poses[:, k]) > FARTHEST[unit])) is not None:
            far = f"{poses[row, k]:.6g} {unit}, expected at most {FARTHEST[unit]:.4g}"
            raise source.error(f"{name} is {far}. {source.hint}", table.index[row])
        seen = rates[np.isfinite(rates[:, k]), k]
        if len(seen) and (rate := np.percentile(seen, USUAL)) > FASTEST[unit]:
            fast = f"{rate:.3g} {unit}/s, expected at most {FASTEST[unit]:g}"
            raise source.error(f"{name} changes by {fast}. {source.hint}")


def _require_short_gaps(
    source: FileSource, table: pd.DataFrame, track: _Track, longest_gap: float
) -> None:
    """Raises ValueError with the line after a longer time without a good pose of this body."""
    good = table[track.good]
    gaps = np.diff(good["time"].to_numpy())
    longest, jitter = smoothing.gap_limits(longest_gap, table["time"].to_numpy())
    if (k := first(gaps > longest + jitter)) is not None:
        before, after = good["frame"].iloc[k : k + 2]
        raise source.error(
            f"the {track.body} was not seen for {gaps[k]:.3g} s, from frame {before} to {after}, "
            f"expected at most {longest:g} s: cut the recording there, or allow a larger "
            "longest_gap",
            good.index[k + 1],
        )


def _filled_clock(source: FileSource, table: pd.DataFrame) -> tuple[Ints, Floats]:
    """Numbers and times [s] of all K frames of a table, and of those between that are missing.

    If a camera drops all but every n-th frame, numbers rise by n. Raises ValueError
    with the line where numbers jump and the time does not.
    """
    frames, times = table["frame"].to_numpy(), table["time"].to_numpy()
    steps, stride = np.diff(times), max(1, int(np.median(np.diff(frames))))
    missing = np.maximum(-(-np.diff(frames) // stride) - 1, 0)
    crowded = (missing > 0) & (steps / (missing + 1) < LEAST_STEP * np.median(steps))
    if (k := first(crowded)) is not None:
        raise source.error(
            f"frame is {frames[k + 1]} after {frames[k]}, but the time rises by {steps[k]:.3g} s: "
            "expected the frames between to have time, or all frames numbered through",
            table.index[k + 1],
        )
    filled = [np.arange(*pair, stride) for pair in pairwise(frames)]
    everything = np.concatenate([*filled, frames[-1:]])
    return everything, np.interp(everything.astype(float), frames.astype(float), times)


def _repairs(table: pd.DataFrame, tracks: Sequence[_Track], frames: Ints) -> Repairs:
    """Which of these frames are interpolated, and which of the table's are left out."""
    known = table["frame"].to_numpy()
    used = np.isin(known, frames)
    unseen = {track.body: tuple(known[used & ~track.seen].tolist()) for track in tracks}
    outliers = {track.body: tuple(known[used & track.jumped].tolist()) for track in tracks}
    unseen, outliers = ({body: n for body, n in of.items() if n} for of in (unseen, outliers))
    missing = tuple(np.setdiff1d(frames, known).tolist())
    return Repairs(missing, unseen, outliers, tuple(known[~used].tolist()))


def _require_few(
    source: FileSource, table: pd.DataFrame, repairs: Repairs, frames: int, *, repair: bool
) -> None:
    """Raises ValueError if too many frames are repaired, or any with `repair` False."""
    wrong = sorted({*repairs.frames, *repairs.left_out})
    if wrong and not repair:
        after = min(int(table["frame"].searchsorted(wrong[0])), len(table) - 1)
        text = f"frame {wrong[0]} needs repair ({repairs}), which repair=False forbids"
        raise source.error(text, table.index[after])
    if len(repairs.frames) > MOST_REPAIRED * frames:
        need = f"{len(repairs.frames)} of {frames} frames need repair ({repairs})"
        raise source.error(f"{need}, expected at most {MOST_REPAIRED:.0%}")


def _motion(source: FileSource, times: Floats, track: _Track, at: Floats, rules: Rules) -> Motion:
    """A body's at all frames, in the scene's frame. Raises ValueError if velocities of the file
    contradict its poses."""
    times, poses, rates = times[track.good], track.poses[track.good], track.velocities
    causal = rules.causal and rates is None
    smoother = smoothing.causally_smoothed if causal else smoothing.smoothed
    smooth = smoother(times, poses, at, rules.smoothing)
    if rates is not None or not rules.smooth_poses:
        lines = smoothing.interpolated(at, times, poses)
        smooth = smooth._replace(values=lines, variances=smooth.errors)
    made = se3.to_velocities(smooth.values)
    origin = (0, 0, 0) if rules.origin is None else rules.origin
    placed, turn = se3.moved(se3.units(smooth.values), origin)
    turned, errors = turn @ made, (smooth.variances, smooth.rate_variances)
    covariances = [(turned * own[:, None]) @ turned.transpose(0, 2, 1) for own in errors]
    velocities = (made @ smooth.rates[:, :, None])[:, :, 0]
    if rates is None:
        return Motion(placed, velocities @ turn.T, *covariances)
    given = smoothing.interpolated(at, times, rates[track.good])
    _require_agreement(source, track.rates, given, velocities)
    return Motion(placed, given @ turn.T, covariances[0])


def _require_agreement(
    source: FileSource, names: list[str], given: Floats, derived: Floats
) -> None:
    """Raises ValueError if a file's velocities, shape (N, D), contradict those of its poses.

    The root mean square of their difference may be half of the larger one's, and a bit more.
    """
    turns = 2 if len(names) == 3 else 3  # where rates of turns begin, in the plane or in space
    for columns, least in zip((slice(turns), slice(turns, None)), LEAST_DISAGREEMENT, strict=True):
        squares = (np.square(rates[:, columns]) for rates in (given, derived, given - derived))
        own, of_poses, apart = (float(np.sqrt(np.mean(np.sum(s, axis=1)))) for s in squares)
        if apart > DISAGREEMENT * max(own, of_poses) + least:
            raise source.error(
                f"{', '.join(names[columns])} contradict the poses: {own:.3g} a second (root mean "
                f"square), {of_poses:.3g} by the poses, {apart:.3g} apart. {source.hint}"
            )
