"""Which frame a page shows first: one before a loss."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from energymargin.viewer.sources import AlongPlan, Frames, StateSource

__all__ = ["first_frame"]

# Share of a trajectory's frames before its loss. In the frames just before it the object leaves by
# itself, and long before it all is well: here the tasks have capture scores of 0.2 to 0.6.
BEFORE = 0.25
MOST = 100  # trajectories that are searched for a loss


def first_frame(source: StateSource, trajectory: int | None, frame: int | None) -> tuple[int, int]:
    """The trajectory and its frame, where they are not given.

    The trajectory is the first one that ends outside of its capture set, or else the first. The
    frame is a quarter of all before its last loss or, without one, in its middle; of a margin along
    a plan it is the weakest moment. It is the first frame if the state of that one makes no
    problem. A frame that is given without a trajectory is the first one's.
    """
    if trajectory is None:
        searched = range(min(source.trajectories, MOST)) if frame is None else ()
        trajectory = _first_lost(source, searched)
    if frame is not None:
        return trajectory, frame
    if isinstance(source, AlongPlan):
        return trajectory, source.along.weakest.number
    return trajectory, _frame_of(source.frames(trajectory))


def _first_lost(source: StateSource, trajectories: Iterable[int]) -> int:
    for trajectory in trajectories:
        captured = source.frames(trajectory).captured
        if captured is not None and captured[0] and not captured[-1]:
            return trajectory
    return 0


def _frame_of(frames: Frames) -> int:
    count, captured = len(frames.times), frames.captured
    lost = np.zeros(0, int) if captured is None else np.flatnonzero(captured[:-1] & ~captured[1:])
    frame = count // 2
    if len(lost):
        frame = max(0, int(lost[-1]) + 1 - max(1, round(BEFORE * count)))
    try:
        frames.problem(frame)
    except ValueError:
        return 0
    return frame
