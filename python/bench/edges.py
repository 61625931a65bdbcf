"""The edges of a tree, which every engine replays, and what a body is to an engine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

import energymargin as em
from energymargin.base.aliases import Floats

__all__ = ["Edge", "Inertia", "axes", "edges_of", "inertia", "objects", "positions"]


@dataclass(frozen=True)
class Edge:
    """An edge of a tree."""

    start: Floats
    wrenches: Floats
    """On each object, (k, 6) [N, N m]."""
    steps: int


@dataclass(frozen=True)
class Inertia:
    """Inertia of a body, in its frame."""

    center: Floats
    """Centre of mass [m]."""
    moments: Floats
    """Principal ones about the centre [kg m^2]."""
    axes: Floats
    """Quaternion x, y, z, w that turns the principal axes into the body's frame."""


def edges_of(problem: em.Problem, tree: em.Tree) -> list[Edge]:
    """What made each node but the root."""
    steps = np.rint(tree.durations / problem.scene.step).astype(int)
    return [
        Edge(
            problem.edge_start(tree.states[tree.parents[node]]),
            tree.controls[node].reshape(-1, 6),
            int(steps[node]),
        )
        for node in range(1, len(tree))
    ]


def objects(scene: em.Scene) -> list[str]:
    """The names of those that wrenches act on."""
    return [body.name for body in scene.bodies if body.role == "object"]


def positions(scene: em.Scene, states: Iterable[Floats]) -> Floats:
    """Positions of the objects in some states [m], shape (M, k, 3)."""
    starts = [scene.slice(name).start for name in objects(scene)]
    return np.array([[state[at : at + 3] for at in starts] for state in states])


def axes(factor: Floats) -> tuple[int, ...]:
    """Those that are free."""
    return tuple(axis for axis in range(3) if factor[axis] > 0.0)


def inertia(body: em.Body) -> Inertia:
    """Its own, or that of its shape."""
    of = body.inertial or em.mass_properties(body.shape, body.mass)
    return Inertia(*(np.array(value) for value in (of.center, of.moments, of.axes)))
