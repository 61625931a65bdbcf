"""Poses of bodies: matrices, and positions with quaternions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from energymargin._core import Compound, Inertial, MassProperties, Part, Scene, mass_properties
from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of

Pose = Floats
"""A matrix, shape (4, 4), that takes points of the inner frame to the outer one."""


def pose(position: ArrayLike, orientation: ArrayLike) -> Pose:
    """From a position (3,) [m] and a unit quaternion x, y, z, w; ValueError on anything else."""
    quaternion = numbers_of("orientation", orientation, "4 finite numbers", (4,))
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-6:
        raise ValueError(f"orientation is {orientation!r}, expected a unit quaternion x, y, z, w")
    matrix = np.eye(4)
    matrix[:3, :3] = _turn(quaternion)
    matrix[:3, 3] = numbers_of("position", position, "3 finite numbers", (3,))
    return matrix


def from_rpy(xyz: Sequence[float], rpy: Sequence[float]) -> Pose:
    """From xyz [m] and rpy [rad]: turns about the fixed axes x, then y, then z."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(rpy), np.cos(rpy)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cz, sy * (sx * cz) - cx * sz, sy * (cx * cz) + sx * sz],
        [cy * sz, sy * (sx * sz) + cx * cz, sy * (cx * sz) - sx * cz],
        [-sy, cy * sx, cy * cx],
    ]
    matrix[:3, 3] = xyz
    return matrix + 0.0  # no -0


def place(matrix: Pose) -> dict[str, Floats]:
    """The keywords position (3,) and orientation (4,) of a pose."""
    return {"position": matrix[:3, 3], "orientation": _quaternion(matrix[:3, :3])}


def moved(compound: Compound, matrix: Pose) -> Compound:
    """A compound whose parts stand at their frame, moved to a pose."""
    parts = [Part(part.shape, **place(matrix)) for part in compound.parts]
    if compound.solid is None:
        return Compound(parts)
    from scipy.spatial.transform import Rotation

    solid = compound.solid
    turned = Rotation.from_matrix(matrix[:3, :3]) * Rotation.from_quat(solid.axes)
    center = matrix[:3, :3] @ solid.center + matrix[:3, 3]
    own = MassProperties(solid.volume, center, solid.moments, turned.as_quat())
    return Compound(parts, solid=own)


def together(compounds: Sequence[Compound]) -> Compound:
    """One compound of several, with the mass properties of their solids; where they overlap, twice.

    Without a solid, as those of open meshes, a compound has the mass properties of its parts.
    """
    parts = [part for compound in compounds for part in compound.parts]
    if all(compound.solid is None for compound in compounds):
        return Compound(parts)
    known = [mass_properties(own, mass_properties(own).volume) for own in compounds]
    volume = sum(own.volume for own in known)
    center = sum(own.volume * np.asarray(own.center) for own in known) / volume
    inertia = np.zeros((3, 3))
    for own in known:
        inertia += tensor(own.moments, own.axes)
        inertia += of_point(own.volume, own.center - center)
    whole = Inertial(center, inertia=inertia / volume)
    return Compound(parts, solid=MassProperties(volume, center, whole.moments, whole.axes))


def tensor(moments: ArrayLike, axes: ArrayLike) -> Floats:
    """The inertia (3, 3) of principal moments (3,) about axes, a quaternion x, y, z, w."""
    turn = pose((0.0, 0.0, 0.0), axes)[:3, :3]
    return np.asarray(turn @ np.diag(moments) @ turn.T)


def of_point(mass: float, arm: Floats) -> Floats:
    """The inertia (3, 3) of a mass at a point (3,), about the origin: the parallel axis theorem."""
    return np.asarray(mass * (arm @ arm * np.eye(3) - np.outer(arm, arm)))


# Of scipy, to its last bit; to import that takes longer than to make and to score a hand.


def _turn(quaternion: Floats) -> Floats:
    """The matrix (3, 3) of a quaternion x, y, z, w."""
    x, y, z, w = quaternion / _norm(quaternion)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    return np.array(
        [
            [xx - yy - zz + ww, 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), -xx + yy - zz + ww, 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), -xx - yy + zz + ww],
        ]
    )


def _quaternion(turn: Floats) -> Floats:
    """x, y, z, w of a matrix (3, 3), by the largest of the four (Shepperd 1978). Of q and -q it is
    the one in which the first of w, x, y, z that is not 0 is above 0."""
    m = turn
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    largest = int(np.argmax([m[0, 0], m[1, 1], m[2, 2], trace]))
    quaternion = np.empty(4)
    if largest == 3:
        quaternion[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + trace
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        quaternion[i] = 1 - trace + 2 * m[i, i]
        quaternion[j] = m[j, i] + m[i, j]
        quaternion[k] = m[k, i] + m[i, k]
        quaternion[3] = m[k, j] - m[j, k]
    quaternion /= _norm(quaternion)
    x, y, z, w = quaternion
    return -quaternion if next(number for number in (w, x, y, z) if number != 0) < 0 else quaternion


def _norm(quaternion: Floats) -> float:
    x, y, z, w = quaternion
    return float(np.sqrt(x * x + y * y + z * z + w * w))


def body_poses(scene: Scene, state: ArrayLike) -> dict[str, tuple[Floats, Floats]]:
    """By body of a scene its position [m] and unit quaternion x, y, z, w in a state, shape (n,)."""
    moving = scene.unpack(state)
    return {
        body.name: (body.position, body.orientation)
        if body.fixed
        else (moving[body.name]["position"], moving[body.name]["orientation"])
        for body in scene.bodies
    }
