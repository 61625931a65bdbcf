"""Part `error`: what a simulated second costs at equal error, here and in MuJoCo.

Each engine, and each law of contact of MuJoCo's, is held against itself with a thirty-second of the
scene's step, from the same starts under the same pushes. So neither pays for what the other calls a
contact, and MuJoCo's creep and softness do not count as errors.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean, median

import mujoco
import numpy as np

import energymargin as em
from edges import Edge, edges_of, objects, positions
from energymargin.base.aliases import Floats
from measurements import TASKS, Settings, Tell, digits, in_turns, problems_of
from mug import mugs
from mujoco_rollouts import MuJoCoEdges
from tables import markdown

__all__ = ["Errors", "Law", "Measured", "Setting", "cheapest", "furthest", "measure_errors"]

STEPS = 48  # of a scene's, of each push
OURS = (4.0, 2.0, 1.0, 0.5)  # shares of the scene's step
THEIRS = (2.0, 1.0, 0.5, 0.25, 0.125)
FINE, FINEST = 1 / 16, 1 / 32
CAP = 0.01  # m: what ends further off, or diverges, counts as so far
ITERATIONS = (100, 4)  # of MuJoCo's solver, at most
MUG = "mug"  # a Panda's hand that holds one
CONES = {
    "elliptic": int(mujoco.mjtCone.mjCONE_ELLIPTIC),
    "pyramidal": int(mujoco.mjtCone.mjCONE_PYRAMIDAL),
}


@dataclass(frozen=True)
class Law:
    """MuJoCo's contacts."""

    cone: str
    impratio: float
    soft: bool
    """Whether their time constant is two steps of the scene, in place of two of MuJoCo's own."""


LAWS = tuple(
    Law(cone, impratio, soft)
    for cone, impratio in (("elliptic", 1.0), ("elliptic", 100.0), ("pyramidal", 1.0))
    for soft in (True, False)
)


@dataclass(frozen=True)
class Setting:
    """How an engine steps."""

    share: float
    """Its step, of the scene's."""
    law: Law | None = None
    """None: the engine is ours."""
    iterations: int = 0

    def name(self, step: float) -> str:
        """In tables, for a scene's step [s]."""
        words = f"1/{1 / (self.share * step):.0f} s"
        if self.law is None:
            return words
        softness = "soft" if self.law.soft else "stiff"
        return f"{words}, {self.law.cone}, {self.law.impratio:g}, {softness}, {self.iterations}"


OUR_SETTINGS = tuple(Setting(share) for share in OURS)
THEIR_SETTINGS = tuple(Setting(*of) for of in itertools.product(THEIRS, LAWS, ITERATIONS))


@dataclass
class Measured:
    """Of one task and one setting: by state."""

    errors: list[float] = field(default_factory=list)
    """Means of the pushes [m]."""
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
    measured: dict[str, dict[Setting, Measured]] = field(default_factory=dict)
    """By task; a step that the problem cannot have is missing."""
    floors: dict[str, dict[Law | None, list[float]]] = field(default_factory=dict)
    """By task and law: how far apart the two finest steps end [m], means by state."""
    steps: dict[str, float] = field(default_factory=dict)
    """The scenes' [s]."""

    def tables(self) -> str:
        """In Markdown."""
        if not self.measured:
            return ""
        head = (
            f"{self.settings.pushes} pushes of {STEPS} steps of each state. An error is how far the"
            f" objects end from where the same engine, with the same law of contact, leaves them at"
            f" 1/{1 / FINEST:.0f} of the scene's step: the mean, where {1e3 * CAP:g} mm stand for"
            " more, and for a push that diverges. MuJoCo is the cheapest of its steps, cones,"
            " impratios, softnesses (time constants of two steps of the scene, or of its own) and"
            " numbers of iterations whose error is no larger; where none is, the one with the least"
            f" error. *Floor* is the error of 1/{1 / FINE:.0f} of the scene's step: nothing much"
            " below it is known. Times are of the CPU, a simulated second.\n"
        )
        header = ["task, our step", "error [mm]", "floor", "time [ms]"]
        header += ["MuJoCo: step, cone, impratio, contacts, iterations"]
        header += ["error [mm]", "floor", "time [ms]", "ours / MuJoCo"]
        return f"{head}\n{markdown(header, list(self._rows()))}"

    def _rows(self) -> Iterator[list[str]]:
        for task, measured in self.measured.items():
            step = self.steps[task]
            for setting in (each for each in OUR_SETTINGS if each in measured):
                ours = measured[setting]
                other = cheapest(measured, ours.error)
                theirs = measured[other]
                name = other.name(step) + (" (none is as right)" * (theirs.error > ours.error))
                label = f"{task} ({len(ours.errors)} states), {setting.name(step)}"
                ratio = f"{ours.cost / theirs.cost:.2f}"
                yield [label, *self._cells(task, setting), name, *self._cells(task, other), ratio]

    def _cells(self, task: str, setting: Setting) -> list[str]:
        measured, floor = self.measured[task][setting], fmean(self.floors[task][setting.law])
        lengths = [f"{1e3 * length:.3f}" for length in (measured.error, floor)]
        return [*lengths, digits(1e3 * measured.cost)]


def cheapest(measured: dict[Setting, Measured], error: float) -> Setting:
    """MuJoCo's setting at most so wrong [m] that takes the least time, or the least wrong one."""
    others = [setting for setting in THEIR_SETTINGS if setting in measured]
    right = [setting for setting in others if measured[setting].error <= error]
    if right:
        return min(right, key=lambda setting: measured[setting].cost)
    return min(others, key=lambda setting: measured[setting].error)


def furthest(some: Floats, others: Floats) -> Floats:
    """Of each push the largest distance of an object, CAP at most [m], shape (M,)."""
    distances = np.linalg.norm(some - others, axis=-1)
    return np.asarray(np.fmin(distances, CAP).max(axis=1))


def measure_errors(errors: Errors, tell: Tell) -> None:
    """Fills it task by task, and of a choice of tasks those alone."""
    count, tasks = errors.settings.states, errors.settings.tasks
    for task in (*tasks, MUG) if tasks == TASKS else tasks:
        tell(f"{task}: its states")
        problems = mugs(count) if task == MUG else problems_of(task, count)
        for number, problem in enumerate(problems, 1):
            tell(f"{task}: state {number} of {len(problems)}")
            measure_state(errors, task, problem)


def measure_state(errors: Errors, task: str, problem: em.Problem) -> None:
    """One state, all settings in turns."""
    errors.steps[task] = problem.scene.step
    tree = em.capture_score(problem, nodes=errors.settings.pushes + 1, warn=False).tree
    edges = [replace(edge, steps=STEPS) for edge in edges_of(problem, tree)]
    truths = {}
    for law in (None, *LAWS):
        fine, finest = (
            player(problem, edges, Setting(share, law, ITERATIONS[0]))() for share in (FINE, FINEST)
        )
        truths[law] = finest
        floors = errors.floors.setdefault(task, {}).setdefault(law, [])
        floors.append(float(furthest(fine, finest).mean()))
    settings = [s for s in (*OUR_SETTINGS, *THEIR_SETTINGS) if fits(problem, s.share)]
    plays = [player(problem, edges, setting) for setting in settings]
    clocks = in_turns(plays, errors.settings.rounds)
    simulated = STEPS * problem.scene.step * len(edges)
    for setting, play, seconds in zip(settings, plays, clocks, strict=True):
        measured = errors.measured.setdefault(task, {}).setdefault(setting, Measured())
        measured.errors.append(float(furthest(play(), truths[setting.law]).mean()))
        measured.seconds.append(median(seconds) / simulated)


def fits(problem: em.Problem, share: float) -> bool:
    """Whether a problem's times are whole steps of this share of its own."""
    try:
        problem.with_step(share * problem.scene.step)
    except ValueError:
        return False
    return True


def player(problem: em.Problem, edges: Sequence[Edge], setting: Setting) -> Callable[[], Floats]:
    """What plays the pushes: where the objects end [m], shape (M, k, 3)."""
    finer = problem.with_step(setting.share * problem.scene.step)
    scaled = [replace(edge, steps=round(edge.steps / setting.share)) for edge in edges]
    if setting.law is None:
        return our_player(finer, scaled)
    twin, law = MuJoCoEdges(finer, scaled), setting.law
    twin.model.opt.iterations = setting.iterations
    twin.model.opt.cone, twin.model.opt.impratio = CONES[law.cone], law.impratio
    if law.soft:
        twin.model.pair_solref[:, 0] = 2 * problem.scene.step
    return twin.step


def our_player(problem: em.Problem, edges: Sequence[Edge]) -> Callable[[], Floats]:
    """Each push by one simulation."""
    world, names = em.World(problem.scene), objects(problem.scene)
    pushes = [
        {
            name: np.tile(wrench, (edge.steps, 1))
            for name, wrench in zip(names, edge.wrenches, strict=True)
        }
        for edge in edges
    ]

    def play() -> Floats:
        ends = [
            world.simulate(edge.start, edge.steps, drives=push, record=[edge.steps]).states[-1]
            for edge, push in zip(edges, pushes, strict=True)
        ]
        return positions(problem.scene, ends)

    return play
