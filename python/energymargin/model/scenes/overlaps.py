"""Bodies that overlap by an error of measurement are moved out of one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from energymargin._core import Contact, Scene, World
from energymargin.base.aliases import Floats

TOUCHING = 1e-3  # what is left of an overlap, as a share of the deepest one
ROUNDS = 100


def moved_apart(
    world: World,
    state: ArrayLike,
    bodies: Sequence[str],
    *,
    directions: Sequence[float] = (1.0, 1.0, 0.0),
) -> Floats:
    """The state, shape (n,), with each of `bodies` moved until it only touches what it overlapped.

    Each moves along the normal of its deepest contact, by that contact's depth, again and again;
    where two of them overlap, the one that is named last. Velocities and orientations stay.
    `directions`: the axes x, y and z that may change are 1, the others 0. An overlap that no such
    motion ends, as that of a body with the ground, stays. Raises ValueError on a body that is
    unknown, a link, fixed or tied by a loop, and on one that finds no place, as between two others.
    """
    free = np.asarray(directions, dtype=float)
    if free.shape != (3,) or not np.isin(free, (0.0, 1.0)).all():
        raise ValueError(f"directions is {list(directions)}, expected three numbers, 0 or 1")
    starts = {body: world.scene.slice(body).start for body in bodies}
    for body in bodies:
        require_untied(world.scene, "bodies", body)
    moved = np.array(state, dtype=float)
    deepest = 0.0
    for _ in range(ROUNDS):
        ways = [way for each in world.contacts(moved) if (way := _way_out(each, bodies, free))]
        if not ways:
            return moved
        body, shift = max(ways, key=lambda way: float(np.linalg.norm(way[1])))
        depth = float(np.linalg.norm(shift))
        deepest = max(deepest, depth)
        if depth <= TOUCHING * deepest:
            return moved
        moved[starts[body] : starts[body] + 3] += shift
    raise ValueError(
        f"state is one in which {body!r} overlaps others by {depth:.3g} m, wherever it is moved to"
    )


def require_untied(scene: Scene, name: str, body: str) -> None:
    """Raises ValueError on a body that a loop ties: elsewhere alone it opens the loop."""
    if any(body in (loop.body_a, loop.body_b) for loop in scene.loops):
        wrong = f"{name} names the body {body!r}, which a loop ties to another one"
        raise ValueError(f"{wrong}, expected one that can be elsewhere alone")


def _way_out(contact: Contact, bodies: Sequence[str], free: Floats) -> tuple[str, Floats] | None:
    """The body that a contact moves, and its way (3,) [m] along the normal."""
    involved = [body for body in bodies if body in (contact.body_a, contact.body_b)]
    normal = free * contact.normal
    length = float(np.linalg.norm(normal))
    if contact.distance >= 0 or not involved or length < 0.5:
        return None
    sign = 1.0 if involved[-1] == contact.body_a else -1.0
    return involved[-1], -contact.distance * sign * normal / length**2
