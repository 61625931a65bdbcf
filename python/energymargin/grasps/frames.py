"""Poses from numbers, and frames of hands: where the grasp frame is in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of, require, shown
from energymargin.grasps.grasp_set import ROUNDED, check_poses

PADS = 0.1034  # m, from a Panda hand's frame to the middle of its pads, which are .0946 to .1122


def _hand(along: float, *, opens_along_y: bool) -> Floats:
    frame = np.eye(4)
    frame[2, 3] = along
    if opens_along_y:
        frame[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    return frame


FRAMES: dict[str, Floats] = {
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
NAMES = ", ".join(map(repr, FRAMES))
EXPECTED = f"{NAMES}, a distance along the approach z [m], or a pose"


def grasp_frame(frame: ArrayLike | str | None, format: str, hand: object = None) -> Floats:
    """The grasp frame in the frame of the hand, shape (4, 4); ValueError if that is none.

    `hand` is what a file of the format says of its hand.
    """
    if frame is None:
        said = f"poses of {format} are of any hand{f' (here {hand!r})' if hand else ''}"
        raise ValueError(f"frame is None, and {said}; expected {EXPECTED}")
    return frame_in_hand(frame)


def frame_in_hand(frame: ArrayLike | str) -> Floats:
    """The grasp frame in the frame of a hand, (4, 4): by a name, a distance along z, or a pose;
    ValueError if that is none."""
    if isinstance(frame, str):
        require(frame in FRAMES, "frame", frame, EXPECTED)
        return FRAMES[frame]
    if np.ndim(frame) == 0:
        return _hand(float(numbers_of("frame", frame, EXPECTED, ())), opens_along_y=False)
    return pose("frame", frame)


def pose(name: str, value: ArrayLike) -> Floats:
    """A pose (4, 4), or of 7 numbers."""
    shape = (7,) if np.shape(value) == (7,) else (4, 4)
    expected = "a matrix (4, 4), or x, y, z and a quaternion x, y, z, w"
    numbers = numbers_of(name, value, expected, shape)
    matrix = poses_of(numbers[None, :3], numbers[None, 3:]) if shape == (7,) else numbers[None]
    check_poses(f"the pose {name}", matrix, [name])
    return np.asarray(matrix[0])


def poses_of(positions: NDArray[np.float64], quaternions: NDArray[np.float64]) -> Floats:
    """Poses (n, 4, 4) from positions (n, 3) and unit quaternions x, y, z, w (n, 4).

    Raises ValueError that names the first row, from 1 on, whose quaternion has another norm.
    """
    norms = np.linalg.norm(quaternions, axis=1)
    right = np.abs(norms - 1) <= ROUNDED
    if not right.all():
        k = int(np.argmin(right))
        given = f"{shown(tuple(quaternions[k].tolist()))} (x, y, z, w) with the norm {norms[k]:.4g}"
        way = "expected 1: are its columns the ones that are meant?"
        raise ValueError(f"the quaternion of grasp {k + 1} is {given}, {way}")
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 3] = positions
    if len(poses):
        poses[:, :3, :3] = Rotation.from_quat(quaternions).as_matrix()
    return poses


def quaternions_of(poses: Floats) -> NDArray[np.float64]:
    """Quaternions x, y, z, w with w >= 0, shape (n, 4)."""
    return np.asarray(Rotation.from_matrix(poses[:, :3, :3]).as_quat(canonical=True))
