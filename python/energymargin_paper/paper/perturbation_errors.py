"""Errors of a model, put into recorded pushes: what a score gets instead of the truth.

The labels stay those of the true states. A draw has the same directions at every level: only how
large its errors are grows with the level, as long as no state needs another draw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact, Scene, World
from energymargin.datasets import Dataset
from energymargin.scenes import moved_apart
from energymargin.tasks.push import FRICTION_MIDDLE, scene
from energymargin.tasks.trajectories import Trajectory

__all__ = ["KINDS", "LARGEST", "Largest", "Perturbed", "perturbed", "typical"]

BODIES = ("object", "effector")
# Where a body's numbers stand in its part of a state.
PLACE, VELOCITY, YAW_RATE = [0, 1], [7, 8], [12]
OVERLAP = 1e-3  # m, that bodies may have after they were moved apart
TRIES = 1000  # draws for one state, until it finds a place


@dataclass(frozen=True)
class Largest:
    """The largest error of one quantity, where the scaled error is 1."""

    quantity: str
    value: float
    unit: str
    measure: str
    """Whose mean, or for a force median, over the recorded states it is about the whole of."""
    reason: str


# Each is about the whole of the mean of what it is an error of, and of the median where a few blows
# make most of the mean: beyond that, an estimate is worth no more than no estimate. A position is
# compared with the gap, not with the distance of the centres, 0.7 m: with such errors the pusher
# may be anywhere in the workspace.
LARGEST: dict[str, tuple[Largest, ...]] = {
    "friction": (
        Largest(
            quantity="friction coefficient of all bodies",
            value=0.3,
            unit="",
            measure="coefficient",
            reason="up to twice the true friction: a surface of another material",
        ),
    ),
    "velocity": (
        Largest(
            quantity="velocity of each body on x and on y",
            value=0.5,
            unit="m/s",
            measure="speed",
            reason="as large as the motion itself: its direction is lost",
        ),
        Largest(
            quantity="yaw rate of each body",
            value=0.32,
            unit="rad/s",
            measure="absolute yaw rate",
            reason="likewise; the turn of the pusher bends the capture set",
        ),
    ),
    "position": (
        Largest(
            quantity="position of each body on x and on y",
            value=0.2,
            unit="m",
            measure="gap between pusher and box",
            reason="as large as the gap: contact and none look alike",
        ),
    ),
    "force": (
        Largest(
            quantity="normal force, and each of two tangential ones, at each contact",
            value=1.6,
            unit="N",
            measure="median of the sum of normal forces between pusher and box",
            reason="as large as the force: a loaded contact and a free one look alike",
        ),
    ),
}
KINDS = tuple(LARGEST)


@dataclass(frozen=True)
class Perturbed:
    """A dataset with errors."""

    dataset: Dataset
    again: int
    """How often a state had to be drawn again, because its bodies found no place."""


def perturbed(dataset: Dataset, kind: str, scaled: float, seed: int) -> Perturbed:
    """The dataset with errors of a kind, up to `scaled` (0..1) of the largest; 0 changes nothing.

    Friction: uniform from 0 up, one draw a trajectory, as in the paper. All others: uniform to both
    sides, anew in each state. Bodies that come to overlap are moved apart, the box out of the
    wall and the pusher out of both; a state where that cannot be is drawn again.
    """
    if scaled == 0:
        return Perturbed(dataset, 0)
    changed, again = [], 0
    for number, trajectory in enumerate(dataset.trajectories):
        randoms = [
            np.random.default_rng([seed, KINDS.index(kind), number, frame])
            for frame in range(len(trajectory))
        ]
        errors = [scaled * largest.value for largest in LARGEST[kind]]
        one, more = _CHANGES[kind](trajectory, errors, randoms)
        changed.append(one)
        again += more
    return Perturbed(replace(dataset, trajectories=changed), again)


def typical(dataset: Dataset) -> dict[str, tuple[float, ...]]:
    """What each of LARGEST is compared with, over the states: a mean, of forces a median."""
    trajectories = dataset.trajectories
    world = World(scene(FRICTION_MIDDLE))
    states = np.concatenate([trajectory.states for trajectory in trajectories])
    layout = world.scene
    speeds = [np.linalg.norm(states[:, _at(layout, b, VELOCITY)], axis=1) for b in BODIES]
    turns = [np.abs(states[:, _at(layout, b, YAW_RATE)]) for b in BODIES]
    pressing = [
        [c.normal_force for c in contacts if {c.body_a, c.body_b} == set(BODIES)]
        for trajectory in trajectories
        for contacts in trajectory.contacts
    ]
    return {
        "friction": (float(np.mean([t.params["friction"] for t in trajectories])),),
        "velocity": (float(np.mean(speeds)), float(np.mean(turns))),
        "position": (float(np.mean([world.distance(state, *BODIES) for state in states])),),
        "force": (float(np.median([sum(forces) for forces in pressing if forces])),),
    }


Randoms = list[np.random.Generator]
Change = Callable[[Trajectory, list[float], Randoms], tuple[Trajectory, int]]
"""Called with a trajectory, the largest errors and a generator for each state; returns the changed
trajectory, and how many draws were made again."""


def _friction(
    trajectory: Trajectory, errors: list[float], randoms: Randoms
) -> tuple[Trajectory, int]:
    friction = trajectory.params["friction"] + randoms[0].uniform(0, errors[0])
    return replace(trajectory, params={**trajectory.params, "friction": friction}), 0


def _velocity(
    trajectory: Trajectory, errors: list[float], randoms: Randoms
) -> tuple[Trajectory, int]:
    layout = scene(FRICTION_MIDDLE)
    states = trajectory.states.copy()
    for state, random in zip(states, randoms, strict=True):
        for body in BODIES:
            for places, error in zip((VELOCITY, YAW_RATE), errors, strict=True):
                state[_at(layout, body, places)] += _both_sides(random, error, len(places))
    return replace(trajectory, states=states), 0


def _position(
    trajectory: Trajectory, errors: list[float], randoms: Randoms
) -> tuple[Trajectory, int]:
    world = World(scene(FRICTION_MIDDLE))
    found = [
        _placed(world, state, errors[0], random)
        for state, random in zip(trajectory.states, randoms, strict=True)
    ]
    states = np.array([state for state, _ in found])
    return replace(trajectory, states=states), sum(again for _, again in found)


def _placed(
    world: World, state: NDArray[np.float64], error: float, random: np.random.Generator
) -> tuple[NDArray[np.float64], int]:
    """A state with other positions, in which nothing overlaps, and how many draws had no place."""
    for again in range(TRIES):
        moved = state.copy()
        for body in BODIES:
            moved[_at(world.scene, body, PLACE)] += _both_sides(random, error, len(PLACE))
        try:
            moved = moved_apart(world, moved, BODIES)
        except ValueError:  # no place, as between pusher and wall
            continue
        if all(contact.distance > -OVERLAP for contact in world.contacts(moved)):
            return moved, again
    raise ValueError(f"a state has no place with position errors of {error:g} m, expected smaller")


def _force(trajectory: Trajectory, errors: list[float], randoms: Randoms) -> tuple[Trajectory, int]:
    contacts = [
        [_pressed(contact, errors[0], random) for contact in of_state]
        for of_state, random in zip(trajectory.contacts, randoms, strict=True)
    ]
    return replace(trajectory, contacts=contacts), 0


def _pressed(contact: Contact, error: float, random: np.random.Generator) -> Contact:
    """A contact with other forces; a normal force never pulls."""
    normal = np.asarray(contact.normal)
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    along, right, left = _both_sides(random, error, 3)
    return Contact(
        body_a=contact.body_a,
        body_b=contact.body_b,
        position=contact.position,
        normal=normal,
        distance=contact.distance,
        normal_force=max(0.0, contact.normal_force + along),
        tangential_force=contact.tangential_force + right * first + left * np.cross(normal, first),
        friction=contact.friction,
    )


_CHANGES: dict[str, Change] = {
    "friction": _friction,
    "velocity": _velocity,
    "position": _position,
    "force": _force,
}


def _both_sides(random: np.random.Generator, error: float, count: int) -> NDArray[np.float64]:
    """So many errors."""
    return np.asarray(error * random.uniform(-1, 1, count))


def _at(layout: Scene, body: str, places: list[int]) -> list[int]:
    """Where some of a body's numbers stand in a state."""
    return [layout.slice(body).start + place for place in places]
