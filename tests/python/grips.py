"""A body between two pads."""

from __future__ import annotations

import numpy as np

import energymargin as em

GRAVITY = 9.81  # m/s^2


def gripped(
    shape: object,
    side: float,
    load: float,
    *,
    below: float,
    pad: float,
    surface: em.Surface | None = None,
    force: float = 10.0,
    friction: float = 0.4,
    seconds: float = 1.0,
) -> np.ndarray:
    """How far a body moves between two pads of a height, `below` their middle: x, y, z [m].

    `load` is its weight, a share of twice the friction of the force [N].
    """
    scene = em.Scene()
    scene.add_body("palm", em.Box((0.02,) * 3), mass=0, position=(0.0, 0.0, 0.5))
    mass = load * 2.0 * friction * force / GRAVITY
    place = (0.0, 0.0, -below)
    scene.add_body("body", shape, mass=mass, position=place, friction=1.0, surface=surface)
    for way in (-1.0, 1.0):
        name = f"pad {way}"
        scene.add_body(name, em.Box((0.01, 0.03, pad)), mass=0.05, friction=friction)
        scene.add_joint(
            name,
            type="prismatic",
            parent="palm",
            child=name,
            axis=(-way, 0.0, 0.0),
            origin=(way * (side / 2 + 0.005), 0.0, -0.5),
            target=0.01,
            stiffness=5000.0,
            damping=5.0,
            torque_limit=force,
        )
    scene.disable_collisions("pad -1.0", "pad 1.0")
    steps = round(seconds / scene.step)
    end = em.World(scene).simulate(scene.pack(), steps=steps, record=[steps]).states[0]
    return scene.unpack(end)["body"]["position"] - np.array(place)
