"""Engines of others: simulators that play the rollouts of a scene in batches."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import shown

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Batch:
    """Rollouts that go on together, a row each."""

    states: Numbers
    """States of the scene, shape (n, d)."""
    memory: Numbers
    """What the engine knows of each besides, shape (n, h)."""
    pushes: Numbers
    """Wrenches on the k objects in each step, shape (n, steps, k, 6) [N, N m]: at the centre of
    mass, in the world's axes."""
    commands: dict[str, Numbers]
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
    memory: int = 0
    """h: numbers behind the scene's that a rollout goes on from."""
    commands: Mapping[str, float] = {}
    """What the targets of a plan and the commands of a policy may name, with their values until one
    says otherwise."""
    deterministic: bool = True
    """Whether it keeps the promise of the same bits. Without it nothing promises bits."""
    concurrent: bool = False
    """Whether several threads may call `play` at once."""

    @abstractmethod
    def digest(self) -> str:
        """What the answers depend on, as a hash: stores know by it whether an engine is another."""

    def start(self, states: Numbers) -> Numbers:
        """The memory, shape (n, h), with which rollouts begin at states (n, d)."""
        if self.memory:
            raise NotImplementedError(
                f"the engine {self.name!r} has a memory, but no start(states)"
            )
        return np.zeros((len(states), 0))

    @abstractmethod
    def play(self, batch: Batch) -> tuple[Numbers, Numbers, Numbers]:
        """States (n, steps / every, d) after each `every` steps, memory (n, h) after the last one,
        and the work of each object's push in each step, (n, steps, k) [J]: f . v + tau . omega
        times the step, at the mean of the velocities before and after."""

    def __repr__(self) -> str:
        """Its name."""
        return f"Engine({self.name!r})"

    def _start(self, states: Numbers) -> Numbers:
        return _shaped(self, "start", self.start(states), (len(states), self.memory))

    def _play(
        self,
        *,
        states: Numbers,
        memory: Numbers,
        pushes: Numbers,
        commands: Numbers,
        commanded: Sequence[str],
        steps: int,
        every: int,
    ) -> tuple[Numbers, Numbers, Numbers]:
        """An answer, as flat rows, whose shapes are right."""
        n, d = states.shape
        by_name = commands.reshape(n, steps, -1)
        batch = Batch(
            states,
            memory,
            pushes.reshape(n, steps, -1, 6),
            {name: by_name[:, :, i] for i, name in enumerate(commanded)},
            steps,
            every,
        )
        if self.concurrent:
            answer = self.play(batch)
        else:
            with _LOCK:
                answer = self.play(batch)
        if not (isinstance(answer, tuple) and len(answer) == 3):
            raise ValueError(
                f"play of the engine {self.name!r} returned {shown(answer)}, expected (states, "
                "memory, work)"
            )
        shapes = (n, steps // every, d), (n, self.memory), (n, steps, batch.pushes.shape[2])
        parts = [
            _shaped(self, f"play: {what}", part, shape)
            for what, part, shape in zip(("states", "memory", "work"), answer, shapes, strict=True)
        ]
        return parts[0].reshape(-1, d), parts[1], parts[2].reshape(n * steps, -1)


_LOCK = threading.Lock()  # of all engines that one thread at a time may ask


def _shaped(engine: Engine, what: str, given: Any, shape: tuple[int, ...]) -> Numbers:
    array = np.ascontiguousarray(given, dtype=float)
    if array.shape != shape:
        raise ValueError(
            f"{what} of the engine {engine.name!r} has the shape {array.shape}, expected {shape}"
        )
    return array
