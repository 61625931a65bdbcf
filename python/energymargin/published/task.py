"""What the tasks of the published data share: their trajectories are read, not made."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact, Plan, Problem, Region, Scene, World
from energymargin.scenes import moved_apart
from energymargin.tasks.base import STEP, Params
from energymargin.trajectories import Trajectory

__all__ = ["DEEPEST", "PublishedTask", "SimulatedTask", "Vector"]

DEEPEST = 0.01  # m; in the authors' simulator bodies sink into each other at impacts

Vector = tuple[float, float, float]


class PublishedTask(ABC):
    """A task of one object at the authors' parameters."""

    name: str
    plane: tuple[str, str] = ("x", "y")
    step: float = STEP
    """Of the simulation [s]."""
    duration: ClassVar[float]
    """Of the longest edge of a search [s]."""
    rate: ClassVar[float]
    """lambda [1/J]."""
    effector: ClassVar[str] = "drive"
    """As of a Problem."""

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return {}

    def rollout(self, seed: int, frames: int = 10) -> Trajectory:
        """Raises ValueError: there are the authors' trajectories alone."""
        raise ValueError(
            f"task {self.name!r} makes no trajectories: it has those that its authors published, "
            "which `energymargin import --published DIR` reads"
        )

    @abstractmethod
    def scene(self, params: Params) -> Scene:
        """The scene in which a trajectory was recorded; ValueError on params that lack what was
        drawn for it."""

    @abstractmethod
    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """The largest force [N] and torque [N m] on the object, on each axis."""

    @abstractmethod
    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """Z_cap(z) of a state, shape (n,), as the authors' labels have it."""

    @abstractmethod
    def captured_throughout(self, params: Params) -> Region:
        """Z_cap of every instant: the states that lie in their own `captured`."""

    @abstractmethod
    def succeeded(self, params: Params) -> Region:
        """Z_suc."""

    def problem(
        self,
        state: NDArray[np.float64],
        params: Params | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Problem:
        """The problem P of Section V-A at a state, shape (n,), of these params: wrenches act on
        the object. Raises ValueError on params that lack what was drawn for the trajectory."""
        drawn = params or {}
        scene = self.scene(drawn)
        force, torque = self.bounds(drawn)
        return Problem(
            scene,
            state,
            force=force,
            torque=torque,
            duration=self.duration,
            captured=self.captured(state, drawn),
            succeeded=self.succeeded(drawn),
            effector=self.effector,
            rate=self.rate,
            contacts=contacts,
            start_outside=True,
        )


class SimulatedTask(PublishedTask):
    """A task of Table I, whose robot followed a script."""

    part: ClassVar[str]
    """Its folder under simulated/."""
    columns: ClassVar[tuple[str, ...]]
    """Those of viapoints.csv that make a state."""
    interval: ClassVar[float | None]
    """Between frames [s]; None: each trajectory has one of its own, which is not recorded."""
    drawn: ClassVar[dict[str, str]] = {}
    """What was drawn for each trajectory: our name, and the column of maneuver_labels.csv."""

    @abstractmethod
    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (n,), of a row of `columns`."""

    def separated(self, world: World, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (n,), with the object out of what it has sunk into deeply, as at an
        impact."""
        depth = max((-contact.distance for contact in world.contacts(state)), default=0.0)
        return state if depth < DEEPEST else moved_apart(world, state, ("object",))

    @abstractmethod
    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """By body, the mean wrench (6,) [N, N m] of the script, beside what `scene` does."""

    def plan(self, state: NDArray[np.float64], time: float, params: Params, horizon: float) -> Plan:
        """What the robot is about to do for `horizon` [s]: the mean of the authors' script, which
        is the same at all times."""
        steps = round(horizon / self.step)
        wrenches = {body: np.tile(row, (steps, 1)) for body, row in self.script(params).items()}
        return Plan(self.step, wrenches=wrenches)
