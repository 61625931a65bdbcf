"""Which links of a robot collide with each other."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from energymargin._core import Scene, World
from energymargin.scenes.urdf_model import Robot

__all__ = ["apart", "require_no_overlap"]

OVERLAP = 1e-4  # m; links that overlap by less are pushed apart without harm

Pair = tuple[str, str]


def apart(
    robot: Robot, disabled: Iterable[Pair], prefix: str, *, self_collision: bool
) -> list[Pair]:
    """Pairs of bodies that never collide, besides those that a joint connects.

    Links that fixed joints hold together cannot collide.
    """
    jointed = {frozenset((joint.parent, joint.child)) for joint in robot.joints.values()}
    lumps = _lumps(robot)
    never = {frozenset(pair) for pair in disabled}
    return [
        (prefix + a, prefix + b)
        for a, b in combinations(robot.links, 2)
        if frozenset((a, b)) not in jointed
        and (not self_collision or lumps[a] == lumps[b] or frozenset((a, b)) in never)
    ]


def _lumps(robot: Robot) -> dict[str, str]:
    """For each link one of those that fixed joints hold together with it, the same for all."""
    up = {j.child: j.parent for j in robot.joints.values() if j.type == "fixed"}
    lumps = {}
    for name in robot.links:
        top = name
        while top in up:
            top = up[top]
        lumps[name] = top
    return lumps


def require_no_overlap(robot: Scene, prefix: str) -> None:
    """Raises ValueError that lists the links which overlap at the start."""
    if not robot.joints:
        return
    depths: dict[Pair, float] = {}
    for contact in World(robot).contacts(robot.pack()):
        pair = (contact.body_a.removeprefix(prefix), contact.body_b.removeprefix(prefix))
        depths[pair] = max(depths.get(pair, 0.0), -contact.distance)
    deep = {pair: depth for pair, depth in sorted(depths.items()) if depth > OVERLAP}
    if deep:
        found = ", ".join(f"{a!r} and {b!r} by {1e3 * d:.3g} mm" for (a, b), d in deep.items())
        raise ValueError(
            f"links overlap at the start: {found}; another start, "
            f"disable_collisions={list(deep)}, or self_collision=False avoids that"
        )
