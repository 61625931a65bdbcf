"""A ball in a box without a lid: the least work that takes it out is m g h, and with a lid there is
no way out, which is proved.

python examples/14_cage.py
"""

import energymargin as em

SIDE, HEIGHT, RADIUS, MASS = 0.12, 0.06, 0.02, 0.05  # m, m, m, kg


def problem(lid: bool) -> em.Problem:
    """The ball rests in the middle."""
    scene = em.Scene()
    wall, front = em.Box((0.01, SIDE, HEIGHT)), em.Box((SIDE, 0.01, HEIGHT))
    walls = {
        "floor": (em.Box((SIDE, SIDE, 0.01)), (0, 0, -0.005)),
        "left": (wall, (-SIDE / 2, 0, HEIGHT / 2)),
        "right": (wall, (SIDE / 2, 0, HEIGHT / 2)),
        "front": (front, (0, -SIDE / 2, HEIGHT / 2)),
        "back": (front, (0, SIDE / 2, HEIGHT / 2)),
    }
    if lid:
        walls["lid"] = (em.Box((SIDE, SIDE, 0.01)), (0, 0, HEIGHT + 0.005))
    for name, (box, position) in walls.items():
        scene.add_body(name, box, mass=0, position=position)
    ball = em.Sphere(RADIUS)
    scene.add_body("ball", ball, mass=MASS, position=(0, 0, RADIUS), role="object")
    return em.Problem(
        scene,
        scene.pack(),
        captured=em.regions.Ball("ball", center=(0, 0, 0), radius=0.15),
        force=(1, 1, 1),
        torque=(0, 0, 0),
        duration=0.2,
    )


for lid in (False, True):
    bound = em.effort_lower_bound(problem(lid), cells=20_000)
    print(f"{'with' if lid else 'without'} a lid: no way out takes less than {bound.effort:.4f} J")
print(f"over the wall: {MASS * 9.81 * HEIGHT:.4f} J")
