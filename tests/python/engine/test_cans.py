"""A can stands on its whole rim: when it tips, in any direction, and what that takes."""

from __future__ import annotations

import numpy as np
import pytest

import energymargin as em

GRAVITY = 9.81
RADIUS, HEIGHT, MASS = 0.03, 0.12, 0.3
CAN = em.Cylinder(radius=RADIUS, length=HEIGHT)


def scene_with_can(floor: str, tilt: float, yaw: float, heading: float = 0.0) -> em.Scene:
    """A can on a slope that falls along a heading."""
    down = GRAVITY * np.array(
        [np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), -np.cos(tilt)]
    )
    scene = em.Scene(gravity=down)
    upright = (0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2))
    if floor == "plane":
        scene.add_plane("floor", friction=5)
    elif floor == "cylinder":
        scene.add_body(
            "floor", em.Cylinder(radius=0.1, length=0.2), mass=0, position=(0, 0, -0.1), friction=5
        )
    elif floor == "two boxes":
        for side in (-1, 1):
            scene.add_body(
                f"floor{side}",
                em.Box((2, 2, 0.2)),
                mass=0,
                position=(side * 1.0, 0, -0.1),
                friction=5,
            )
    else:
        scene.add_body("floor", em.Box((2, 2, 0.2)), mass=0, position=(0, 0, -0.1), friction=5)
    if floor == "upside down":
        upright = (np.cos(yaw / 2), np.sin(yaw / 2), 0.0, 0.0)
    scene.add_body(
        "can",
        CAN,
        mass=MASS,
        position=(0, 0, HEIGHT / 2),
        orientation=upright,
        friction=1,
        role="object",
    )
    return scene


def tips(scene: em.Scene, seconds: float = 3.0) -> bool:
    state = em.World(scene).simulate(scene.pack(), round(seconds / scene.step)).states[-1]
    return bool(abs(scene.unpack(state)["can"]["position"][2] - HEIGHT / 2) > 0.02)


@pytest.mark.parametrize("floor", ["plane", "box", "upside down", "cylinder", "two boxes"])
@pytest.mark.parametrize(
    ("yaw", "heading"), [(0.0, 0.0), (0.2, 0.0), (np.pi / 8, 0.0), (0.6, 1.0), (0.0, 2.0)]
)
def test_a_can_tips_where_the_slope_is_its_width_over_its_height(
    floor: str, yaw: float, heading: float
) -> None:
    limit = 2 * RADIUS / HEIGHT
    below = 0.97 if floor == "two boxes" else 0.99  # across a seam it wobbles
    assert not tips(scene_with_can(floor, np.arctan(below * limit), yaw, heading))
    assert tips(scene_with_can(floor, np.arctan(1.01 * limit), yaw, heading))


@pytest.mark.parametrize("heading", [0.0, 0.4, np.pi / 2])
def test_a_can_that_stands_out_over_an_edge_tips_about_what_bears_it(heading: float) -> None:
    """Its circle bears as far as the table goes, here a third of its radius beyond its middle."""
    out = RADIUS / 3
    x, y = np.cos(heading), np.sin(heading)
    lever = min(RADIUS, out / max(x, 1e-9))
    for share in (0.98, 1.02):
        tilt = np.arctan(share * lever / (HEIGHT / 2))
        down = GRAVITY * np.array([np.sin(tilt) * x, np.sin(tilt) * y, -np.cos(tilt)])
        scene = em.Scene(gravity=down)
        scene.add_body(
            "table", em.Box((2, 2, 0.2)), mass=0, position=(out - 1, 0, -0.1), friction=5
        )
        scene.add_body(
            "can", CAN, mass=MASS, position=(0, 0, HEIGHT / 2), friction=1, role="object"
        )
        assert tips(scene) == (share > 1.0), share


def test_a_can_stands_under_a_load_that_turns() -> None:
    """Just below what tips it, once around in half a second."""
    scene = scene_with_can("plane", 0.0, 0.1)
    steps = round(2.0 / scene.step)
    angles = 4 * np.pi * scene.step * np.arange(steps)
    wrenches = np.zeros((steps, 6))
    wrenches[:, 0] = 0.97 * MASS * GRAVITY * 2 * RADIUS / HEIGHT * np.cos(angles)
    wrenches[:, 1] = 0.97 * MASS * GRAVITY * 2 * RADIUS / HEIGHT * np.sin(angles)
    played = em.World(scene).simulate(scene.pack(), steps, drives={"can": wrenches})
    assert scene.unpack(played.states[-1])["can"]["position"][2] == pytest.approx(
        HEIGHT / 2, abs=2e-4
    )
