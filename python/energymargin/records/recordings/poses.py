"""Poses of a body as numbers of their own: x, y, yaw in the plane, shape (N, 3), or x, y, z and a
quaternion x, y, z, w in space, shape (N, 7).

All else is the same of both kinds: numbers are smoothed and interpolated column by column, and what
comes out is a pose again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from energymargin.base.aliases import Floats


def planar(poses: Floats) -> bool:
    """Whether they are poses in the plane."""
    return bool(poses.shape[1] == 3)


def positions(poses: Floats) -> Floats:
    """x and y, or x, y and z."""
    return poses[:, : 2 if planar(poses) else 3]


def directions(poses: Floats) -> Floats:
    """Numbers of an orientation that neither wrap nor have two signs: cosine and sine of a yaw, or
    the matrix of a rotation, shape (N, 9)."""
    if planar(poses):
        return np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(poses[:, 3:]).as_matrix().reshape(-1, 9))


def continuous(poses: Floats) -> Floats:
    """The same poses without jumps of a yaw by 2 pi, or of a quaternion's sign."""
    found = poses.copy()
    if planar(poses):
        found[:, 2] = np.unwrap(poses[:, 2])
    else:
        turned = (poses[1:, 3:] * poses[:-1, 3:]).sum(axis=1) < 0
        found[1:, 3:] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
    return found


def steps(poses: Floats) -> Floats:
    """Of each pose from the one before: the changes of its position, and its turn [rad]."""
    if planar(poses):
        turns = np.angle(np.exp(1j * np.diff(poses[:, 2])))
    else:
        same = np.abs((poses[1:, 3:] * poses[:-1, 3:]).sum(axis=1))
        turns = 2 * np.arccos(np.minimum(same, 1.0))
    return np.column_stack([np.diff(positions(poses), axis=0), turns])


def units(poses: Floats) -> Floats:
    """The poses, with quaternions of length one."""
    if planar(poses):
        return poses
    return np.hstack([poses[:, :3], poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1)[:, None]])


def to_velocities(poses: Floats) -> Floats:
    """Matrices (N, 3, 3) or (N, 6, 7) that make velocities and angular velocities of the rates of a
    pose's numbers. The angular velocity is twice the vector of q' q*."""
    if planar(poses):
        return np.broadcast_to(np.eye(3), (len(poses), 3, 3))
    lengths = np.linalg.norm(poses[:, 3:], axis=1)
    x, y, z, w = poses[:, 3:].T / lengths
    turns = np.array([[w, -z, y, -x], [z, w, -x, -y], [-y, x, w, -z]])
    found = np.zeros((len(poses), 6, 7))
    found[:, :3, :3] = np.eye(3)
    found[:, 3:, 3:] = np.moveaxis(2 * turns / lengths, 2, 0)
    return found


def moved(poses: Floats, origin: Sequence[float]) -> tuple[Floats, Floats]:
    """Poses in the frame in which their own has this origin (x, y, yaw), and the matrix that turns
    their velocities, (3, 3) or (6, 6)."""
    x, y, yaw = origin
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    if planar(poses):
        return np.asarray(poses @ turn.T + (x, y, yaw)), turn
    from scipy.spatial.transform import Rotation

    turned = (Rotation.from_matrix(turn) * Rotation.from_quat(poses[:, 3:])).as_quat()
    places = np.asarray(poses[:, :3] @ turn.T + (x, y, 0.0))
    return np.hstack([places, turned]), np.asarray(np.kron(np.eye(2), turn))
