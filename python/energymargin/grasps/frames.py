"""Frames of hands: where the grasp frame is in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.checks import numbers_of
from energymargin.grasps.content import poses_of
from energymargin.grasps.grasp_set import check_poses

Pose = NDArray[np.float64]
PADS = 0.1034  # m, from a Panda hand's frame to the middle of its pads, which are .0946 to .1122


def _hand(along: float, *, opens_along_y: bool) -> Pose:
    frame = np.eye(4)
    frame[2, 3] = along
    if opens_along_y:
        frame[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    return frame


FRAMES: dict[str, Pose] = {
    "grasp": np.eye(4),
    "franka_panda": _hand(PADS, opens_along_y=False),
    "robotiq_2f_85": _hand(0.130, opens_along_y=False),
    "robotiq_2f_140": _hand(0.195, opens_along_y=False),
    "panda_hand": _hand(PADS, opens_along_y=True),
    "panda_tcp": _hand(0.0, opens_along_y=True),
}
"""The grasp frame in known frames of hands: the grasp frame itself; the Panda of ACRONYM and
GraspGen and the Robotiqs of GraspGen, open, whose fingers open along x; Franka's own hand and its
tool centre point, whose fingers open along y."""
EXPECTED = (
    f"expected {', '.join(map(repr, FRAMES))}, a distance along the approach z [m], or a pose"
)


def grasp_frame(frame: ArrayLike | str | None, format: str, hand: object = None) -> Pose:
    """The grasp frame in the frame of the hand, shape (4, 4); ValueError if that is none.

    `hand` is what a file of the format says of its hand.
    """
    if frame is None:
        said = f" (here {hand!r})" if hand else ""
        raise ValueError(f"frame is None, and poses of {format} are of any hand{said}; {EXPECTED}")
    return frame_in_hand(frame)


def frame_in_hand(frame: ArrayLike | str) -> Pose:
    """The grasp frame in the frame of a hand, (4, 4): by a name, a distance along z, or a pose;
    ValueError if that is none."""
    if isinstance(frame, str):
        if frame not in FRAMES:
            raise ValueError(f"frame is {frame!r}, {EXPECTED}")
        return FRAMES[frame]
    if np.ndim(frame) == 0:
        return _hand(float(numbers_of("frame", frame, EXPECTED, ())), opens_along_y=False)
    return pose("frame", frame)


def pose(name: str, value: ArrayLike) -> Pose:
    """A pose (4, 4), or of 7 numbers."""
    shape = (7,) if np.shape(value) == (7,) else (4, 4)
    expected = "a matrix (4, 4), or x, y, z and a quaternion x, y, z, w"
    numbers = numbers_of(name, value, expected, shape)
    matrix = poses_of(numbers[None, :3], numbers[None, 3:]) if shape == (7,) else numbers[None]
    check_poses(f"the pose {name}", matrix, [name])
    return np.asarray(matrix[0])
