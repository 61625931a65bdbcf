"""MuJoCo itself as the engine of a scene: the model of the user, whatever is in it."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout as mujoco_rollout
from numpy.typing import NDArray

import energymargin as em
from energymargin.base.checks import check_type, core_count
from energymargin.mujoco.reading import Columns, Reader
from energymargin.mujoco.scene_of import scene_of
from energymargin.mujoco.states import States
from energymargin.mujoco.variation import values_of, varied_model

Numbers = NDArray[np.float64]

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION.value
USER = mujoco.mjtState.mjSTATE_USER.value


class Engine(em.engines.Engine):
    """A MuJoCo model that MuJoCo steps, as it is configured.

    Its memory is MuJoCo's whole state (mjSTATE_INTEGRATION), pushes are forces of `xfrc_applied` at
    the centres of mass, and the commands of a plan or a policy are the model's controls by their
    actuators' names. Controls that nobody commands stay those of the data. It varies
    "friction.BODY", "mass.BODY" [kg] and "gain.ACTUATOR". Rollouts run on threads of their own,
    without Python's lock.

    Args:
        model: a `mujoco.MjModel`.
        data: a `mujoco.MjData` where all starts, with its controls; None: a fresh one.
        objects: bodies on which pushes act, by name.
        effector: bodies of the robot, by name.
        scene: that of the problem, with bodies and joints of the model's names; None: `scene_of`
            the model.
        threads: that step it; None: all cores.
        name: what errors call it.

    Raises ValueError on names that the model does not have, and on a scene with such.
    """

    concurrent = True

    def __init__(
        self,
        model: Any,
        data: Any = None,
        *,
        objects: Sequence[str] | str = (),
        effector: Sequence[str] | str = (),
        scene: em.Scene | None = None,
        threads: int | None = None,
        name: str = "mujoco",
    ) -> None:
        """See the class."""
        check_type("model", model, mujoco.MjModel, "a mujoco.MjModel")
        self.model = model
        """The `mujoco.MjModel`."""
        self.data = mujoco.MjData(self.model)
        """A `mujoco.MjData` where all starts."""
        if data is not None:
            mujoco.mj_copyData(self.data, self.model, data)
        else:
            mujoco.mj_forward(self.model, self.data)
        self.name, self.step = name, float(self.model.opt.timestep)
        self.threads = core_count("threads", threads)
        """Threads that step it."""
        self.scene: em.Scene = (
            scene_of(self.model, self.data, objects=_names(objects), effector=_names(effector))
            if scene is None
            else scene.with_engine("native")
        )
        """The scene that sets, pictures and searches know, without an engine."""
        self._has_own_scene = scene is not None
        self.columns = Columns(self.model)
        """Where what is in its memory."""
        self.memory = self.columns.size
        addresses = getattr(model, "actuator_ctrladr", range(model.nu))  # as of MuJoCo 4
        self._actuators = {
            model.actuator(i).name or f"actuator{i}": int(addresses[i]) for i in range(model.nu)
        }
        self.commands = {name: float(self.data.ctrl[at]) for name, at in self._actuators.items()}
        self.varies = values_of(self.model)
        self._states = States(self.scene, self.model, others=self.scene.pack())
        self._reader = Reader(self.scene, self.model, self._states, self.columns)
        self.home = np.empty(self.memory)
        """Memory of the start."""
        mujoco.mj_getState(self.model, self.data, self.home, INTEGRATION)
        self.state = self._reader.states(self.home[None])[0]
        """State of the scene at the start, shape (n,)."""
        self.objects = self._reader.objects
        """Numbers of the objects in the model."""
        self._idle = list[tuple[Any, mujoco_rollout.Rollout]]()

    def digest(self) -> str:
        """Of the model's bytes, the start, the version of MuJoCo and the roles of the bodies."""
        model = np.empty(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, model)
        found = hashlib.sha256(model.tobytes())
        found.update(self.home.tobytes())
        found.update(mujoco.__version__.encode())
        return found.hexdigest()

    def varied(self, changes: Mapping[str, float]) -> Engine:
        """As the base class says, from the same state and controls."""
        options = {"scene": self.scene, "threads": self.threads, "name": self.name}
        return _engine_at(varied_model(self.model, changes), self.home, options)

    def read(self, memory: Numbers) -> Numbers:
        """States of the scene, shape (n, d), of memory (n, h)."""
        return self._reader.states(memory)

    def start(self, states: Numbers) -> Numbers:
        """MuJoCo's states where the scene is at some: what the scene lacks is as in the data."""
        memory = np.tile(self.home, (len(states), 1))
        for row, state in zip(memory, states, strict=True):
            if not np.array_equal(state, self.state):
                own = mujoco.MjData(self.model)
                mujoco.mj_copyData(own, self.model, self.data)
                self._states.write(own, state)
                mujoco.mj_getState(self.model, own, row, INTEGRATION)
        return memory

    def play(self, batch: em.engines.Batch) -> tuple[Numbers, Numbers, Numbers]:
        """As the base class says; on several threads if there are several rows."""
        count, steps = len(batch.states), batch.steps
        paths = np.empty((count, steps, self.columns.physics.size))
        memory = batch.memory.copy()
        rows = itertools.count()

        def work() -> None:
            for row in iter(lambda: next(rows), None):
                if row >= count:
                    return
                self._roll(memory[row], self._control(batch, row), paths[row])

        threads = min(self.threads, count)
        if threads > 1:
            pool = _pool(self.threads)
            for done in [pool.submit(work) for _ in range(threads)]:
                done.result()
        else:
            work()
        own = np.repeat(memory[:, None], steps // batch.every, axis=1)
        own[..., self.columns.physics] = paths[:, batch.every - 1 :: batch.every]
        states = self._reader.states(own.reshape(-1, self.memory))
        states = states.reshape(count, -1, batch.states.shape[1])
        states[~np.isfinite(memory).all(axis=1)] = np.nan
        return states, memory, self._work(batch, paths)

    def _control(self, batch: em.engines.Batch, row: int) -> Numbers:
        """What the user of MuJoCo sets in each step of a rollout, shape (steps, u)."""
        columns = self.columns
        control = np.empty((batch.steps, columns.user.size))
        control[:] = batch.memory[row, columns.user]
        for name, values in batch.commands.items():
            control[:, columns.control + self._actuators[name]] = values[row]
        for number, body in enumerate(self._reader.objects):
            at = columns.applied + 6 * body
            control[:, at : at + 6] += batch.pushes[row, :, number]
        return control

    def _roll(self, memory: Numbers, control: Numbers, path: Numbers) -> None:
        """Plays a rollout: memory becomes that after the last step, path the physics after each."""
        columns, steps, start = self.columns, len(path), memory[0]
        try:
            data, rollout = self._idle.pop()
        except IndexError:
            data, rollout = mujoco.MjData(self.model), mujoco_rollout.Rollout(nthread=0)
        rollout.rollout(
            [self.model],
            [data],
            memory[None, columns.physics],
            control[None],
            control_spec=USER,
            skip_checks=True,
            nstep=steps,
            initial_warmstart=memory[None, columns.warmstart],
            state=path[None],
            sensordata=np.empty((1, steps, self.model.nsensordata)),
        )
        memory[columns.physics] = path[-1]
        memory[columns.warmstart] = data.qacc_warmstart
        self._idle.append((data, rollout))
        first = columns.control  # controls stay until they are set anew, pushes do not
        memory[columns.controls] = control[-1, first : first + columns.controls.size]
        if abs(path[-1, 0] - start - steps * self.step) > self.step / 2:
            memory[:] = path[:] = np.nan

    def _work(self, batch: em.engines.Batch, paths: Numbers) -> Numbers:
        """Of each push in each step, at the mean of the velocities before and after."""
        work = np.zeros(batch.pushes.shape[:3])
        pushed = np.flatnonzero(batch.pushes.any(axis=(1, 2, 3)))
        rows = slice(None) if pushed.size == len(work) else pushed  # which copies
        if not pushed.size:
            return work
        twists = self._reader.twists(batch.memory[rows], paths[rows])
        for number, twist in enumerate(twists):
            mean = (twist[..., :-1] + twist[..., 1:]) / 2
            mean *= np.moveaxis(batch.pushes[rows, :, number], -1, 0)
            work[rows, :, number] = self.step * mean.sum(axis=0)
        return work

    def __reduce__(self) -> tuple[Any, ...]:
        """With the model, the start, and a scene of another making, as a problem's file has it."""
        bodies = self.scene.bodies
        own = {
            name: [body.name for body in bodies if body.role == role]
            for name, role in (("objects", "object"), ("effector", "effector"))
        }
        options = {**own, "threads": self.threads, "name": self.name}
        text = self._scene_as_text(self.scene) if self._has_own_scene else None
        return _engine_at, (self.model, self.home, options, text)


def _engine_at(
    model: Any, home: Numbers, options: dict[str, Any], scene: str | None = None
) -> Engine:
    """The engine of a model where MuJoCo's state is one."""
    if scene is not None:
        options = {"scene": Engine._scene_of_text(scene), **options}
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, home, INTEGRATION)
    mujoco.mj_forward(model, data)
    mujoco.mj_setState(model, data, home, INTEGRATION)  # with its warm start
    return Engine(model, data, **options)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Shared by all engines of so many threads."""
    return ThreadPoolExecutor(threads, "mujoco")


def _names(given: Sequence[str] | str) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)
