"""What statics say of bodies that touch at points, under Coulomb's law of friction.

Forces in friction cones that balance all weights are a linear programme, since each cone is
replaced by a pyramid of SIDES within it. Where there are none, the bodies move.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog

from energymargin.base.aliases import Floats
from energymargin_paper.evidence.contact_traces import GRAVITY

__all__ = ["SIDES", "Mass", "Pad", "Touch", "largest_weight", "required_friction"]

SIDES = 64  # of a pyramid: its forces are at most .12 % below those of the cone


class Mass(NamedTuple):
    """A body that can move."""

    mass: float
    """[kg]"""
    center: Floats
    """Centre of its mass [m], shape (3,)."""


class Touch(NamedTuple):
    """A point at which two bodies touch."""

    above: str
    """The body on which the force along the normal acts."""
    below: str
    """The other one; what is no body that can move is fixed."""
    position: Floats
    normal: Floats
    """Unit vector."""


class Pad(NamedTuple):
    """Points at which a finger presses at the object with a force in all."""

    points: Sequence[Floats]
    direction: Floats
    """In which it presses, a unit vector."""
    force: float
    """[N]"""


def required_friction(
    bodies: Mapping[str, Mass], touches: Sequence[Touch], tolerance: float = 1e-4
) -> float:
    """The least coefficient of friction with which the bodies can stay at rest; inf if none."""
    low, high = 0.0, 10.0
    if not _balances(bodies, touches, high):
        return float("inf")
    while high - low > tolerance:
        middle = (low + high) / 2
        if _balances(bodies, touches, middle):
            high = middle
        else:
            low = middle
    return high


def largest_weight(
    pads: Sequence[Pad],
    center: Floats,
    friction: float,
    *,
    load: Sequence[float] = (0, 0, -1),
    even: bool = False,
) -> float:
    """The largest load at an object's centre of mass that pads can bear [N].

    `even`: each point of a pad presses alike. Otherwise a pad, which is on a rail, presses where it
    helps most. A grip slips somewhere between the two.
    """
    forces = [_cone(pad.direction, friction) for pad in pads for _ in pad.points]
    points = np.array([point for pad in pads for point in pad.points])
    columns = np.hstack([_wrenches(f, p - center) for f, p in zip(forces, points, strict=True)])
    balance = np.column_stack([columns, np.array((*load, 0, 0, 0))])
    rows, sides = [balance], [np.zeros(6)]
    first = 0
    for pad in pads:
        count = len(pad.points)
        groups = np.split(np.arange(count), count if even else 1)
        for group in groups:
            row = np.zeros((1, balance.shape[1]))
            for point in group:
                row[0, (first + point) * SIDES : (first + point + 1) * SIDES] = 1.0
            rows.append(row)
            sides.append(np.array([pad.force / len(groups)]))
        first += count
    goal = np.zeros(balance.shape[1])
    goal[-1] = -1.0
    found = linprog(goal, A_eq=np.vstack(rows), b_eq=np.concatenate(sides))
    return float(-found.fun) if found.status == 0 else 0.0


def _balances(bodies: Mapping[str, Mass], touches: Sequence[Touch], friction: float) -> bool:
    names = list(bodies)
    matrix = np.zeros((6 * len(names), SIDES * len(touches)))
    for column, touch in enumerate(touches):
        forces = _cone(touch.normal, friction)
        for name, sign in ((touch.above, 1.0), (touch.below, -1.0)):
            if name in bodies:
                at = 6 * names.index(name)
                arm = touch.position - bodies[name].center
                block = matrix[at : at + 6, SIDES * column : SIDES * (column + 1)]
                block += sign * _wrenches(forces, arm)
    weights = np.concatenate([(0, 0, GRAVITY * body.mass, 0, 0, 0) for body in bodies.values()])
    found: Any = linprog(np.zeros(matrix.shape[1]), A_eq=matrix, b_eq=weights)
    return bool(found.status == 0)


def _cone(normal: Floats, friction: float) -> Floats:
    """The edges of a pyramid, each with a normal force of 1. Shape (3, SIDES)."""
    aside = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    aside /= np.linalg.norm(aside)
    turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
    across = np.outer(aside, np.cos(turns)) + np.outer(np.cross(normal, aside), np.sin(turns))
    edges: Floats = normal[:, None] + friction * across
    return edges


def _wrenches(forces: Floats, arm: Floats) -> Floats:
    """Forces and their torques, from an arm. Shape (6, SIDES)."""
    return np.vstack([forces, np.cross(arm, forces.T).T])
