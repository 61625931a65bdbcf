"""A camera's recording from its CSV file: checked, and gaps and outliers interpolated."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import positive_number, yes_or_no
from energymargin.recordings.cleaning import (
    LEAST_FRAMES,
    LEAST_JUMP,
    LEAST_TURN,
    SMOOTHING,
    Clock,
    causally_smoothed,
    diagonal,
    filled_clock,
    jumps,
    lost,
    require_short_gaps,
    smoothed,
)
from energymargin.recordings.csv_files import (
    BODIES,
    Columns,
    FrameTable,
    frame_origin,
    of_body,
    read_table,
)
from energymargin.recordings.plausible import require_agreement, require_clock, require_units
from energymargin.recordings.recording import Motion, Recording, Repairs

__all__ = ["LONGEST_GAP", "Rules", "read_csv", "recording_of"]

LONGEST_GAP = 0.1  # s; three frames at 33 Hz, in which a push of 5 cm/s goes 5 mm
MOST_REPAIRED = 0.25  # of the frames


@dataclass(frozen=True, eq=False)
class _Track:
    """What the camera saw of one body, over the R rows of a file."""

    body: str
    poses: NDArray[np.float64]
    """Shape (R, 3), the yaw without jumps of 2 pi in the good rows; NaN where it was not seen."""
    velocities: NDArray[np.float64] | None
    """Those of the file, shape (R, 3)."""
    seen: NDArray[np.bool_]
    jumped: NDArray[np.bool_]

    @property
    def good(self) -> NDArray[np.bool_]:
        """The rows that are used, shape (R,)."""
        return self.seen & ~self.jumped

    def part(self, rows: slice) -> _Track:
        """Over these rows alone."""
        return _Track(
            self.body,
            self.poses[rows],
            None if self.velocities is None else self.velocities[rows],
            self.seen[rows],
            self.jumped[rows],
        )


@dataclass(frozen=True)
class _Sightings:
    """The R rows of a file, and what the camera saw of both bodies in them."""

    table: FrameTable
    tracks: tuple[_Track, ...]

    def between_ends(self) -> _Sightings:
        """Without the frames before both bodies are first seen, or after either is last seen."""
        ends = [np.flatnonzero(track.good)[[0, -1]] for track in self.tracks]
        first, last = max(first for first, _ in ends), min(last for _, last in ends)
        rows = slice(first, last + 1)
        table = FrameTable(
            self.table.source,
            self.table.lines[rows],
            {name: values[rows] for name, values in self.table.values.items()},
        )
        tracks = tuple(track.part(rows) for track in self.tracks)
        for track in tracks:
            _require_enough(table, int(track.good.sum()), f"rows with the {track.body} and both")
        return _Sightings(table, tracks)


def read_csv(
    path: str | os.PathLike[str],
    columns: Columns | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    *,
    repair: bool = True,
    longest_gap: float = LONGEST_GAP,
    least_jump: float = LEAST_JUMP,
    least_turn: float = LEAST_TURN,
    smoothing: float = SMOOTHING,
    smooth_poses: bool = True,
    causal: bool = False,
    origin: Sequence[float] | None = None,
) -> Recording:
    """The recording in a CSV file: a row a frame, with the poses of two bodies in a plane.

    Missing frames, frames in which a body was not seen, and outliers are interpolated.
    `docs/guides/recordings.md` has the rules.

    Args:
        path: the CSV file.
        columns: which column is what, and the units: Columns, or a JSON file of them. None: the
            header is frame,time,object_x,object_y,object_yaw,object_vx,object_vy,object_yaw_rate,
            and the same of the effector [m, rad, s]; velocities may be missing.
        repair: False makes each frame that would be interpolated an error.
        longest_gap: the longest time over which poses are interpolated [s].
        least_jump: an outlier jumps by so much at least [m].
        least_turn: the same of its yaw [rad].
        smoothing: the largest time scale of the smoothing spline [s], which gives the velocities
            that the file does not have.
        smooth_poses: whether the spline gives the poses of such a body, too.
        causal: whether the spline of each frame goes through frames up to it alone, as a robot has
            them: foresight is then not helped by frames to come. The first six are left out.
        origin: of the camera's frame in the scene's, x, y [m] and yaw [rad]; None is that of
            `columns`.

    Raises OSError, and ValueError that names the file, the line and what was expected there.
    """
    rules = Rules(repair, longest_gap, least_jump, least_turn, smoothing, smooth_poses, causal)
    layout = Columns.of(columns)
    return recording_of(
        read_table(path, layout), rules, origin=layout.origin if origin is None else origin
    )


@dataclass(frozen=True)
class Rules:
    """What is repaired, and how; the arguments of `read_csv`, which it checks."""

    repair: bool = True
    longest_gap: float = LONGEST_GAP
    least_jump: float = LEAST_JUMP
    least_turn: float = LEAST_TURN
    smoothing: float = SMOOTHING
    smooth_poses: bool = True
    causal: bool = False

    def __post_init__(self) -> None:
        """Checks them."""
        for name in ("longest_gap", "least_jump", "least_turn", "smoothing"):
            positive_number(name, getattr(self, name))
        yes_or_no("repair", self.repair)
        yes_or_no("causal", self.causal)


def recording_of(given: FrameTable, rules: Rules, *, origin: Sequence[float]) -> Recording:
    """The recording in a table, checked and repaired. Errors as `read_csv`."""
    table = _with_frames(given)
    _require_enough(table, len(table.lines), "rows")
    require_clock(table)
    _require_longer(table, rules.smoothing)
    least = (rules.least_jump, rules.least_turn)
    sightings = _Sightings(table, tuple(_track(table, b, least) for b in BODIES)).between_ends()
    for track in sightings.tracks:
        require_short_gaps(sightings.table, track.body, track.good, rules.longest_gap)
    clock = filled_clock(sightings.table)
    repairs = _repairs(table, sightings, clock)
    _require_few(table, repairs, len(clock.times), repair=rules.repair)
    if rules.causal:
        clock = clock.since(_known_since(sightings))
        repairs = _repairs(table, sightings, clock)
    motions = _motions(sightings, clock, rules)
    place = frame_origin(origin)
    object_motion, effector_motion = (_moved(motion, place) for motion in motions)
    name = table.source.path.name
    return Recording(name, clock.frames, clock.times, object_motion, effector_motion, repairs)


def _with_frames(table: FrameTable) -> FrameTable:
    """The table with numbers of frames; those of a file without them have no gap."""
    if "frame" in table.values:
        return table
    numbers = np.arange(len(table.lines), dtype=float)
    return FrameTable(table.source, table.lines, {"frame": numbers, **table.values})


def _track(table: FrameTable, body: str, least: tuple[float, float]) -> _Track:
    """One body's poses and velocities in the rows of a file, with outliers marked."""
    require_units(table, body)
    of_pose, of_velocity = of_body(body)
    poses = np.stack([table.values[name] for name in of_pose], axis=1)
    velocities = None
    if of_velocity[0] in table.values:
        velocities = np.stack([table.values[name] for name in of_velocity], axis=1)
    measured = poses if velocities is None else np.concatenate([poses, velocities], axis=1)
    seen = np.asarray(np.isfinite(measured).all(axis=1))
    seen &= ~lost(poses, least[0])
    _require_enough(table, int(seen.sum()), f"rows in which the {body} was seen")
    jumped = np.zeros_like(seen)
    jumped[seen] = jumps(table.values["time"][seen], poses[seen], least)
    _require_enough(table, int((seen & ~jumped).sum()), f"rows without a jump of the {body}")
    good = seen & ~jumped
    poses[good, 2] = np.unwrap(poses[good, 2])
    return _Track(body, poses, velocities, seen, jumped)


def _require_enough(table: FrameTable, count: int, what: str) -> None:
    if count < LEAST_FRAMES:
        raise table.source.error(f"has {count} {what}, expected at least {LEAST_FRAMES}")


def _require_longer(table: FrameTable, smoothing: float) -> None:
    length = float(np.ptp(table.values["time"]))
    if smoothing > length:
        raise ValueError(
            f"smoothing is {smoothing:g}, expected at most the recording's {length:g} s"
        )


def _repairs(table: FrameTable, sightings: _Sightings, clock: Clock) -> Repairs:
    """Which frames are interpolated or left out; `sightings` are those between the ends."""
    between, tracks = sightings.table, sightings.tracks
    own = np.isin(between.values["frame"], clock.frames)
    unseen = {track.body: _frames(between, own & ~track.seen) for track in tracks}
    outliers = {track.body: _frames(between, own & track.jumped) for track in tracks}
    return Repairs(
        clock.missing,
        {body: frames for body, frames in unseen.items() if frames},
        {body: frames for body, frames in outliers.items() if frames},
        _frames(table, ~np.isin(table.values["frame"], clock.frames)),
    )


def _known_since(sightings: _Sightings) -> float:
    """The time [s] from which on a spline has enough poses of each body that has no velocities."""
    times = sightings.table.values["time"]
    firsts = [times[t.good][LEAST_FRAMES - 1] for t in sightings.tracks if t.velocities is None]
    return float(max(firsts, default=times[0]))


def _frames(table: FrameTable, rows: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(number) for number in table.values["frame"][rows])


def _require_few(table: FrameTable, repairs: Repairs, frames: int, *, repair: bool) -> None:
    """Raises ValueError if too many frames are repaired, or any with `repair` False."""
    wrong = sorted({*repairs.frames, *repairs.left_out})
    if wrong and not repair:
        after = min(int(np.searchsorted(table.values["frame"], wrong[0])), len(table.lines) - 1)
        raise table.source.error(
            f"frame {wrong[0]} needs repair ({repairs}), which repair=False forbids",
            int(table.lines[after]),
        )
    if len(repairs.frames) > MOST_REPAIRED * frames:
        raise table.source.error(
            f"{len(repairs.frames)} of {frames} frames need repair ({repairs}), "
            f"expected at most {MOST_REPAIRED:.0%}"
        )


def _motions(
    sightings: _Sightings,
    clock: Clock,
    rules: Rules,
) -> list[Motion]:
    """Of each body at all frames. Raises ValueError if velocities of the file contradict poses."""
    table, tracks = sightings.table, sightings.tracks
    times = table.values["time"]
    smooth_of = causally_smoothed if rules.causal else smoothed
    motions = []
    for track, other in zip(tracks, reversed(tracks), strict=True):
        good = track.good
        smoother = smoothed if track.velocities is not None else smooth_of
        smooth, errors = smoother(times[good], track.poses[good], clock.times, rules.smoothing)
        measured = _interpolated(clock.times, times[good], track.poses[good])
        of_measured = diagonal(np.broadcast_to(errors, measured.shape))
        if track.velocities is None:
            as_seen = replace(smooth, poses=measured, pose_covariances=of_measured)
            motions.append(smooth if rules.smooth_poses else as_seen)
            continue
        velocities = _interpolated(clock.times, times[good], track.velocities[good])
        of_other = None
        if other.velocities is not None:
            of_other = _interpolated(clock.times, times[other.good], other.velocities[other.good])
        require_agreement(table.source, track.body, velocities, smooth.velocities, of_other)
        motions.append(Motion(measured, velocities, of_measured))
    return motions


def _interpolated(
    at: NDArray[np.float64], times: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def _moved(motion: Motion, origin: tuple[float, float, float]) -> Motion:
    """From the camera's frame to the scene's."""
    x, y, yaw = origin
    turn = np.array(
        [
            [math.cos(yaw), -math.sin(yaw), 0.0],
            [math.sin(yaw), math.cos(yaw), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    poses, velocities = motion.pose_covariances, motion.velocity_covariances
    return Motion(
        motion.poses @ turn.T + [x, y, yaw],
        motion.velocities @ turn.T,
        None if poses is None else turn @ poses @ turn.T,
        None if velocities is None else turn @ velocities @ turn.T,
    )
