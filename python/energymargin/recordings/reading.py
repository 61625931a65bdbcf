"""A camera's recording, from its CSV file: read, checked, mended by stated rules."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import positive_number, yes_or_no
from energymargin.recordings import columns as layouts
from energymargin.recordings.columns import BODIES, Columns, of_body
from energymargin.recordings.gaps import Clock, filled_clock, require_short_gaps
from energymargin.recordings.outliers import LEAST_JUMP, LEAST_TURN, jumps
from energymargin.recordings.plausible import require_agreement, require_clock, require_units
from energymargin.recordings.recording import Mended, Motion, Recording
from energymargin.recordings.smoothing import LEAST_FRAMES, SMOOTHING, smoothed
from energymargin.recordings.table import FrameTable, read_table

__all__ = ["LONGEST_GAP", "read_csv"]

LONGEST_GAP = 0.1  # s; three frames at 33 Hz, in which a push of 5 cm/s goes 5 mm
MOST_MENDED = 0.25  # of the frames


@dataclass(frozen=True)
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
        """Without the frames before both bodies are first seen, or after they are last seen."""
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
    mend: bool = True,
    longest_gap: float = LONGEST_GAP,
    least_jump: float = LEAST_JUMP,
    least_turn: float = LEAST_TURN,
    smoothing: float = SMOOTHING,
    smooth_poses: bool = True,
    origin: Sequence[float] | None = None,
) -> Recording:
    """The recording in a CSV file: a row a frame, with the poses of two bodies in a plane.

    `columns`: a JSON file that says which column is what, and the units; None: the header is
    frame,time,object_x,object_y,object_yaw,object_vx,object_vy,object_yaw_rate, and the same of the
    effector [m, rad, s]; the velocities may be missing. `docs/guides/recordings.md` has the rules:

    Frames that are missing, or in which a body was not seen, are interpolated over at most
    `longest_gap` [s]; so are outliers, that jump by at least `least_jump` [m] or `least_turn`
    [rad]. `mend=False` makes each of them an error. Velocities that the file does not have are
    those of a smoothing spline of at most the time scale `smoothing` [s], and so are that body's
    poses, unless `smooth_poses=False`. `origin`: of the camera's frame in the scene's, x, y [m] and
    yaw [rad], instead of the one of `columns`.

    Raises OSError, and ValueError that names the file, the line and what was expected there.
    """
    for name, value in (
        ("longest_gap", longest_gap),
        ("least_jump", least_jump),
        ("least_turn", least_turn),
        ("smoothing", smoothing),
    ):
        positive_number(name, value)
    yes_or_no("mend", mend)
    layout = Columns.of(columns)
    table = _with_frames(read_table(path, layout))
    _require_enough(table, len(table.lines), "rows")
    require_clock(table)
    length = float(np.ptp(table.values["time"]))
    if smoothing > length:
        raise ValueError(
            f"smoothing is {smoothing:g}, expected at most the recording's {length:g} s"
        )
    tracks = tuple(_track(table, body, (least_jump, least_turn)) for body in BODIES)
    sightings = _Sightings(table, tracks).between_ends()
    for track in sightings.tracks:
        require_short_gaps(sightings.table, track.body, track.good, longest_gap)
    clock = filled_clock(sightings.table)
    mended = _mended(table, sightings, clock)
    _require_little(table, mended, len(clock.times), mend=mend)
    motions = _motions(sightings, clock, smoothing, smooth_poses=smooth_poses)
    place = layouts.origin(layout.origin if origin is None else origin)
    object_motion, effector_motion = (_moved(motion, place) for motion in motions)
    return Recording(
        Path(path).name, clock.frames, clock.times, object_motion, effector_motion, mended
    )


def _with_frames(table: FrameTable) -> FrameTable:
    """A file without numbers of frames has none missing."""
    if "frame" in table.values:
        return table
    numbers = np.arange(len(table.lines), dtype=float)
    return FrameTable(table.source, table.lines, {"frame": numbers, **table.values})


def _track(table: FrameTable, body: str, least: tuple[float, float]) -> _Track:
    """Checked for units; outliers are known."""
    require_units(table, body)
    of_pose, of_velocity = of_body(body)
    poses = np.stack([table.values[name] for name in of_pose], axis=1)
    velocities = None
    if of_velocity[0] in table.values:
        velocities = np.stack([table.values[name] for name in of_velocity], axis=1)
    measured = poses if velocities is None else np.concatenate([poses, velocities], axis=1)
    seen = np.asarray(np.isfinite(measured).all(axis=1))
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


def _mended(table: FrameTable, sightings: _Sightings, clock: Clock) -> Mended:
    """What becomes of the frames of a file, of which those between the ends are kept."""
    kept, tracks = sightings.table, sightings.tracks
    return Mended(
        clock.missing,
        {t.body: _frames(kept, ~t.seen) for t in tracks if not t.seen.all()},
        {t.body: _frames(kept, t.jumped) for t in tracks if t.jumped.any()},
        _frames(table, ~np.isin(table.lines, kept.lines)),
    )


def _frames(table: FrameTable, rows: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(number) for number in table.values["frame"][rows])


def _require_little(table: FrameTable, mended: Mended, frames: int, *, mend: bool) -> None:
    """Raises ValueError if more was mended than may be."""
    wrong = sorted({*mended.frames, *mended.left_out})
    if wrong and not mend:
        after = min(int(np.searchsorted(table.values["frame"], wrong[0])), len(table.lines) - 1)
        raise table.source.error(
            f"frame {wrong[0]} is to be mended ({mended}), which mend=False forbids",
            int(table.lines[after]),
        )
    if len(mended.frames) > MOST_MENDED * frames:
        raise table.source.error(
            f"{len(mended.frames)} of {frames} frames would be mended ({mended}), "
            f"expected at most {MOST_MENDED:.0%}"
        )


def _motions(
    sightings: _Sightings,
    clock: Clock,
    time_scale: float,
    *,
    smooth_poses: bool,
) -> list[Motion]:
    """Of each body at all frames; the velocities of a file agree with its poses."""
    table, tracks = sightings.table, sightings.tracks
    times = table.values["time"]
    motions = []
    for track, other in zip(tracks, reversed(tracks), strict=True):
        good = track.good
        smooth = smoothed(times[good], track.poses[good], clock.times, time_scale)
        measured = _interpolated(clock.times, times[good], track.poses[good])
        if track.velocities is None:
            motions.append(Motion(smooth.poses if smooth_poses else measured, smooth.velocities))
            continue
        velocities = _interpolated(clock.times, times[good], track.velocities[good])
        of_other = None
        if other.velocities is not None:
            of_other = _interpolated(clock.times, times[other.good], other.velocities[other.good])
        require_agreement(table.source, track.body, velocities, smooth.velocities, of_other)
        motions.append(Motion(measured, velocities))
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
    return Motion(motion.poses @ turn.T + [x, y, yaw], motion.velocities @ turn.T)
