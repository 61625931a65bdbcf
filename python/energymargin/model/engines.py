"""Engines of others: simulators that play the rollouts of a scene in batches."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from energymargin._core import Problem, Scene, regions
from energymargin.base.aliases import Floats
from energymargin.base.checks import shown
from energymargin.base.plausibility import kept_warnings

FAR = 1e6  # m; nothing is there


@dataclass(frozen=True, eq=False)
class Batch:
    """Rollouts that go on together, a row each."""

    states: Floats
    """States of the scene, shape (n, d)."""
    memory: Floats
    """What the engine knows of each besides, shape (n, h)."""
    pushes: Floats
    """Wrenches on the k objects in each step, shape (n, steps, k, 6) [N, N m]: at the centre of
    mass, in the world's axes."""
    commands: dict[str, Floats]
    """By name of a command that the robot gives, its value in each step, shape (n, steps)."""
    steps: int
    """Number of steps."""
    every: int
    """Steps from one state that is asked for to the next; a divisor of `steps`."""


class Engine(ABC):
    """A simulator of yours: it plays rollouts from any state, by save, restore and step.

    `problem.with_engine(engine)` is the question in it, and all that asks for rollouts works:
    probabilities, rare losses, efforts, rank, improve, guards. It must not hold that problem.
    em.engines.check(engine, problem) tests what is promised here.

    A row's answer depends on that row alone: the same bits in any batch, in any order, after any
    other. What a rollout leaves behind has to be in its state and memory. One that has diverged has
    numbers that are not finite.
    """

    name: str = "engine"
    """What errors call it."""
    step: float
    """Length of a step [s], that of the scene."""
    substeps: int = 1
    """Steps of the simulator in one step, of which works are the sum."""
    memory: int = 0
    """h: numbers behind the scene's that a rollout goes on from."""
    commands: Mapping[str, float] = {}
    """What the targets of a plan and the commands of a policy may name, with their values until one
    says otherwise."""
    deterministic: bool = True
    """Whether it keeps the promise of the same bits. Without it nothing promises bits."""
    concurrent: bool = False
    """Whether several threads may call `start` and `play` at once."""
    varies: Mapping[str, float] = {}
    """What can be another in it, with its values: "friction.BODY", "mass.BODY" [kg], and names of
    its own. Beliefs and critical values ask for it."""

    @abstractmethod
    def digest(self) -> str:
        """What the answers depend on, as a hash: stores know by it whether an engine is another."""

    def start(self, states: Floats) -> Floats:
        """The memory, shape (n, h), with which rollouts begin at states (n, d)."""
        if self.memory:
            expected = "expected a start(states) of its own"
            raise TypeError(f"the engine {self.name!r} has a memory, {expected}")
        return np.zeros((len(states), 0))

    @abstractmethod
    def play(self, batch: Batch) -> tuple[Floats, Floats, Floats]:
        """States (n, steps / every, d) after each `every` steps, memory (n, h) after the last one,
        and the work of each object's push in each step, (n, steps, k) [J]: f . v + tau . omega
        times the step, at the mean of the velocities before and after."""

    def varied(self, changes: Mapping[str, float]) -> Engine:
        """The engine with other values of some that it `varies`; this one stays as it is."""
        raise TypeError(f"the engine {self.name!r} has no varied(), expected one for its `varies`")

    def __repr__(self) -> str:
        """Its name."""
        return f"Engine({self.name!r})"

    @staticmethod
    def _scene_as_text(scene: Scene) -> str:
        """A scene, which does not pickle, as the JSON of a problem in it. Raises ValueError on what
        files do not have."""
        body = next(one.name for one in scene.bodies if one.role == "object")
        everywhere = regions.HalfSpace(body, normal=(0, 0, 1), offset=FAR)
        none: dict[str, Any] = {"force": (0, 0, 0), "torque": (0, 0, 0), "duration": 1.0}
        with kept_warnings():
            return Problem(scene, scene.pack(), captured=everywhere, **none).to_json()

    @staticmethod
    def _scene_of_text(text: str) -> Scene:
        """The scene that was written so."""
        with kept_warnings():
            return Problem.from_json(text).scene

    @property
    def _alone(self) -> AbstractContextManager[Any]:
        """Entered by one thread at a time, unless several may ask."""
        return nullcontext() if self.concurrent else _LOCK

    def _start(self, states: Floats) -> Floats:
        with self._alone:
            memory = self.start(states)
        return _shaped(self, "start", memory, (len(states), self.memory))

    def _answer(self, batch: Batch) -> tuple[Floats, Floats, Floats]:
        """What `play` says, whose shapes are right."""
        count, steps, objects = batch.pushes.shape[:3]
        with self._alone:
            answer = self.play(batch)
        if not (isinstance(answer, tuple) and len(answer) == 3):
            wrong = f"play of the engine {self.name!r} returned {shown(answer)}"
            raise ValueError(f"{wrong}, expected (states, memory, work)")
        of_states = (count, steps // batch.every, batch.states.shape[1])
        return (
            _shaped(self, "play: states", answer[0], of_states),
            _shaped(self, "play: memory", answer[1], (count, self.memory)),
            _shaped(self, "play: work", answer[2], (count, steps, objects)),
        )

    def _play(
        self,
        *,
        states: Floats,
        memory: Floats,
        pushes: Floats,
        commands: Floats,
        commanded: Sequence[str],
        steps: int,
        every: int,
    ) -> tuple[Floats, Floats, Floats]:
        """An answer to the core, as flat rows."""
        count, dimension = states.shape
        by_name = commands.reshape(count, steps, -1)
        named = {name: by_name[:, :, i] for i, name in enumerate(commanded)}
        wrenches = pushes.reshape(count, steps, -1, 6)
        answer = self._answer(Batch(states, memory, wrenches, named, steps, every))
        return answer[0].reshape(-1, dimension), answer[1], answer[2].reshape(count * steps, -1)


def with_varied(problem: Problem, changes: Mapping[str, float]) -> Problem:
    """A problem whose engine has other values. Raises ValueError on what that does not vary."""
    engine = problem.scene.engine
    for name in changes:
        varied_by(engine, name)
    return problem.with_engine(engine.varied(changes))


def varied_by(engine: Engine, name: str) -> float:
    """The value of what an engine varies. Raises ValueError on another name."""
    if name not in engine.varies:
        known = ", ".join(engine.varies) or "nothing"
        raise ValueError(f"the engine {engine.name!r} does not vary {name!r}, but {known}")
    return engine.varies[name]


def problem(engine: Any, *, captured: Any, **question: Any) -> Problem:
    """The question whether objects stay where they are to be, in an engine that knows its scene.

    Args:
        engine: one with `scene` and `state`, as em.engines.Gymnasium and em.mujoco.Engine.
        captured: the capture set, as of em.Problem.
        question: the other keywords of em.Problem, as force, horizon and plan. torque is by default
            0, and duration 0.5 s.

    Raises ValueError as em.Problem does.
    """
    if not (hasattr(engine, "scene") and hasattr(engine, "state")):
        raise ValueError(f"engine is {shown(engine)}, expected one with a scene and a state")
    question = {"torque": (0.0, 0.0, 0.0), "duration": 0.5, **question}
    scene = engine.scene.with_engine(engine)
    with kept_warnings():  # of what would be odd if the scene itself were simulated
        return Problem(scene, engine.state, captured=captured, **question)


_LOCK = threading.RLock()  # of all engines that one thread at a time may ask


def _shaped(engine: Engine, what: str, given: Any, shape: tuple[int, ...]) -> Floats:
    array = np.ascontiguousarray(given, dtype=float)
    if array.shape != shape:
        raise ValueError(
            f"{what} of the engine {engine.name!r} has the shape {array.shape}, expected {shape}"
        )
    return array
