"""Frames that a camera dropped: by the jumps of their numbers, and by the time without a body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.table import FrameTable

__all__ = ["Clock", "filled_clock", "require_short_gaps"]

USUAL = 1.5  # usual steps of time: with less, no frame is missing
LEAST_STEP = 0.5  # of the usual step of time, between frames that are filled in


@dataclass(frozen=True)
class Clock:
    """Numbers and times of all K frames, with those that the file does not have."""

    frames: NDArray[np.int64]
    times: NDArray[np.float64]
    missing: tuple[int, ...]
    """Of the frames that the file does not have."""


def require_short_gaps(
    table: FrameTable, body: str, good: NDArray[np.bool_], longest_gap: float
) -> None:
    """Raises ValueError with the line after a longer time without a good pose of this body."""
    times = table.values["time"]
    rows = np.flatnonzero(good)
    gaps = np.diff(times[rows])
    longest = max(longest_gap, USUAL * float(np.median(np.diff(times))))  # of a slow camera
    if (gaps > longest).any():
        k = int(np.argmax(gaps > longest))
        before, after = rows[k], rows[k + 1]
        numbers = table.values["frame"]
        raise table.source.error(
            f"the {body} was not seen for {gaps[k]:.3g} s, from frame {numbers[before]:.0f} to "
            f"{numbers[after]:.0f}, expected at most {longest:g} s: cut the recording there, "
            "or allow a larger longest_gap",
            int(table.lines[after]),
        )


def filled_clock(table: FrameTable) -> Clock:
    """With the frames whose numbers are missing, at times in between.

    A camera of which every n-th frame is kept has frames whose numbers rise by n. Raises ValueError
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
