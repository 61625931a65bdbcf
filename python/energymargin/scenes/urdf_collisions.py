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
    never = {frozenset(pair): pair for pair in disabled}
    groups = _lumps(robot) if self_collision else [list(robot.links)]
    for group in groups:
        never.update((frozenset(pair), pair) for pair in combinations(group, 2))
    return [(prefix + a, prefix + b) for links, (a, b) in never.items() if links not in jointed]


def _lumps(robot: Robot) -> list[list[str]]:
    """The links in groups that fixed joints hold together."""
    up = {j.child: j.parent for j in robot.joints.values() if j.type == "fixed"}
    tops: dict[str, str] = {}
    for name in robot.links:
        way = [name]
        while way[-1] in up and way[-1] not in tops:
            way.append(up[way[-1]])
        top = tops.get(way[-1], way[-1])
        tops.update(dict.fromkeys(way, top))
    lumps: dict[str, list[str]] = {}
    for name in robot.links:
        lumps.setdefault(tops[name], []).append(name)
    return list(lumps.values())


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
