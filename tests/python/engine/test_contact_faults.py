"""Right values that contacts missed once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from grips import gripped

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


@pytest.mark.parametrize("solid", ["box", "hull"])
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


def bevelled(sides: tuple[float, float, float], bevel: float) -> em.ConvexHull:
    """A box whose edges and corners are cut off."""
    points = []
    for corner in np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T:
        for axis in range(3):
            reach = np.array(sides) / 2 - bevel
            reach[axis] = sides[axis] / 2
            points.append(tuple(corner * reach))
    return em.ConvexHull(points)


@pytest.mark.parametrize("bevel", [2e-4, 5e-4, 8e-4, 1e-3, 2e-3])
def test_bevelled_boxes_stand_on_their_faces(bevel: float) -> None:
    scene = em.Scene()
    scene.add_body("ground", em.Box((0.3, 0.3, 0.05)), mass=0, position=(0.0, 0.0, -0.025))
    for i in range(3):
        box = bevelled((0.1, 0.08, 0.09), bevel)
        place = (0.0, 0.0, 0.045 + 0.09 * i)
        scene.add_body(f"box {i}", box, mass=1.0, position=place, role="object")
    end = em.World(scene).simulate(scene.pack(), steps=240, record=[240]).states[0]
    for i in range(3):
        place = scene.unpack(end)[f"box {i}"]["position"]
        assert np.abs(place - (0.0, 0.0, 0.045 + 0.09 * i)).max() < 2e-5


@pytest.mark.parametrize("bevel", [0.0, 5e-4, 8e-4])
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_grip_holds_a_bevelled_cube(bevel: float, share: float) -> None:
    cube = bevelled((0.1, 0.1, 0.1), bevel)
    how = {"pad": 0.06, "force": 20.0, "friction": 0.5, "seconds": 2.0}
    assert np.linalg.norm(gripped(cube, 0.1, share, below=0.0, **how)) < 1e-4
