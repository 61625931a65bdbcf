"""A box on a floor beside an effector, about which beliefs are held."""

import energymargin as em

HALF = 0.05  # m, of the box


def scene(wall=None):
    """A box on a floor, a wall beside it at an x, and an effector far away."""
    made = em.Scene()
    made.add_plane("floor", friction=0.6)
    made.add_body(
        "object",
        em.Box((2 * HALF,) * 3),
        mass=0.5,
        position=(0, 0, HALF),
        friction=0.4,
        role="object",
    )
    made.add_body("effector", em.Sphere(0.05), mass=1, position=(-0.5, 0, 0.05), role="effector")
    if wall is not None:
        size, there = (0.1, 1, 0.1), (wall + 0.05, 0, 0.05)
        made.add_body("wall", em.Box(size), mass=0, position=there)
    return made


def problem(wall=None, **changes):
    own = scene(wall)
    return em.Problem(
        own,
        changes.pop("state", own.pack()),
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.2,
        captured=em.regions.Ball("object", (0, 0, HALF), 0.1),
        start_outside=True,
        **changes,
    )
