"""One question in several engines: the same draws, and where their ends differ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, CaptureProbability, Problem, World
from energymargin.base.aliases import Floats
from energymargin.base.bars import Update
from energymargin.base.checks import shown
from energymargin.base.reprs import Record
from energymargin.base.summary import Summarized
from energymargin.disturbances import Disturbance
from energymargin.evaluate.scores import capture_probability
from energymargin.model.engines import Engine


@dataclass(frozen=True, eq=False, repr=False)
class EngineComparison(Record, Summarized):
    """What engines make of one question. Everything is beside the first engine."""

    engines: tuple[str, ...]
    """Names, E of them."""
    probabilities: tuple[CaptureProbability, ...]
    """Of each engine."""
    exit_times: Floats
    """When each draw is lost in each engine [s], shape (E, n); inf: it is not, nan: it diverged."""
    times: Floats
    """Times of the undisturbed futures, shape (T,) [s]."""
    distances: Floats
    """How far the objects are in each engine from where the first one has them in the undisturbed
    future, the most of them [m], shape (E, T)."""

    def differing(self, engine: int = 1) -> NDArray[np.intp]:
        """Numbers of the draws that one engine loses and the first does not, or the reverse."""
        first, other = self.exit_times[0], self.exit_times[engine]
        return np.flatnonzero(self._counting[engine] & (np.isinf(first) != np.isinf(other)))

    @property
    def agreement(self) -> Floats:
        """Share of the draws that end as in the first engine, of those that diverge in neither,
        shape (E,)."""
        counts = np.maximum(1, self._counting.sum(1)).tolist()
        return np.array([1 - self.differing(i).size / count for i, count in enumerate(counts)])

    @property
    def _counting(self) -> NDArray[np.bool_]:
        """Which draws diverge neither in an engine nor in the first, shape (E, n)."""
        return np.asarray(~np.isnan(self.exit_times[0] + self.exit_times))

    __str__ = Summarized.to_markdown


def compare_engines(
    problem: Problem,
    engines: Sequence[str | Engine] = ("native", "bullet"),
    *,
    rollouts: int = 100,
    disturbance: Disturbance | None = None,
    seed: int = 0,
    threads: int | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> EngineComparison:
    """Asks for the capture probability in several engines, under the same draws.

    Args:
        problem: with a horizon or a plan.
        engines: 'native', 'bullet' or an em.engines.Engine each, two or more. All step as the first
            em.engines.Engine of them does, or else as the problem.
        rollouts: draws in each.
        disturbance: as of `capture_probability`; so are seed, threads, timeout and cancel, each of
            one engine.
        progress: progress(done, total) is called with the rollouts so far of all engines.

    Raises ValueError on fewer engines than two, on engines of different steps, on a time that is no
    whole number of steps, and as `capture_probability` does.
    """
    if isinstance(engines, str) or len(engines) < 2:
        raise ValueError(f"engines is {shown(engines)}, expected at least two")
    step = next((e.step for e in engines if isinstance(e, Engine)), problem.scene.step)
    if step != problem.scene.step:
        problem = problem.with_engine("native").with_step(step)
    for engine in engines:
        _require_bodies(problem, engine)
    asked = [problem.with_engine(engine) for engine in engines]
    asks: dict[str, Any] = {"rollouts": rollouts, "disturbance": disturbance, "seed": seed}
    asks |= {"threads": threads, "timeout": timeout, "cancel": cancel}
    counts = [progress and _counted(progress, k, len(asked)) for k in range(len(asked))]
    pairs = zip(asked, counts, strict=True)
    found = tuple(capture_probability(each, progress=count, **asks) for each, count in pairs)
    draws = min(p.exit_times.size for p in found)
    names = tuple(e if isinstance(e, str) else e.name for e in engines)
    each_found = zip(asked, found, strict=True)
    paths = [_undisturbed(each, p.times, timeout, cancel) for each, p in each_found]
    apart = np.linalg.norm(np.array(paths) - paths[0], axis=-1).max(axis=-1)
    exits = np.array([p.exit_times[:draws] for p in found])
    return EngineComparison(names, found, exits, found[0].times, apart)


def _require_bodies(problem: Problem, engine: str | Engine) -> None:
    """ValueError unless an engine that knows its scene has the problem's bodies and joints."""
    own = getattr(engine, "scene", None)
    if own is None:
        return
    here, there = (_state_names(scene) for scene in (problem.scene, own))
    if here != there:
        odd = sorted(set(here) ^ set(there)) or here
        text = f"engines has {engine!r} of another scene: {odd[0]!r} is not in both, or elsewhere"
        raise ValueError(f"{text}; expected one with scene=problem.scene")


def _state_names(scene: Any) -> list[str]:
    """Of what has numbers in its states, in their order."""
    links = {joint.child for joint in scene.joints}
    bodies = [body.name for body in scene.bodies if not body.fixed and body.name not in links]
    return bodies + [joint.name for joint in scene.joints if joint.type != "fixed"]


def _counted(progress: Update, number: int, engines: int) -> Update:
    """The progress of one engine, as that of all."""
    return lambda done, total: progress(number * total + done, engines * total)


def _undisturbed(
    problem: Problem, times: Floats, timeout: float | None, cancel: Cancel | None
) -> Floats:
    """Positions of the objects without a disturbance, shape (T, k, 3)."""
    scene, record = problem.scene, np.rint(times / problem.scene.step).astype(int).tolist()
    world: Any = World(scene, problem.plan) if problem.plan else World(scene)
    run = world.simulate(problem.state, record[-1], record=record, timeout=timeout, cancel=cancel)
    objects = [body.name for body in scene.bodies if body.role == "object"]
    states = map(scene.unpack, run.states)
    return np.array([[state[name]["position"] for name in objects] for state in states])
