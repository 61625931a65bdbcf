"""Tasks whose robot follows a script in simulation: they say what is special about them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin import regions
from energymargin._core import Cancel, Contact, Plan, Problem, Region, Scene, Simulation, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import one_of, seed_number, whole_number
from energymargin.base.limits import Limit
from energymargin.base.reprs import Record
from energymargin.tasks import base
from energymargin.tasks.base import PLANE, STEP, Params, Regions, Task
from energymargin.tasks.from_problem import ProblemTask
from energymargin.tasks.trajectories import Trajectory

Following = Literal["script", "hold"]
"""What the robot does over a horizon: its script, or it goes on as it moves."""

EFFECTORS = ("coast", "drive")


def engine_of(task: Task) -> str:
    """What steps the scenes of a task, as far as it says so."""
    return str(getattr(task, "engine", "native"))


def in_engine(task: Task, engine: str) -> Task:
    """The task, with its trajectories and problems in scenes that another engine steps.

    Raises ValueError on a task that makes its own scenes, and on an engine that there is not.
    """
    if isinstance(task, ProblemTask):
        return task.in_engine(engine)
    if not isinstance(task, ScriptedTask):
        wrong = f"engine is {engine!r}, but task {task.name!r} makes its own scenes"
        raise ValueError(f"{wrong}: build them with Scene(engine={engine!r})")
    Scene(engine=engine)
    made = copy(task)
    made.__class__ = type(type(task).__name__, (_InEngine, type(task)), {"engine": engine})
    return made


@dataclass(frozen=True, eq=False, repr=False)
class Drive(Record):
    """What moves the robot along one trajectory, with a row for each simulation step."""

    wrenches: dict[str, Floats] = field(default_factory=dict)
    """By body: force [N] and torque [N m] on it, shape (steps, 6)."""
    targets: dict[str, Floats] = field(default_factory=dict)
    """By joint: the position that its control aims at [rad, m], shape (steps,)."""

    def between(self, first: int, last: int) -> Drive:
        """The rows of the steps from `first` on, before `last`."""
        return Drive(
            {body: rows[first:last] for body, rows in self.wrenches.items()},
            {joint: rows[first:last] for joint, rows in self.targets.items()},
        )


class ScriptedTask(Task):
    """A task whose robot follows a script, with random starts and noise, in simulation.

    The paper's four are such (Section VI-A, VI-D). A trajectory is made in this order, which fixes
    what its seed means: `draw`, `start`, `drive`, and the simulation of `scene`.
    """

    plane: tuple[str, str] = PLANE
    length: float
    """Duration of a trajectory [s]."""
    step: float = STEP
    """Step of the simulation, which is that of its scene [s]."""
    effector: str = EFFECTORS[0]
    """ "coast" or "drive", as of a Problem."""

    def __init__(self, effector: str = EFFECTORS[0]) -> None:
        """`effector`: "coast" or "drive", as of a Problem; raises ValueError on another word."""
        self.effector = one_of("effector", effector, EFFECTORS)

    @property
    def parameters(self) -> dict[str, Any]:
        """The keywords that make this task again."""
        return base.constructor_keywords(self)

    @abstractmethod
    def scene(self, params: Params) -> Scene:
        """The scene in which the script runs."""

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """What is drawn for one trajectory, such as the friction; by default nothing."""
        return {}

    def start(self, world: World, params: Params, random: np.random.Generator) -> Floats:
        """A random start state, shape (n,); by default that of the scene."""
        return np.asarray(world.scene.pack())

    @abstractmethod
    def drive(self, params: Params, random: np.random.Generator) -> Drive:
        """The script, for all `steps` of a trajectory."""

    def script(self, params: Params) -> Drive:
        """The mean of `drive`, for all `steps` of a trajectory, which `plan` asks for.

        Raises ValueError on a task without one.
        """
        raise ValueError(
            f"task {self.name!r} has no script of what its robot does: give "
            f"{type(self).__name__} a method `script(params)`, the mean of its `drive` as a Drive; "
            "without one its plan can be 'hold' or none"
        )

    def afterwards(self, params: Params) -> dict[str, Floats]:
        """By body, the wrench (6,) [N, N m] once the script is over; by default none."""
        return {}

    @abstractmethod
    def captured(self, state: Floats, params: Params) -> Regions:
        """Z_cap(z) of a state, shape (n,); with several objects, that of each by its name."""

    def captured_throughout(self, params: Params) -> Regions:
        """Z_cap of every instant: the states that lie in their own `captured`, as the labels say.

        With several objects, that of each by its name. By default Predicates that ask `captured`
        anew for each state: they are slow, and have no file format. A task whose set can be written
        as other regions should give it.
        """
        layout = self.scene(params)
        start = np.asarray(layout.pack())

        def throughout(name: str | None) -> Region:
            def contains(states: Floats) -> NDArray[np.bool_]:
                sets = [base.set_of_object(self.captured(state, params), name) for state in states]
                inside = [one.contains(layout, z) for one, z in zip(sets, states, strict=True)]
                return np.array(inside, dtype=bool)

            return regions.Predicate(contains)

        sets = self.captured(start, params)
        return {o: throughout(o) for o in sets} if isinstance(sets, dict) else throughout(None)

    @abstractmethod
    def succeeded(self, params: Params) -> Regions:
        """Z_suc; with several objects, that of each by its name."""

    def plan(
        self, state: Floats, time: float, params: Params, horizon: float | None = None
    ) -> Plan:
        """What the robot is about to do at a time [s] of its script: the script's mean from there.

        It lasts for `horizon` [s], by default until the script ends, at `length`. From there on
        wrenches are those of `afterwards`, and joints keep their last targets. `state`, shape (n,),
        is for tasks whose robot looks at it. Raises ValueError on a task without `script`, a time
        before 0 s or a plan of less than a step.
        """
        script = self._script(params)
        first = round(time / self.step)
        rows = self.steps - first if horizon is None else round(horizon / self.step)
        if first < 0 or rows < 1:
            lasting = "" if horizon is None else f" and horizon {horizon:g} s"
            raise ValueError(
                f"time is {time:g} s{lasting}, expected a time from 0 s and a plan of at least a "
                f"step of {self.step:g} s; the script ends at {self.length:g} s, and a plan that "
                "goes on behind its end takes a horizon"
            )
        numbers = np.arange(first, first + rows)
        over, row = numbers >= self.steps, np.minimum(numbers, self.steps - 1)
        after, none = self.afterwards(params), np.zeros(6)
        wrenches = {body: given[row] for body, given in script.wrenches.items()}
        for body, given in wrenches.items():
            given[over] = after.get(body, none)
        targets = {joint: given[row] for joint, given in script.targets.items()}
        return Plan(self.step, wrenches=wrenches, targets=targets)

    def _script(self, params: Params) -> Drive:
        try:
            return self.script(params)
        except KeyError as error:
            expected = "expected those of a trajectory: trajectory.params"
            raise ValueError(f"params has no {error}, {expected}") from error

    def future(
        self,
        state: Floats,
        time: float,
        params: Params,
        horizon: float,
        plan: Following | None = "script",
    ) -> Problem:
        """Does it stay captured over the next `horizon` [s] of what the robot does?

        The problem of `problem` at a state, shape (n,), and a time [s] of the script, with a clock.
        Its capture set is `captured_throughout`: it goes along, instead of being that of the start.
        `plan`: "script", the robot does what `plan` says, in the scene of its script; "hold", it
        goes on as it moves; None, it coasts. Raises ValueError on other words, a horizon that is
        not whole steps, and a task without a plan.
        """
        problem = self.problem(state, params)
        scene, robot = problem.scene, None
        if plan == "script":
            scene, robot = self.scene(params), self.plan(state, time, params, horizon)
        elif plan == "hold":
            robot = Plan.hold(scene, state, horizon)
        elif plan is not None:
            raise ValueError(f"plan is {plan!r}, expected 'script', 'hold' or None")
        captured = self.captured_throughout(params)
        changes = {"scene": scene, "horizon": horizon, "plan": robot, "effector": "coast"}
        return problem.replace(captured=captured, **changes)

    @property
    def steps(self) -> int:
        """Simulation steps of a trajectory."""
        return round(self.length / self.step)

    def rollout(
        self,
        seed: int,
        frames: int = 10,
        *,
        timeout: float | None = None,
        cancel: Cancel | None = None,
    ) -> Trajectory:
        """One trajectory, with frames evenly spaced over it, from its start to its end.

        The same for the same seed. Raises ValueError on a negative seed, or frames that are not
        from 2 to the number of steps and the start; TimeoutError after `timeout` [s], Cancelled
        once `cancel` is set.
        """
        limit = Limit(timeout, cancel)
        random = np.random.default_rng(seed_number(seed))
        frames = whole_number("frames", frames, 2, self.steps + 1)
        params = self.draw(random)
        world = World(self.scene(params))
        start = self.start(world, params, random)
        drive = self.drive(params, random)

        recorded = np.round(np.linspace(0, self.steps, frames)).astype(int).tolist()
        simulation = _simulate(world, start, drive, recorded, limit)
        captured, succeeded = self.labels(simulation.states, params)
        captured_any, succeeded_any = self.labels_any(simulation.states, params)
        return Trajectory(
            times=simulation.times,
            states=simulation.states,
            contacts=simulation.contacts,
            captured=captured,
            success=bool(succeeded[-1]),
            params=params,
            seed=int(seed),
            captured_any=captured_any,
            success_any=None if succeeded_any is None else bool(succeeded_any[-1]),
        )

    def resume(
        self,
        state: Floats,
        time: float,
        params: Params,
        seed: int,
        times: ArrayLike,
        *,
        world: World | None = None,
        timeout: float | None = None,
        cancel: Cancel | None = None,
    ) -> Floats:
        """The script goes on from a state at a time, with noise of its own.

        Args:
            state: from which it goes on, shape (n,).
            time: of the script at that state [s].
            params: those of the trajectory.
            seed: of the noise. A drive is drawn for the whole trajectory, and used from `time` on.
            times: at which states are recorded, rising from `time` to at most `length` [s],
                shape (K,).
            world: of the scene of these params; None makes one.
            timeout: TimeoutError after so many seconds.
            cancel: Cancelled once it is set.

        Returns the states at `times`, shape (K, n). Raises ValueError on other times.
        """
        limit = Limit(timeout, cancel)
        steps = np.round(np.array([time, *np.ravel(times)]) / self.step).astype(int)
        (first, *recorded), rising = steps.tolist(), np.diff(steps) > 0
        if not (recorded and rising.all() and first >= 0 and recorded[-1] <= self.steps):
            raise ValueError(
                f"times is {np.asarray(times).tolist()}, expected to rise from after {time:g} s "
                f"to at most {self.length:g} s, the task's length"
            )
        drive = self.drive(params, np.random.default_rng(seed_number(seed)))
        world = World(self.scene(params)) if world is None else world
        drive = drive.between(first, recorded[-1])
        return _simulate(world, state, drive, [step - first for step in recorded], limit).states

    def labels(
        self, states: Floats, params: Params, *, scene: Scene | None = None
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether each state, shape (N, n), lies in its own capture set and in the success set.

        Two arrays of shape (N,). Of several objects, all are to be in theirs. `scene`, that of
        these params, saves making one.
        """
        layout = self.scene(params) if scene is None else scene
        captured = [base.inside(self.captured(z, params), layout, z).all() for z in states]
        succeeded = base.inside(self.succeeded(params), layout, states)
        return np.array(captured), np.all(succeeded, axis=0)

    def labels_any(
        self, states: Floats, params: Params, *, scene: Scene | None = None
    ) -> tuple[NDArray[np.bool_] | None, NDArray[np.bool_] | None]:
        """Whether at least one object lies in its capture set, and in its success set.

        As `labels`; None where there is one set for all objects.
        """
        layout = self.scene(params) if scene is None else scene
        some = [base.any_inside(self.captured(z, params), layout, z) for z in states]
        captured = None if any(one is None for one in some) else np.array(some, dtype=bool)
        return captured, base.any_inside(self.succeeded(params), layout, states)


def _simulate(
    world: World, state: Floats, drive: Drive, record: list[int], limit: Limit
) -> Simulation:
    """One simulation to the last of the steps that are recorded, from 0, the state itself."""
    simulate = partial(world.simulate, drives=drive.wrenches, targets=drive.targets)
    return simulate(state, record[-1], record=record, **limit.rest())


class _InEngine(ScriptedTask):
    """Before the class of a task, it exchanges the engine of all its scenes."""

    engine: str

    @property
    def parameters(self) -> dict[str, Any]:
        """With the engine."""
        return {**super().parameters, "engine": self.engine}

    def scene(self, params: Params) -> Scene:
        """That of the task, in the engine."""
        return super().scene(params).with_engine(self.engine)  # type: ignore[safe-super]

    def problem(
        self, state: Floats, params: Params | None = None, contacts: Sequence[Contact] | None = None
    ) -> Problem:
        """That of the task, in the engine."""
        made = super().problem(state, params, contacts)  # type: ignore[safe-super]
        return made.with_engine(self.engine)

    def __reduce__(self) -> tuple[Any, ...]:
        task = copy(self)
        task.__class__ = type(self).__mro__[2]
        return in_engine, (task, self.engine)
