"""A belief: one question about a model that is known with an error, and particles of it.

A particle is a problem like any other, with one draw of what is not known. The draws are quasi-
random (a scrambled Sobol sequence), so that few of them cover the belief evenly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, takewhile
from typing import Any, NamedTuple

import numpy as np

from energymargin._core import Problem, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, seed_number, whole_number
from energymargin.base.plausibility import kept_warnings
from energymargin.base.reprs import Record
from energymargin.model.beliefs.uncertainty import ERRORS, VALUES, Source, Uncertainty
from energymargin.model.engines import Engine, with_varied
from energymargin.model.scenes import moved_apart
from energymargin.model.scenes.corners import shape_parts

# An overlap that may be left, as a share of the smallest half extent of what was moved; Problems
# refuse a quarter.
LEFT = 0.01
TRIES = 100  # draws for each particle
FOR_MEAN = 1024  # points
BLOCK = 1024  # points that are made at a time, a power of 2
HALF_STEP = 2.0**-31  # of the Sobol points, whose least is 0
OPEN = (HALF_STEP, 1 - HALF_STEP)  # the ends of the unit interval: no quantile is infinite

Question = Callable[[Floats], Problem]


class Drawn(NamedTuple):
    """One draw of a belief."""

    problem: Problem
    moved: bool
    """Whether its bodies were moved apart."""
    point: Floats
    """Where it was drawn in the unit cube, shape (D,)."""


@dataclass(frozen=True, eq=False, repr=False)
class Particles(Record):
    """N draws of a belief."""

    problems: list[Problem]
    """Each with one draw."""
    points: Floats
    """Where each was drawn in the unit cube, shape (N, D)."""
    sources: list[Source]
    """What was drawn; their inputs are the D columns of `points`."""
    separated: int
    """Particles whose bodies overlapped, and were moved apart."""
    redrawn: int
    """Draws that could not be, and for which another was taken: bodies that found no place, a
    friction or mass below 0."""

    @staticmethod
    def of(draws: Sequence[Drawn | None], sources: list[Source]) -> Particles:
        """Those of some draws, of which one at least can be."""
        problems, moved, points = zip(*filter(None, draws), strict=True)
        redrawn = len(draws) - len(problems)
        return Particles(list(problems), np.array(points), sources, sum(moved), redrawn)

    def __len__(self) -> int:
        """N."""
        return len(self.problems)

    def first(self, count: int) -> Particles:
        """So many of them; `separated` and `redrawn` stay those of all."""
        return replace(self, problems=self.problems[:count], points=self.points[:count])

    def values(self, source: Source) -> Floats:
        """What was drawn of a source: friction or mass, (N, 1); errors of a pose or velocity, (N,
        6), before bodies were moved apart."""
        before = list(takewhile(lambda one: one is not source, self.sources))
        if len(before) == len(self.sources):
            raise ValueError(f"source is {source.name!r}, expected one of these particles'")
        first = sum(len(one.inputs) for one in before)
        return source.values(self.points[:, first : first + len(source.inputs)])


class Belief:
    """A problem whose numbers are known with an error: a distribution over problems.

    Args:
        problem: the question, with the numbers that are believed most.
        friction, mass, pose, velocity, torsional_friction, rolling_friction: how well they are
            known, as of `em.beliefs.Uncertainty`.
        uncertainty: all these in one, in their place.
        question: poses the question about a particle's state, shape (n,), where more depends on the
            state than the start, as a capture set that moves with the robot:
            `lambda state: task.problem(state, params)`. By default `problem.with_state`.

    Raises ValueError on what cannot be and on bodies that the scene does not have.
    """

    sources: list[Source]
    """What is not known for sure; a standard deviation of 0 is."""

    def __init__(
        self,
        problem: Problem,
        *,
        friction: Any = None,
        mass: Any = None,
        pose: Any = None,
        velocity: Any = None,
        torsional_friction: Any = None,
        rolling_friction: Any = None,
        uncertainty: Uncertainty | None = None,
        question: Question | None = None,
    ) -> None:
        """As the class."""
        check_type("problem", problem, Problem, "a Problem")
        own = {"friction": friction, "mass": mass, "pose": pose, "velocity": velocity}
        own |= {"torsional_friction": torsional_friction, "rolling_friction": rolling_friction}
        given = [name for name, value in own.items() if value is not None]
        if uncertainty is None:
            uncertainty = Uncertainty(**own)
        elif given:
            raise ValueError(f"uncertainty and {given[0]} are given, expected one of them")
        self.problem = problem
        self.uncertainty = uncertainty
        self._question: Question = problem.with_state if question is None else question
        self.sources = uncertainty.sources(problem.scene)

    def __repr__(self) -> str:
        """What is not known."""
        return f"Belief({', '.join(source.name for source in self.sources) or 'known exactly'})"

    def particles(self, count: int, *, seed: int = 0) -> Particles:
        """So many draws. The first of them are those of a smaller count with the same seed.

        Raises ValueError if hardly any draw can be, as where every pose overlaps the scene.
        """
        return Particles.of(list(self.draws(count, seed=seed)), self.sources)

    def draws(self, count: int, *, seed: int = 0) -> Iterator[Drawn | None]:
        """The draws of `particles`, one after the other; None of one that cannot be."""
        count = whole_number("count", count, 1)
        points, made, redrawn = _points(self.dimension, count, seed), 0, 0
        while made < count:
            point = next(points)
            found = self.particle(point)
            made, redrawn = made + (found is not None), redrawn + (found is None)
            if redrawn >= TRIES * count:
                raise ValueError(
                    f"{redrawn} of {redrawn + made} draws of the belief have no place or a "
                    "friction or mass below 0, expected smaller errors"
                )
            yield None if found is None else Drawn(*found, point)

    @property
    def dimension(self) -> int:
        """D, the independent numbers behind a draw."""
        return sum(len(source.inputs) for source in self.sources)

    def particle(self, point: Floats) -> tuple[Problem, bool] | None:
        """The problem at a point of the open unit cube, shape (D,), and whether its bodies were
        moved apart; None if the draw cannot be."""
        return self._made([values[0] for values in self._values(point[None])])

    @property
    def estimate(self) -> Problem:
        """One problem in place of the belief, with the mean of what is not known: what a filter
        would say.

        Raises ValueError if its bodies find no place.
        """
        points = np.array(list(islice(_points(self.dimension, FOR_MEAN, 0), FOR_MEAN)))
        means = [values.mean(axis=0) for values in self._values(points)]
        found = self._made(means)
        if found is None:
            raise ValueError("the mean of the belief has no place, expected smaller errors")
        return found[0]

    def _values(self, points: Floats) -> list[Floats]:
        """Values of each source at points of the unit cube, shape (N, D)."""
        ends = np.cumsum([len(source.inputs) for source in self.sources])
        columns = np.split(points, ends[:-1], axis=1) if self.sources else []
        return [source.values(own) for source, own in zip(self.sources, columns, strict=True)]

    @cached_property
    def _place(self) -> _Place:
        return _Place(self.problem, self.sources)

    def _made(self, draws: list[Floats]) -> tuple[Problem, bool] | None:
        """The problem with a draw of each source, as `particle`."""
        state = np.array(self.problem.state)
        changes: list[tuple[Source, float]] = []
        for source, values in zip(self.sources, draws, strict=True):
            if source.quantity in ERRORS:
                _add_error(state[self.problem.scene.slice(source.body)], source.quantity, values)
            elif _cannot_be(source, float(values[0])):
                return None
            else:
                changes.append((source, float(values[0])))
        found = self._place.of(state)
        if found is None:
            return None
        return _with_changes(self._question(found[0]), changes), found[1]


def _points(dimension: int, count: int, seed: int) -> Iterator[Floats]:
    """Points of a scrambled Sobol sequence in the open unit cube, each (D,), without end."""
    seed = seed_number(seed)
    if dimension == 0:
        while True:
            yield np.zeros(0)
    from scipy.stats import qmc

    engine = qmc.Sobol(dimension, scramble=True, seed=np.random.default_rng(seed))
    size = min(2 ** math.ceil(math.log2(count)), BLOCK)
    while True:
        yield from np.clip(engine.random(size), *OPEN)


class _Place:
    """Where bodies with errors of their pose can be: nothing overlaps more than at the start."""

    def __init__(self, problem: Problem, sources: Sequence[Source]) -> None:
        scene = problem.scene
        if isinstance(scene.engine, Engine):  # which does not tell what touches
            scene = scene.with_engine("native")
        self._world = World(scene)
        poses = [source for source in sources if source.quantity == "pose"]
        self._bodies = [source.body for source in poses]
        # Bodies are separated along the axes on which their place is not known.
        errors = [source.values(np.full((1, len(source.inputs)), 0.9))[0, :3] for source in poses]
        along = np.any(errors, axis=0) if poses else np.zeros(3, bool)
        self._directions = along.astype(float) if along.any() else np.ones(3)
        self._most = 0.0
        if poses:
            shapes = [body.shape for body in problem.scene.bodies if body.name in self._bodies]
            corners = [part for shape in shapes for part in shape_parts(shape)]
            smallest = min(float(np.ptp(part, axis=0).min()) / 2 for part in corners)
            self._most = max(self._overlap(problem.state), LEFT * smallest)

    def of(self, state: Floats) -> tuple[Floats, bool] | None:
        """The state, or another in which its bodies are apart, and whether it is another; None if
        they find no place."""
        if not self._bodies or self._overlap(state) <= self._most:
            return state, False
        try:
            axes = self._directions.tolist()
            moved = moved_apart(self._world, state, self._bodies, directions=axes)
        except ValueError:  # no place, as between two others
            return None
        return (moved, True) if self._overlap(moved) <= self._most else None

    def _overlap(self, state: Floats) -> float:
        """The deepest that one of the bodies has [m]."""
        own = set(self._bodies)
        contacts = self._world.contacts(state)
        return max([0.0, *(-c.distance for c in contacts if own & {c.body_a, c.body_b})])


def _add_error(body: Floats, quantity: str, error: Floats) -> None:
    """To a body's part of a state, which is changed."""
    if quantity == "velocity":
        body[7:13] += error
        return
    body[:3] += error[:3]
    if error[3:].any():
        from scipy.spatial.transform import Rotation

        turned = Rotation.from_rotvec(error[3:]) * Rotation.from_quat(body[3:7])
        body[3:7] = turned.as_quat()


def _cannot_be(source: Source, value: float) -> bool:
    """Whether it is a friction below 0, or a mass of at most that."""
    kind = source.body.partition(".")[0] if source.quantity == "engine" else source.quantity
    return (kind in VALUES and value < 0) or (kind == "mass" and value == 0)


def _with_changes(problem: Problem, changes: list[tuple[Source, float]]) -> Problem:
    """With the friction and mass that were drawn of each source."""
    if not changes:
        return problem
    if isinstance(problem.scene.engine, Engine):
        with kept_warnings():
            return with_varied(problem, {source.body: value for source, value in changes})
    scene = problem.scene
    for source, value in changes:
        if source.other is None:
            scene = scene.with_body(source.body, **{source.quantity: value})
        else:
            scene = scene.with_body(source.body)  # a copy
            scene.set_friction(source.body, source.other, value)
    with kept_warnings():  # what is odd in the problem was told when that was made
        changed: Problem = problem.replace(scene=scene, contacts=None)
    return changed


AT_FIRST = 10  # particles whose tries are granted before the first one is there


class CommonParticle(NamedTuple):
    """One draw of what is not known."""

    number: int
    """Number of the draw; those that cannot be count too."""
    problems: tuple[Problem, ...]
    """With it, one of each belief."""


def common_particles(beliefs: Sequence[Belief], seed: int) -> Iterator[CommonParticle | None]:
    """Particles of beliefs in which the same is uncertain, without end; None of a draw that cannot
    be.

    Raises ValueError on beliefs in which something else is uncertain, and if hardly any draw can be
    for all of them.
    """
    first, *others = (_said(belief.sources) for belief in beliefs)
    for number, other in enumerate(others, 1):
        if other != first:
            wrong = f"uncertainty is of {first} in problem number 0, of {other} in number {number}"
            raise ValueError(f"{wrong}, expected the same bodies in the same order")
    random, refused = np.random.default_rng(seed), np.zeros(len(beliefs), dtype=int)
    number = made = 0
    while number - made < TRIES * (made + AT_FIRST):
        point = np.clip(random.random(beliefs[0].dimension), *OPEN)
        found = [belief.particle(point) for belief in beliefs]
        there = tuple(one[0] for one in found if one is not None)
        made += len(there) == len(found)
        yield CommonParticle(number, there) if len(there) == len(found) else None
        refused += [one is None for one in found]
        number += 1
    raise ValueError(
        f"{refused.max()} of {number} draws of the uncertainty have no place or a friction or mass "
        f"below 0 in problem number {refused.argmax()}, expected smaller errors"
    )


def numbered_particle(belief: Belief, seed: int, number: int) -> Problem:
    """Particle `number` of a belief, the same whatever others there are. Raises ValueError if
    hardly any draw can be."""
    random = np.random.default_rng([seed, number])
    points = (np.clip(random.random(belief.dimension), *OPEN) for _ in range(TRIES))
    found = next(filter(None, map(belief.particle, points)), None)
    if found is None:
        wrong = f"{TRIES} draws of the uncertainty have no place or a friction or mass below 0"
        raise ValueError(f"{wrong}, expected smaller errors")
    return found[0]


def _said(sources: Sequence[Source]) -> str:
    return ", ".join(f"{one.name} ({', '.join(one.inputs)})" for one in sources) or "nothing"
