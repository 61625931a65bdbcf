"""One job of part `start`, twice in a process of its own: the first call pays for what later ones
find there. Prints both times in JSON [s].
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial

import energymargin as em
from energymargin.tasks.grasp import GraspTask

HAND_FRICTION = 0.5


def score(file: str) -> Callable[[], object]:
    """A capture score of a problem."""
    return partial(em.capture_score, em.Problem.load(file), nodes=100, warn=False)


def hand() -> em.Scene:
    """A new hand of `grasp` from its URDF file, with box and table."""
    return GraspTask().scene({"friction": HAND_FRICTION, "clench": 1.0})


def mesh_world(file: str) -> em.World:
    """A mesh on a plane."""
    scene = em.Scene()
    scene.add_plane("ground")
    scene.add_body("mesh", em.mesh(file), mass=1.0, role="object")
    return em.World(scene)


# By name: makes what is timed, from a file.
JOBS: dict[str, Callable[[str], Callable[[], object]]] = {
    "score": score,
    "hand": lambda _: hand,
    "hand's world": lambda _: partial(em.World, hand()),
    "mesh": lambda file: partial(mesh_world, file),
}


def main(name: str, file: str) -> None:
    """Makes it, and runs it twice."""
    job = JOBS[name](file)
    times = []
    for _ in range(2):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    print(json.dumps(times))


if __name__ == "__main__":
    main(*sys.argv[1:])
