"""Random problems of which a bound of the effort can be proved."""

import numpy as np

import energymargin as em

# Axes that are free: those of a shift, and those of a turn.
_LOCKS = [((1, 1, 1), (1, 1, 1)), ((1, 1, 0), (0, 0, 1)), ((1, 0, 0), (0, 0, 0))]
NAMES = ("ball", "box", "disc", "half_space", "slow", "tilt")


def random_problem(seed):
    """An object on a table or in the air, between walls, on springs, locked or free."""
    random = np.random.default_rng(seed)
    scene = em.Scene(gravity=random.choice([0.0, 9.81]) * np.array([0.0, 0.0, -1.0]))
    size = random.uniform(0.02, 0.06)
    mass = random.uniform(300.0, 3000.0) * size**3
    stands = random.random() < 0.9
    linear, angular = _LOCKS[random.integers(3)]
    height = _add_object(scene, random, size, mass, (linear, angular))
    if stands:
        scene.add_plane("table")
    _add_walls(scene, random)
    _add_springs(scene, random, mass)
    velocity = random.choice([0.0, 0.0, 0.1]) * random.normal(size=3) * linear
    state = scene.pack(object={"velocity": velocity, "position": (0.0, 0.0, height)})
    captured = _region(random, height, random.integers(1, 3))
    load = mass * 9.81 * random.uniform(1.0, 8.0)
    return em.Problem(
        scene,
        state,
        captured=captured,
        force=load * np.maximum(random.integers(0, 2, 3), (1, 0, 0)) * linear,
        torque=random.choice([0.0, load * size]) * np.array(angular),
        duration=random.uniform(0.05, 0.3),
        horizon=random.choice([None, 0.5]),
        start_outside=True,
    )


def _add_object(scene, random, size, mass, free):
    """Its height where it stands."""
    hull = em.ConvexHull(size * random.uniform(-1.0, 1.0, (8, 3))).centered()
    shape, height = [
        (em.Sphere(size), size),
        (em.Box((2 * size, size, size)), size / 2),
        (em.Cylinder(size, size), size / 2),
        (hull, -hull.points[:, 2].min()),
    ][random.integers(4)]
    linear, angular = free
    scene.add_body(
        "object", shape, mass=mass, role="object", linear_factor=linear, angular_factor=angular
    )
    return height


def _add_walls(scene, random):
    """A closed pen, part of one, or none."""
    low, away = random.uniform(0.05, 0.3), random.uniform(0.08, 0.15)
    for i in range(random.choice([0, 2, 4, 4])):
        place = away * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)][i])
        wall = em.Box((0.02, 0.4, low))
        yaw = 0.0 if i < 2 else np.pi / 2
        scene.add_body(f"wall_{i}", wall, mass=0.0, position=(*place, low / 2), yaw=yaw)


def _add_springs(scene, random, mass):
    for i in range(random.choice([0, 0, 1, 2])):
        name = f"anchor_{i}"
        scene.add_body(
            name, em.Sphere(0.005), mass=0.0, position=random.uniform(0.4, 0.6) * _direction(random)
        )
        stiffness = mass * 10.0 ** random.uniform(1.0, 4.0)
        scene.add_spring(name, "object", stiffness=stiffness, rest_length=random.choice([0.0, 0.5]))


def _direction(random):
    vector = random.normal(size=3)
    return vector / np.linalg.norm(vector)


def _region(random, height, depth):
    """An expression of sets that have the start, most of them."""
    half = random.uniform(0.02, 0.3)
    name = NAMES[random.integers(len(NAMES))]
    made = {
        "ball": lambda: em.regions.Ball("object", (0, 0, height), radius=half),
        "box": lambda: em.regions.Box(
            "object", (0, 0, height), 2 * half * random.uniform(0.5, 1, 3)
        ),
        "disc": lambda: em.regions.Disc("object", (0, 0), radius=half),
        "half_space": lambda: em.regions.HalfSpace("object", _direction(random), half + height),
        "slow": lambda: em.regions.Speed("object", random.uniform(0.2, 2.0)),
        "tilt": lambda: em.regions.Tilt("object", (0, 0, 1), (0, 0, 1), random.uniform(0.2, 1.5)),
    }[name]()
    if depth == 0:
        return made
    other = _region(random, height, depth - 1)
    return [made & other, made | other, made & ~(~other), made][random.integers(4)]
