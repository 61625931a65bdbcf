"""Random closed cages with an object inside: no disturbance gets it out, whatever its walls are."""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from energymargin import mesh, regions
from energymargin._core import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    Part,
    Problem,
    Scene,
    Sphere,
)

__all__ = [
    "GRAVITY",
    "OBJECTS",
    "WALLS",
    "Cage",
    "corners",
    "log_uniform",
    "mesh_of",
    "open_box",
    "random_cage",
    "random_object",
]

WALLS = ("boxes", "compound", "hulls", "mesh")
OBJECTS = ("box", "sphere", "cylinder", "capsule", "hull", "compound")

GRAVITY = 9.81  # m/s^2
INSIDE = (0.06, 0.15)  # m: edges of the room
THICKNESS = (0.001, 0.02)  # m: of the walls, evenly in the logarithm
SIZE = (0.006, 0.02)  # m: half of the object's length
MASS = (0.005, 0.2)  # kg, evenly in the logarithm
WEIGHTS = (0.5, 50.0)  # the bound on the force, in weights of the object, evenly in the logarithm

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Cage:
    """A problem without an answer: its effort of escape is inf."""

    problem: Problem
    walls: str
    """One of WALLS."""
    object: str
    """One of OBJECTS."""
    thickness: float
    """Thickness of the walls [m]."""
    weights: float
    """Bound on the force, in weights of the object."""


def random_cage(seed: int, walls: str | None = None, kind: str | None = None) -> Cage:
    """A room of six walls, turned at random, with an object at rest in it.

    `walls` and `kind`, of WALLS and OBJECTS, are drawn where they are not given. The capture set
    ends in the middle of the walls. Walls of a mesh take the extra [urdf].
    """
    random = np.random.default_rng(seed)
    walls = walls or str(random.choice(WALLS))
    kind = kind or str(random.choice(OBJECTS))
    inside = random.uniform(*INSIDE, 3)
    thickness = log_uniform(random, *THICKNESS)
    turn = Rotation.random(random_state=random)
    scene = Scene(gravity=(0.0, 0.0, -GRAVITY))
    plates = _plates(inside, thickness)
    _add_walls(scene, walls, plates, turn, float(random.uniform(0.0, 1.0)))
    size, mass = random.uniform(*SIZE), log_uniform(random, *MASS)
    room = np.maximum(0.5 * inside - 2.0 * size, 0.0)
    scene.add_body(
        "object",
        random_object(kind, size, random),
        mass=mass,
        position=tuple(turn.apply(random.uniform(-room, room))),
        orientation=tuple(Rotation.random(random_state=random).as_quat()),
        friction=float(random.uniform(0.0, 1.0)),
        role="object",
    )
    weights = log_uniform(random, *WEIGHTS)
    force = weights * GRAVITY * mass
    problem = Problem(
        scene,
        scene.pack(),
        force=(force,) * 3,
        torque=(force * size * float(random.integers(2)) * random.uniform(0.0, 0.2),) * 3,
        duration=float(random.uniform(0.05, 0.5)),
        captured=regions.Box("object", (0.0, 0.0, 0.0), tuple(inside + thickness), frame="frame"),
    )
    return Cage(problem, walls, kind, thickness, weights)


def open_box(walls: str) -> tuple[Problem, float]:
    """A ball in a box without a lid, and its effort of escape [J]: its weight over the rim.

    The capture set ends above the middle of the walls' upper side: no way out is lower, and a slow
    one takes no more.
    """
    inside, thickness, radius, mass = np.array([0.06, 0.06, 0.03]), 0.002, 0.01, 0.03  # m, kg
    scene = Scene(gravity=(0.0, 0.0, -GRAVITY))
    *plates, _lid = _plates(inside, thickness)
    _add_walls(scene, walls, plates, Rotation.identity(), 0.5)
    floor = -0.5 * float(inside[2])
    rim = max(float(center[2] + 0.5 * size[2]) for center, size in plates)
    scene.add_body(
        "object",
        Sphere(radius),
        mass=mass,
        position=(0.0, 0.0, floor + radius),
        friction=0.5,
        role="object",
    )
    width = inside[:2] + thickness
    problem = Problem(
        scene,
        scene.pack(),
        force=(2.0 * mass * GRAVITY,) * 3,
        torque=(0.0, 0.0, 0.0),
        duration=0.3,
        captured=regions.Box("object", (0.0, 0.0, 0.0), (*width, 1.0), frame="frame"),
    )
    return problem, mass * GRAVITY * (rim - floor)


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """A number between two, evenly in the logarithm."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _plates(inside: Vector, thickness: float) -> list[tuple[Vector, Vector]]:
    """Centre and size of each wall. They overlap at the edges and have no corner in common."""
    plates = []
    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        center, size = np.zeros(3), inside + 1.8 * thickness
        center[axis] = side * 0.5 * (inside[axis] + thickness)
        size[axis] = thickness
        plates.append((center, size))
    return plates


def corners(center: Vector, size: Vector) -> Vector:
    """Corners of a box along the axes, shape (8, 3) [m]."""
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    return np.asarray(center + 0.5 * size * signs)


def _add_walls(
    scene: Scene,
    walls: str,
    plates: list[tuple[Vector, Vector]],
    turn: Rotation,
    friction: float,
) -> None:
    """The body "frame" stands in the room's middle and along its axes."""
    kept: dict[str, Any] = {"mass": 0, "friction": friction, "orientation": tuple(turn.as_quat())}
    if walls == "compound":
        parts = [Part(Box(tuple(size)), position=tuple(center)) for center, size in plates]
        scene.add_body("frame", Compound(parts), **kept)
        return
    if walls == "mesh":
        scene.add_body("frame", mesh_of(plates), **kept)
        return
    scene.add_body("frame", Compound([]), **kept)
    for i, (center, size) in enumerate(plates):
        shape = Box(tuple(size)) if walls == "boxes" else ConvexHull(corners(0.0 * center, size))
        scene.add_body(f"wall{i}", shape, position=tuple(turn.apply(center)), **kept)


def mesh_of(plates: list[tuple[Vector, Vector]]) -> Compound:
    """Boxes of these centres and sizes along the axes, as one mesh that is read from a file."""
    import trimesh

    whole: Any = trimesh.util.concatenate(
        [trimesh.creation.box(bounds=corners(*plate)[[0, -1]]) for plate in plates]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walls.stl"
        whole.export(path)
        return mesh(path)


def random_object(kind: str, size: float, random: np.random.Generator) -> Any:
    """No longer than 2 * size from one end to the other; plates, rods and lumps."""
    slim = random.uniform(0.15, 1.0, 3)
    if kind == "box":
        return Box(tuple(2.0 * size * slim / np.linalg.norm(slim)))
    if kind == "sphere":
        return Sphere(size)
    if kind == "cylinder":
        half, radius = size * slim[:2] / np.linalg.norm(slim[:2])
        return Cylinder(radius=radius, length=2.0 * half)
    if kind == "capsule":
        radius = 0.8 * size * slim[0]
        return Capsule(radius=radius, length=2.0 * (size - radius))
    if kind == "hull":
        points = random.normal(size=(16, 3))
        points *= size * slim / np.linalg.norm(points, axis=1, keepdims=True)
        return ConvexHull(points - points.mean(axis=0))
    edge = size / np.sqrt(3.0)
    arms = [
        Part(Box((2.0 * edge, 0.4 * edge, 0.4 * edge)), position=(0.0, 0.0, 0.0)),
        Part(Box((0.4 * edge, 1.2 * edge, 0.4 * edge)), position=(0.7 * edge, 0.5 * edge, 0.0)),
    ]
    return Compound(arms)
