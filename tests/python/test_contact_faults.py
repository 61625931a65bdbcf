"""Right values that contact or linkages missed once, or miss still: those are marked."""

from __future__ import annotations

import math

import numpy as np
import pytest

import energymargin as em


def overlap_left(speed: float) -> float:
    """Of a cube that begins 1 mm inside a platform and rises with it: after 0.15 s [m]."""
    scene = em.Scene()
    rises = (0.0, 0.0, speed)
    scene.add_body(
        "platform",
        em.Box((0.3, 0.3, 0.05)),
        mass=1.0,
        kinematic=True,
        position=(0.0, 0.0, -0.025),
        velocity=rises,
    )
    scene.add_body(
        "cube",
        em.Box((0.06, 0.06, 0.06)),
        mass=0.3,
        position=(0.0, 0.0, 0.029),
        velocity=rises,
        role="object",
    )
    world = em.World(scene)
    end = world.simulate(scene.pack(), steps=36, record=[36]).states[0]
    return -world.distance(end, "platform", "cube")


@pytest.mark.parametrize("speed", [0.0, -0.3, 0.3])
def test_overlap_is_put_right_whatever_the_speed_of_what_carries(speed: float) -> None:
    assert overlap_left(speed) < 5e-6


def drift(feature: str) -> float:
    """By how much the velocity of a free linkage's centre of mass changes in 5 s [m/s]."""
    scene = em.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(
        "base",
        em.Box((0.1, 0.08, 0.06)),
        mass=1.0,
        velocity=(0.3, -0.2, 0.1),
        angular_velocity=(2.0, -3.0, 1.0),
        role="object",
    )
    for name, mass in (("upper", 0.6), ("lower", 0.4)):
        scene.add_body(name, em.Box((0.02, 0.03, 0.1)), mass=mass)
    below = (0.0, 0.0, 0.05)
    hip = {"parent": "base", "child": "upper", "axis": (0.0, 1.0, 0.0), "start_velocity": 6.0}
    knee = {"parent": "upper", "child": "lower", "axis": (1.0, 0.0, 0.0)}
    knee |= {"mimic": em.Mimic("hip", -0.7)} if feature == "mimic" else {"start_velocity": -4.0}
    scene.add_joint("hip", origin=(0.06, 0.0, -0.05), child_origin=below, **hip)
    scene.add_joint("knee", origin=(0.0, 0.0, -0.05), child_origin=below, **knee)
    if feature == "tendon":
        scene.add_tendon("tendon", {"hip": 1.0, "knee": 0.6}, friction=0.02)
    scene.disable_collisions("base", "lower")
    masses = {body.name: body.mass for body in scene.bodies}

    def center(state: np.ndarray) -> np.ndarray:
        bodies = scene.unpack(state)
        return sum(mass * bodies[name]["position"] for name, mass in masses.items()) / 2.0

    played = em.World(scene).simulate(scene.pack(), steps=1200, record=[0, 120, 600, 1200])
    start, soon, middle, end = (center(state) for state in played.states)
    return float(np.linalg.norm((end - middle) / 2.5 - (soon - start) / 0.5))


@pytest.mark.parametrize(
    "feature",
    [
        "none",
        pytest.param("mimic", marks=pytest.mark.xfail(strict=True, reason="0.010 in 0.14.0")),
        pytest.param("tendon", marks=pytest.mark.xfail(strict=True, reason="0.008 in 0.14.0")),
    ],
)
def test_a_free_linkage_keeps_its_momentum(feature: str) -> None:
    assert drift(feature) < 3e-5


@pytest.mark.parametrize(
    "solid",
    [
        "box",
        pytest.param("hull", marks=pytest.mark.xfail(strict=True, reason="1e-4 in 0.14.0")),
    ],
)
def test_the_normal_of_two_flat_faces_is_theirs(solid: str) -> None:
    half = 0.08 / math.sqrt(2.0), 0.08 / math.sqrt(2.0), 0.06
    turn = math.pi / 4 + 0.1
    corners = [(0.08 * math.cos(a), 0.08 * math.sin(a)) for a in np.arange(4) * math.pi / 2 + 0.1]
    points = [(x, y, z) for z in (-0.06, 0.06) for x, y in corners]
    shape = em.ConvexHull(points) if solid == "hull" else em.Box(tuple(2.0 * np.array(half)))
    scene = em.Scene()
    scene.add_body("stand", em.Box((0.0656, 0.0786, 0.04)), mass=0, position=(0.0, 0.0, -0.02))
    yaw = turn if solid == "box" else 0.0
    scene.add_body("prism", shape, mass=1.0, position=(0.0, 0.0, 0.06), yaw=yaw, role="object")
    contacts = em.World(scene).contacts(scene.pack())
    assert len(contacts) >= 4
    assert max(float(np.linalg.norm(contact.normal[:2])) for contact in contacts) < 1e-9
