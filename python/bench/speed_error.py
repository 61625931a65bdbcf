"""Part `error`: what a simulated second costs at equal error, here and in MuJoCo.

Each engine is held against itself with a sixteenth of the scene's step, from the same starts under
the same wrenches. So neither pays for what the other calls a contact.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean, median

import mujoco
import numpy as np

import energymargin as em
from edges import Edge, Vector, edges_of, objects, positions
from measurements import Settings, Tell, digits, in_turns, problems_of
from mug import mugs
from mujoco_rollouts import MuJoCoEdges
from tables import markdown

__all__ = ["Errors", "measure_errors"]

STEPS = 48  # of a scene's, of each edge
OURS = (4.0, 2.0, 1.0, 0.5)  # of the scene's step
THEIRS = (2.0, 1.0, 0.5, 0.25, 0.125)
FINEST = 1 / 16
MUG = "mug"  # a Panda's hand that holds one
CAP = 0.01  # m: an edge that ends further off counts as so far
ITERATIONS = (100, 4)  # of MuJoCo's solver, at most
CONES = {
    "elliptic": int(mujoco.mjtCone.mjCONE_ELLIPTIC),
    "pyramidal": int(mujoco.mjtCone.mjCONE_PYRAMIDAL),
}


@dataclass(frozen=True)
class Way:
    """How an engine steps."""

    share: float
    """Its step, of the scene's."""
    iterations: int = 0
    """Of MuJoCo's solver; 0: it is ours."""
    cone: str = "elliptic"

    def name(self, step: float) -> str:
        """In tables, for a scene's step [s]."""
        words = f"1/{1 / (self.share * step):.0f} s"
        return f"{words}, {self.cone}, {self.iterations} iterations" if self.iterations else words


WAYS = tuple(Way(share) for share in OURS)
OTHERS = tuple(Way(*of) for of in itertools.product(THEIRS, ITERATIONS, CONES))


@dataclass
class Found:
    """Of one task and one way: by state."""

    errors: list[float] = field(default_factory=list)
    """Mean of the edges [m]."""
    seconds: list[float] = field(default_factory=list)
    """Of the CPU for a simulated second."""

    @property
    def error(self) -> float:
        """Mean of all [m]."""
        return fmean(self.errors)

    @property
    def cost(self) -> float:
        """Median [s/s]."""
        return median(self.seconds)


@dataclass
class Errors:
    """What there is so far."""

    settings: Settings
    found: dict[str, dict[Way, Found]] = field(default_factory=dict)
    """By task; a step that the problem cannot have is missing."""
    apart: dict[str, list[float]] = field(default_factory=dict)
    """How far the engines' finest ends are from each other [m], medians by state."""
    steps: dict[str, float] = field(default_factory=dict)
    """The scenes' [s]."""

    def tables(self) -> str:
        """In Markdown."""
        if not self.found:
            return ""
        head = (
            f"{self.settings.pushes} pushes of {STEPS} steps of each of {self.settings.states}"
            " states; of a hand with a mug where ENERGYMARGIN_GRASPS names grasps. An engine's"
            " error is how far the objects end from where it leaves them itself with a sixteenth"
            f" of the scene's step: the mean, where more than {1e3 * CAP:g} mm count as that."
            " MuJoCo is the cheapest of its steps, cones and numbers of iterations whose error is"
            " no larger; where none is, the one with the least error. *Apart* are the finest ends"
            " of both engines, the median. Times are of the CPU, a simulated second.\n"
        )
        header = ["task, our step", "error [mm]", "time [ms]", "MuJoCo", "its error", "its time"]
        return f"{head}\n{markdown([*header, 'ours / its', 'apart [mm]'], list(self._rows()))}"

    def _rows(self) -> Iterator[list[str]]:
        for task, found in self.found.items():
            step, apart = self.steps[task], f"{1e3 * median(self.apart[task]):.2f}"
            for way in (way for way in WAYS if way in found):
                ours = found[way]
                other = cheapest(found, ours.error)
                theirs = found[other]
                name = other.name(step)
                if theirs.error > ours.error:
                    name += " (none is as right)"
                cells = [f"{1e3 * ours.error:.3f}", digits(1e3 * ours.cost), name]
                cells += [f"{1e3 * theirs.error:.3f}", digits(1e3 * theirs.cost)]
                yield [f"{task}, {way.name(step)}", *cells, f"{ours.cost / theirs.cost:.2f}", apart]


def cheapest(found: dict[Way, Found], error: float) -> Way:
    """MuJoCo's way at most so wrong that takes the least time, or the one that is least wrong."""
    others = [way for way in OTHERS if way in found]
    good = [way for way in others if found[way].error <= error]
    if good:
        return min(good, key=lambda way: found[way].cost)
    return min(others, key=lambda way: found[way].error)


def measure_errors(errors: Errors, tell: Tell) -> None:
    """Fills it task by task."""
    count = errors.settings.states
    for task in (*errors.settings.tasks, MUG):
        tell(f"{task}: its states")
        problems = mugs(count) if task == MUG else problems_of(task, count)
        for number, problem in enumerate(problems, 1):
            tell(f"{task}: state {number} of {len(problems)}")
            measure_state(errors, task, problem)


def measure_state(errors: Errors, task: str, problem: em.Problem) -> None:
    """One state, all ways in turns."""
    errors.steps[task] = problem.scene.step
    tree = em.capture_score(problem, nodes=errors.settings.pushes + 1, warn=False).tree
    edges = [replace(edge, steps=STEPS) for edge in edges_of(problem, tree)]
    truths = [playing(problem, edges, way)() for way in (Way(FINEST), Way(FINEST, 100))]
    errors.apart.setdefault(task, []).append(float(np.median(furthest(*truths))))
    ways, plays = [], []
    for way in (*WAYS, *OTHERS):
        try:
            plays.append(playing(problem, edges, way))
        except ValueError:  # the horizon or a plan has no whole number of such steps
            continue
        ways.append(way)
    clocks = in_turns(plays, errors.settings.rounds)
    simulated = STEPS * problem.scene.step * len(edges)
    for way, play, seconds in zip(ways, plays, clocks, strict=True):
        found = errors.found.setdefault(task, {}).setdefault(way, Found())
        off = furthest(play(), truths[bool(way.iterations)])
        found.errors.append(float(np.fmin(off, CAP).mean()))
        found.seconds.append(median(seconds) / simulated)


def furthest(some: Vector, others: Vector) -> Vector:
    """Of each edge the largest distance of an object [m], shape (M,)."""
    return np.asarray(np.linalg.norm(some - others, axis=-1).max(axis=1))


def playing(problem: em.Problem, edges: Sequence[Edge], way: Way) -> Callable[[], Vector]:
    """What plays the edges one way: where the objects end, shape (M, k, 3)."""
    finer = problem.with_step(way.share * problem.scene.step)
    scaled = [replace(edge, steps=round(edge.steps / way.share)) for edge in edges]
    return theirs(finer, scaled, way) if way.iterations else ours(finer, scaled)


def ours(problem: em.Problem, edges: Sequence[Edge]) -> Callable[[], Vector]:
    """Each edge by one simulation."""
    world, names = em.World(problem.scene), objects(problem.scene)
    pushes = [
        {
            name: np.tile(wrench, (edge.steps, 1))
            for name, wrench in zip(names, edge.wrenches, strict=True)
        }
        for edge in edges
    ]

    def play() -> Vector:
        ends = [
            world.simulate(edge.start, edge.steps, drives=push, record=[edge.steps]).states[-1]
            for edge, push in zip(edges, pushes, strict=True)
        ]
        return positions(problem.scene, ends)

    return play


def theirs(problem: em.Problem, edges: Sequence[Edge], way: Way) -> Callable[[], Vector]:
    """Each edge by `mj_step`, all of its steps in one call."""
    twin = MuJoCoEdges(problem, edges)
    twin.model.opt.iterations = way.iterations
    twin.model.opt.cone = CONES[way.cone]
    return twin.step
