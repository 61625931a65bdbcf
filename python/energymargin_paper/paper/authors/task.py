"""Base classes of the tasks of the published data, whose trajectories are read, not made."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from energymargin import regions
from energymargin._core import Contact, Plan, Problem, Region, Scene, World
from energymargin.scenes import moved_apart
from energymargin.tasks.base import STEP, Params
from energymargin.tasks.trajectories import Trajectory

__all__ = [
    "COLUMNS",
    "DEEPEST",
    "PublishedTask",
    "SimulatedTask",
    "Sweep",
    "SweptTask",
    "Vector",
    "between",
    "placed",
]

DEEPEST = 0.01  # m; in the authors' simulator bodies sink into each other at impacts

Vector = tuple[float, float, float]


class PublishedTask(ABC):
    """A task of one object at the authors' parameters."""

    name: str
    plane: tuple[str, str] = ("x", "y")
    step: float = STEP
    """Step of the simulation [s]."""
    duration: ClassVar[float]
    """Duration of the longest edge of a search [s]."""
    rate: ClassVar[float]
    """lambda [1/J]."""
    effector: ClassVar[str] = "drive"
    """As of a Problem."""

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return {}

    def rollout(self, seed: int, frames: int = 10) -> Trajectory:
        """Raises ValueError: there are only the authors' trajectories."""
        raise ValueError(
            f"task {self.name!r} makes no trajectories: it has those that its authors published, "
            "which `energymargin import-published DIR` reads"
        )

    @abstractmethod
    def scene(self, params: Params) -> Scene:
        """The scene in which a trajectory was recorded; ValueError on params that lack what was
        drawn for it."""

    def search_scene(self, state: NDArray[np.float64], params: Params) -> Scene:
        """The scene of the authors' search at a state, shape (n,); by default `scene`."""
        return self.scene(params)

    @abstractmethod
    def bounds(self, params: Params) -> tuple[Vector, Vector]:
        """The largest force [N] and torque [N m] on the object, on each axis."""

    def effort_bounds(self, params: Params) -> tuple[Vector, Vector]:
        """Bounds of the authors' efforts of escape."""
        return self.bounds(params)

    @abstractmethod
    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """Z_cap(z) of a state, shape (n,), as the authors' labels have it."""

    def search_set(self, state: NDArray[np.float64], params: Params) -> Region:
        """Z_cap(z) as the authors' search has it; by default that of the labels."""
        return self.captured(state, params)

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
        """The problem P of Section V-A at a state, shape (n,), of these params, as the authors'
        search poses it: in `search_scene`, with `search_set`. Wrenches act on the object. Raises
        ValueError on params that lack what was drawn for the trajectory."""
        drawn = params or {}
        scene, captured = self.search_scene(state, drawn), self.search_set(state, drawn)
        return self._posed(scene, captured, state, drawn, contacts)

    def recorded_problem(
        self,
        state: NDArray[np.float64],
        params: Params | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Problem:
        """The problem in the scene in which the trajectory was recorded and with the set of the
        labels, which is how the paper defines it; of what is to come it is asked so."""
        drawn = params or {}
        return self._posed(self.scene(drawn), self.captured(state, drawn), state, drawn, contacts)

    def _posed(
        self,
        scene: Scene,
        captured: Region,
        state: NDArray[np.float64],
        drawn: Params,
        contacts: Sequence[Contact] | None,
    ) -> Problem:
        force, torque = self.bounds(drawn)
        return Problem(
            scene,
            state,
            force=force,
            torque=torque,
            duration=self.duration,
            captured=captured,
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
    """Parameters that were drawn for each trajectory: by our name, the column of
    maneuver_labels.csv."""

    @abstractmethod
    def state(self, scene: Scene, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (n,), of a row of `columns`."""

    def separated(self, world: World, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state, shape (n,), with the object out of what it has sunk into deeply, as at an
        impact; where it finds no place, as it was recorded."""
        depth = max((-contact.distance for contact in world.contacts(state)), default=0.0)
        if depth < DEEPEST:
            return state
        try:
            return moved_apart(world, state, ("object",))
        except ValueError:
            return state

    @abstractmethod
    def script(self, params: Params) -> dict[str, tuple[float, ...]]:
        """By body, the mean wrench (6,) [N, N m] of the script, beside what `scene` does."""

    def plan(self, state: NDArray[np.float64], time: float, params: Params, horizon: float) -> Plan:
        """What the robot is about to do for `horizon` [s]: the mean of the authors' script, which
        is the same at all times."""
        steps = round(horizon / self.step)
        wrenches = {body: np.tile(row, (steps, 1)) for body, row in self.script(params).items()}
        return Plan(self.step, wrenches=wrenches)


COLUMNS = (
    *("xo", "yo", "thetao", "vxo", "vyo", "omegao"),
    *("xg", "yg", "thetag", "vxg", "vyg", "omegag"),
)
"""Columns of object and effector: position [m], yaw [rad], and their rates."""


@dataclass(frozen=True)
class Sweep:
    """The dimensions of a swept capture set."""

    half_width: float
    """On both sides of the effector's path [m]."""
    ahead: float
    """Time of its motion ahead [s]."""
    ends: float
    """Length that is added at both ends of its path [m]."""
    least_speed: float
    """Below it the set is a disc [m/s]."""
    disc_radius: float
    """[m]"""

    def region(self, at: dict[str, Any] | None) -> Region:
        """The capture set of a fixed motion of the effector; for None, of its own at each state."""
        return regions.Swept(
            "object",
            by="effector",
            half_width=self.half_width,
            behind=self.ends,
            ahead=self.ahead,
            beyond=self.ends,
            least_speed=self.least_speed,
            disc_radius=self.disc_radius,
            at=at,
        )


class SweptTask(PublishedTask):
    """The object is captured in what the effector is about to sweep."""

    sweep: ClassVar[Sweep]
    search_sweep: ClassVar[Sweep]
    """Sweep in the authors' search, whose settings are others than those of their labels."""

    def captured(self, state: NDArray[np.float64], params: Params) -> Region:
        """What the effector is about to sweep from where it is at this state, shape (26,)."""
        return self._swept(self.sweep, state, params)

    def search_set(self, state: NDArray[np.float64], params: Params) -> Region:
        """The capture set by `search_sweep`."""
        return self._swept(self.search_sweep, state, params)

    def _swept(self, sweep: Sweep, state: NDArray[np.float64], params: Params) -> Region:
        effector = self.scene(params).unpack(state)["effector"]
        return sweep.region(
            {
                "position": effector["position"][:2],
                "velocity": effector["velocity"][:2],
                "yaw_rate": effector["angular_velocity"][2],
            }
        )

    def captured_throughout(self, params: Params) -> Region:
        """What the effector is about to sweep from where it has come to."""
        return self.sweep.region(None)


def placed(row: NDArray[np.float64], height: float) -> dict[str, Any]:
    """Keywords of `Scene.pack` for a body with x, y, yaw and their rates, shape (6,), at this
    height of its centre [m]."""
    x, y, yaw, vx, vy, yaw_rate = row.tolist()
    return {
        "position": (x, y, height),
        "yaw": yaw,
        "velocity": (vx, vy, 0.0),
        "angular_velocity": (0.0, 0.0, yaw_rate),
    }


def between(axis: tuple[float, float, float], low: float, high: float) -> Region:
    """The object's centre between two planes across an axis [m]."""
    normal = np.array(axis)
    return regions.HalfSpace("object", normal, high) & regions.HalfSpace("object", -normal, -low)
