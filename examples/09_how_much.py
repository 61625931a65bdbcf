"""How slippery may a belt get, and how hard may somebody push, until its crate does not stay?

python examples/09_how_much.py
"""

import energymargin as em


def crate(friction: float) -> em.Problem:
    """A crate on a belt, pushed by up to 4 N for a second."""
    scene = em.Scene()
    scene.add_plane("belt", friction=friction)
    size, place = em.Box((0.3, 0.2, 0.2)), (0, 0, 0.1)  # m
    scene.add_body("crate", size, mass=2.0, position=place, friction=1.0, role="object")
    return em.Problem(
        scene,
        scene.pack(),
        captured=em.regions.Ball("crate", center=place, radius=0.05),
        force=(4, 4, 0),
        torque=(0, 0, 0),
        duration=0.2,
        horizon=1.0,
    )


limit = em.critical_value(crate, "friction", (0.02, 1.0), probability=0.95)
print(
    f"it stays with a friction {limit.side} {limit.value:.3f}, {limit.low:.3f} to {limit.high:.3f}"
)

(push,) = em.critical_values(crate(0.4), {"push": (0, 50)})  # what a problem has by name
print(f"with 0.4 it stays {push.side} {push.value:.2f} N, {push.low:.2f} to {push.high:.2f}")
