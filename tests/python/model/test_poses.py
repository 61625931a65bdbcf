"""Poses of robots' files: turns are those of scipy, to the last bit."""

import numpy as np
from scipy.spatial.transform import Rotation

from energymargin.model.scenes.poses import place, pose

QUARTER = np.pi / 2


def turns():
    """Random ones, and those about the axes by quarters, where formulas change over."""
    random = np.random.default_rng(0)
    quarters = [Rotation.from_euler("xyz", angles) for angles in np.ndindex(4, 4, 4)]
    quarters += [Rotation.from_euler("xyz", QUARTER * random.integers(0, 4, 3)) for _ in range(50)]
    return [*quarters, *Rotation.random(500, random_state=random)]


def test_a_quaternion_becomes_the_matrix_of_scipy():
    for turn in turns():
        quaternion = turn.as_quat()
        assert pose((1, 2, 3), quaternion)[:3, :3].tobytes() == (
            Rotation.from_quat(quaternion).as_matrix().tobytes()
        )


def test_a_matrix_becomes_the_quaternion_of_scipy():
    for turn in turns():
        matrix = np.eye(4)
        matrix[:3, :3] = turn.as_matrix()
        expected = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True)
        assert place(matrix)["orientation"].tobytes() == expected.tobytes()
