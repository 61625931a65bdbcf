"""Cages in a plane: random closed ones, and a pen with a gap in its wall."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from cages import GRAVITY, OBJECTS, log_uniform, random_object
from scipy.spatial.transform import Rotation

from energymargin import regions
from energymargin._core import Box, Problem, Scene

__all__ = ["PLANE", "pen", "planar_cage"]

PLANE: dict[str, Any] = {"linear_factor": (1.0, 1.0, 0.0), "angular_factor": (0.0, 0.0, 1.0)}
DEPTH = 0.1  # m, of walls across the plane
INSIDE = (0.06, 0.15)  # m: edges of the room
THICKNESS = (0.001, 0.02)  # m: of the walls, evenly in the logarithm
SIZE = (0.006, 0.02)  # m: half of the object's length

WIDTH, THICK, LENGTH, MASS = 0.02, 0.01, 0.05, 0.1  # m, m, m, kg: of the pen's bar, and its walls
ROOM = 0.1  # m, edge of the pen


def planar_cage(seed: int) -> tuple[Problem, str]:
    """A room of four walls, turned at random, with an object in it that moves in their plane.

    Returns the problem and the kind of the object. Gravity pulls along the plane. The capture set
    ends in the middle of the walls.
    """
    random = np.random.default_rng(seed)
    kind = str(random.choice(OBJECTS))
    inside, thickness = random.uniform(*INSIDE, 2), log_uniform(random, *THICKNESS)
    turn = Rotation.from_rotvec((0.0, 0.0, random.uniform(-math.pi, math.pi)))
    scene = Scene(gravity=(0.0, -GRAVITY, 0.0))
    fixed: dict[str, Any] = {"mass": 0, "orientation": tuple(turn.as_quat())}
    for i, (axis, side) in enumerate(itertools.product(range(2), (-1.0, 1.0))):
        edges, place = np.append(inside + 1.8 * thickness, DEPTH), np.zeros(3)
        edges[axis], place[axis] = thickness, side * 0.5 * (inside[axis] + thickness)
        scene.add_body(f"wall{i}", Box(tuple(edges)), position=tuple(turn.apply(place)), **fixed)
    half = random.uniform(*SIZE)
    room = np.maximum(0.5 * inside - 2.0 * half, 0.0)
    scene.add_body(
        "object",
        random_object(kind, half, random),
        mass=0.05,
        position=tuple(turn.apply((*random.uniform(-room, room), 0.0))),
        orientation=tuple(Rotation.random(random_state=random).as_quat()),
        role="object",
        **PLANE,
    )
    # "wall0" is on the room's left, along its axes.
    middle = (0.5 * (inside[0] + thickness), 0.0, 0.0)
    size = (*(inside + thickness), math.inf)
    captured = regions.Box("object", middle, size, frame="wall0")
    return _problem(scene, captured), kind


def pen(gap: float) -> Problem:
    """A bar in a square room without gravity, whose eastern wall has a gap of so many bar widths.

    Raises ValueError on a gap that does not fit into the wall.
    """
    width = gap * WIDTH
    if not 0.0 <= width < ROOM:
        raise ValueError(
            f"gap is {gap}, expected 0 to less than {ROOM / WIDTH:g} widths of the bar"
        )
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    middle, long = 0.5 * (ROOM + THICK), ROOM + 2.0 * THICK
    half = 0.5 * (long - width)
    walls = {
        "west": ((THICK, long), (-middle, 0.0)),
        "south": ((long, THICK), (0.0, -middle)),
        "north": ((long, THICK), (0.0, middle)),
        "east, lower": ((THICK, half), (middle, -0.5 * (width + half))),
        "east, upper": ((THICK, half), (middle, 0.5 * (width + half))),
    }
    for name, (size, place) in walls.items():
        scene.add_body(name, Box((*size, DEPTH)), mass=0, position=(*place, 0.0))
    scene.add_body("object", Box((LENGTH, WIDTH, WIDTH)), mass=MASS, role="object", **PLANE)
    captured = regions.Box("object", (0.0, 0.0, 0.0), (2.0 * ROOM, 2.0 * ROOM, math.inf))
    return _problem(scene, captured)


def _problem(scene: Scene, captured: regions.Region) -> Problem:
    return Problem(
        scene,
        scene.pack(),
        force=(1.0, 1.0, 0.0),
        torque=(0.0, 0.0, 0.01),
        duration=0.3,
        captured=captured,
    )
