"""Grippers that hold something in the air."""

import numpy as np

import energymargin as em

HALF = 0.02  # m, of the cube
HEIGHT = 0.15  # m, of its centre


def gripper(axis="x", mast=False, radius=0.015):
    """Two fingers close along an axis, below a palm; a mast of 1.6 m stands a metre away. The cube
    is to stay in a ball."""
    along = [float(axis == name) for name in "xyz"]
    scene = em.Scene()
    scene.add_plane("table", friction=0.5)
    cube = em.Box((2 * HALF,) * 3)
    scene.add_body("cube", cube, mass=0.1, position=(0, 0, HEIGHT), friction=0.7, role="object")
    palm = em.Box((0.14, 0.05, 0.03) if axis == "x" else (0.05, 0.14, 0.03))
    scene.add_body("palm", palm, mass=0, position=(0, 0, HEIGHT + 0.09), role="effector")
    if mast:
        post = em.Box((0.1, 0.1, 1.6))
        scene.add_body("mast", post, mass=0, position=(-1, 0, 0.8), role="effector")
    for name, side in (("left", -1), ("right", 1)):
        pad = em.Box((0.01, 0.02, 0.08) if axis == "x" else (0.02, 0.01, 0.08))
        scene.add_body(name, pad, mass=0.1, friction=0.7, role="effector")
        scene.add_joint(
            f"{name} slide",
            type="prismatic",
            parent="palm",
            child=name,
            axis=[-side * each for each in along],
            origin=[side * (HALF + 0.005) * each - 0.06 * (k == 2) for k, each in enumerate(along)],
            **{"stiffness": 2000, "damping": 20, "target": 0.005, "torque_limit": 10},
        )
    return em.Problem(
        scene,
        scene.pack(),
        force=(2, 2, 2),
        torque=(0.01, 0.01, 0.01),
        duration=0.1,
        captured=em.regions.Ball("cube", center=(0, 0, HEIGHT), radius=radius),
    )


def held_at_a_slant(degrees, mass=0.013, force=10.0, radius=0.03):
    """A light upright cylinder without weight between two fixed points, which it meets at a slant,
    and a finger that presses it into them."""
    scene = em.Scene(gravity=(0, 0, 0))
    barrel = em.Cylinder(radius=radius, length=0.08)
    scene.add_body("object", barrel, mass=mass, friction=0.6, role="object")
    for name, side in (("left", -1), ("right", 1)):
        turn = np.radians(degrees)
        place = -(radius + 0.004) * np.array([np.cos(turn), side * np.sin(turn), 0])
        place[2] = 0.01 * side
        scene.add_body(name, em.Sphere(0.004), mass=0, position=place, friction=1, role="effector")
    scene.add_body("palm", em.Box((0.01,) * 3), mass=0, position=(0, 0, 0.3), role="effector")
    scene.add_body("finger", em.Sphere(0.008), mass=0.1, friction=1, role="effector")
    drive = {"stiffness": 1e4, "damping": 50, "target": 0.05, "torque_limit": force}
    place = (radius + 0.008, 0, -0.3)
    rail = {"type": "prismatic", "axis": (-1, 0, 0), "origin": place}
    scene.add_joint("slide", parent="palm", child="finger", **rail, **drive)
    return scene
