"""Contacts that stay open have no rows, and all is as if they had them.

A surface that is that of rigid bodies, on a body that nothing touches, gives rows to all contacts.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import energymargin as em

STEPS = 120


def hull(random: np.random.Generator, size: float) -> em.ConvexHull:
    """A cup-like cloud of many points."""
    points = random.normal(size=(60, 3))
    return em.ConvexHull(size * points / np.linalg.norm(points, axis=1)[:, None])


def add_cups(scene: em.Scene, random: np.random.Generator) -> None:
    """Two cups of 17 boxes that rock on a plane, and knock against each other."""
    parts = [em.Part(em.Box((0.07, 0.07, 0.004)), (0.0, 0.0, 0.002))]
    for angle in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False):
        turn = tuple(Rotation.from_euler("z", angle).as_quat())
        side = (0.04 * np.cos(angle), 0.04 * np.sin(angle), 0.04)
        parts.append(em.Part(em.Box((0.004, 0.016, 0.08)), side, turn))
    for i in range(2):
        scene.add_body(
            *(f"cup {i}", em.Compound(parts)),
            mass=0.3,
            position=(0.09 * i, 0.0, 0.0015),
            orientation=Rotation.from_euler("x", 0.02 + 0.01 * i).as_quat(),
            velocity=(0.1 - 0.2 * i, 0.0, 0.0),
            angular_velocity=random.uniform(-1.5, 1.5, 3),
            role="object",
        )


def add_rocking(scene: em.Scene, random: np.random.Generator) -> None:
    """Plates of many points that rock on each other: their far corners open and close."""
    for i in range(3):
        points = [hull(random, 0.01).points * (6.0, 6.0, 0.4), hull(random, 0.06).points]
        scene.add_body(
            *(f"body {i}", em.ConvexHull(np.concatenate(points) * (1.0, 1.0, 0.2))),
            mass=0.3,
            position=(0.0, 0.0, 0.0125 + 0.0243 * i),
            orientation=Rotation.from_euler("x", 0.003 * i).as_quat(),
            angular_velocity=random.uniform(-0.5, 0.5, 3),
            role="object",
        )


def add_hand(scene: em.Scene, random: np.random.Generator) -> None:
    """A hull between the fingers of a hand that close."""
    scene.add_body("hand", em.Box((0.02, 0.02, 0.02)), mass=0.0, position=(0.0, 0.0, 0.3))
    for side, x in (("left", -1.0), ("right", 1.0)):
        scene.add_body(side, hull(random, 0.02), mass=0.1, role="effector")
        scene.add_joint(
            side,
            type="prismatic",
            parent="hand",
            child=side,
            axis=(-x, 0.0, 0.0),
            origin=(0.0722 * x, 0.0, -0.25),
            limits=(-0.05, 0.05),
            target=0.01,
            stiffness=500.0,
            damping=20.0,
            torque_limit=10.0,
        )
    scene.add_body("body", hull(random, 0.05), mass=0.2, position=(0.0, 0.0, 0.0502), role="object")


@pytest.mark.parametrize("add", [add_cups, add_rocking, add_hand])
@pytest.mark.parametrize("seed", range(4))
def test_rows_of_open_contacts_change_no_bit(
    add: Callable[[em.Scene, np.random.Generator], None], seed: int
) -> None:
    ends = []
    for surface in (None, em.Surface()):
        scene = em.Scene()
        scene.add_plane("floor", friction=0.5)
        far = (0.0, 0.0, -5.0)
        scene.add_body("far", em.Sphere(0.1), mass=0.0, position=far, surface=surface)
        add(scene, np.random.default_rng(seed))
        ends.append(em.World(scene).simulate(scene.pack(), steps=STEPS).states[-1])
    assert np.array_equal(*ends)
