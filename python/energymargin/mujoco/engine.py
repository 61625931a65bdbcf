"""MuJoCo itself as the engine of a scene: the model of the user, whatever is in it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from copy import copy
from functools import cache
from threading import Event
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout as mujoco_rollout

import energymargin as em
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, core_count, each_name
from energymargin.mujoco.kinematics import INTEGRATION, Columns
from energymargin.mujoco.models import bytes_of, scene_of, values_of, varied_model
from energymargin.mujoco.reading import Reader
from energymargin.mujoco.states import States, require_data

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
USER = mujoco.mjtState.mjSTATE_USER.value
PIECE = 500  # steps, after which a rollout sees that it is interrupted
LOOK = 0.02  # s, between two looks for an interrupt


class Engine(em.engines.Engine):
    """A MuJoCo model that MuJoCo steps, as it is configured.

    Its memory is MuJoCo's whole state (mjSTATE_INTEGRATION), pushes are forces of `xfrc_applied` at
    the centres of mass, and the commands of a plan or a policy are the model's controls by their
    actuators' names, and forces on the robot's bodies, "BODY.fx" to "BODY.tz" [N, N m], of
    `xfrc_applied` too. What nobody commands stays as in the data. It varies
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
        if data is not None:
            require_data(model, data)
        self.model = model
        """The `mujoco.MjModel`."""
        self.data = mujoco.MjData(model) if data is None else copy(data)
        """A `mujoco.MjData` where all starts."""
        if data is None:
            mujoco.mj_forward(model, self.data)
        self.name, self.step = name, float(self.model.opt.timestep)
        self.threads = core_count("threads", threads)
        """Threads that step it."""
        roles = {"objects": objects, "effector": effector}
        self._roles: dict[str, Any] = {role: each_name(given) for role, given in roles.items()}
        own = None if scene is None else scene.with_engine("native")
        self.scene: em.Scene = own or scene_of(model, self.data, step=self.step, **self._roles)
        """The scene that sets, pictures and searches know, without an engine."""
        self._has_own_scene = scene is not None
        for body in self._roles["objects"]:
            if self.model.body_weldid[self.model.body(body).id] == 0:
                expected = "expected bodies that a push can move"
                raise ValueError(f"objects has {body!r}, which no joint lets move, {expected}")
        self.columns = Columns(self.model)
        """Where what is in its memory."""
        self.memory = self.columns.size
        self.home = np.empty(self.memory)
        """Memory of the start."""
        mujoco.mj_getState(self.model, self.data, self.home, INTEGRATION)
        self._places = self._commandable()
        user = np.searchsorted(self.columns.user, list(self._places.values()))
        self._places_of_user = dict(zip(self._places, user.tolist(), strict=True))
        self.commands = {name: float(self.home[at]) for name, at in self._places.items()}
        self.varies = values_of(self.model)
        self._states = States(self.scene, self.model, others=self.scene.pack())
        self._reader = Reader(self.scene, self.model, self._states, self.columns)
        self.state = self._reader.states(self.home[None])[0]
        """State of the scene at the start, shape (n,)."""
        self.objects = self._reader.objects
        """Numbers of the objects in the model."""
        self._idle = list[tuple[Any, mujoco_rollout.Rollout]]()

    def _commandable(self) -> dict[str, int]:
        """Where in the memory what a plan may name is."""
        model, columns = self.model, self.columns
        addresses = getattr(model, "actuator_ctrladr", range(model.nu))  # as of MuJoCo 4
        actuators = [model.actuator(i).name or f"actuator{i}" for i in range(model.nu)]
        pairs = zip(actuators, addresses, strict=True)
        places = {name: int(columns.controls[at]) for name, at in pairs}
        for body in self._roles["effector"]:
            applied = zip(WRENCH, columns.applied[model.body(body).id], strict=True)
            places |= {f"{body}.{part}": int(at) for part, at in applied}
        return places

    def digest(self) -> str:
        """Of the model's bytes, the start and the version of MuJoCo."""
        found = hashlib.sha256(bytes_of(self.model))
        found.update(self.home.tobytes())
        found.update(mujoco.__version__.encode())
        return found.hexdigest()

    def varied(self, changes: Mapping[str, float]) -> Engine:
        """As the base class says, from the same state and controls."""
        options = {"threads": self.threads, "name": self.name, "scene": self.scene, **self._roles}
        return _engine_at(varied_model(self.model, changes), self.home, options, None)

    def read(self, memory: Floats) -> Floats:
        """States of the scene, shape (n, d), of memory (n, h)."""
        return self._reader.states(memory)

    def start(self, states: Floats) -> Floats:
        """MuJoCo's states where the scene is at some: what the scene lacks is as in the data."""
        memory = np.tile(self.home, (len(states), 1))
        for row, state in zip(memory, states, strict=True):
            if not np.array_equal(state, self.state):
                own = copy(self.data)
                self._states.write(own, state)
                mujoco.mj_getState(self.model, own, row, INTEGRATION)
        return memory

    def play(self, batch: em.engines.Batch) -> tuple[Floats, Floats, Floats]:
        """As the base class says; on several threads if there are several rows."""
        memory, paths, work = self.follow(batch)
        count, steps = paths.shape[:2]
        own = np.repeat(memory[:, None], steps // batch.every, axis=1)
        own[..., self.columns.physics] = paths[:, batch.every - 1 :: batch.every]
        states = self._reader.states(own.reshape(-1, self.memory)).reshape(
            count, -1, self.state.size
        )
        states[~np.isfinite(memory).all(axis=1)] = np.nan
        return states, memory, work

    def follow(self, batch: em.engines.Batch) -> tuple[Floats, Floats, Floats]:
        """As `play`, but for the physics after each step, shape (n, steps, p), in place of the
        scene's states; nor are those where it begins looked at."""
        steps, memory = batch.steps, batch.memory.copy()
        paths = np.empty((len(memory), steps, self.columns.physics.size))
        for first in range(0, steps, PIECE):
            some = slice(first, first + PIECE)
            self._play_piece(batch, some, memory, paths[:, some])
        paths[~np.isfinite(memory).all(axis=1)] = np.nan
        return memory, paths, self._work(batch, paths)

    def _play_piece(
        self, batch: em.engines.Batch, some: slice, memory: Floats, paths: Floats
    ) -> None:
        """Some steps: memory becomes that after the last one, paths the physics after each."""
        columns, (count, steps) = self.columns, paths.shape[:2]
        start, warm = memory[:, columns.physics], memory[:, columns.warmstart]
        user = memory[:, columns.user]
        rows, over = iter(np.flatnonzero(~np.isnan(start[:, 0])).tolist()), Event()
        how = {"control_spec": USER, "skip_checks": True, "nstep": steps}

        def work() -> None:
            try:
                data, rollout = self._idle.pop()
            except IndexError:
                data, rollout = mujoco.MjData(self.model), mujoco_rollout.Rollout(nthread=0)
            sensors = np.empty((1, steps, self.model.nsensordata))
            for row in rows:
                if over.is_set():
                    break
                own = slice(row, row + 1)
                control = self._control(batch, row, user[row], some)[None]
                out = {"initial_warmstart": warm[own], "state": paths[own], "sensordata": sensors}
                rollout.rollout([self.model], [data], start[own], control, **how, **out)
                warm[row] = data.qacc_warmstart
            self._idle.append((data, rollout))

        if min(self.threads, count) > 1:
            _together(_pool(self.threads), work, min(self.threads, count), over)
        else:
            work()
        lost = ~(np.abs(paths[:, -1, 0] - start[:, 0] - steps * self.step) <= self.step / 2)
        memory[:, columns.physics], memory[:, columns.warmstart] = paths[:, -1], warm
        for name, values in batch.commands.items():  # which stay until they are set anew
            memory[:, self._places[name]] = values[:, some][:, -1]
        memory[lost] = np.nan

    def _control(self, batch: em.engines.Batch, row: int, user: Floats, some: slice) -> Floats:
        """What the user of MuJoCo sets in some steps of a rollout, shape (steps, u)."""
        columns, pushes = self.columns, batch.pushes[row, some]
        control = np.empty((len(pushes), user.size))
        control[:] = user
        for name, values in batch.commands.items():
            control[:, self._places_of_user[name]] = values[row, some]
        for number, body in enumerate(self.objects):
            first = columns.applied_of_user[body, 0]
            control[:, first : first + 6] += pushes[:, number]
        return control

    def _work(self, batch: em.engines.Batch, paths: Floats) -> Floats:
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
        options = {**self._roles, "threads": self.threads, "name": self.name}
        text = self._scene_as_text(self.scene) if self._has_own_scene else None
        return _engine_at, (self.model, self.home, options, text)


def _engine_at(model: Any, home: Floats, options: dict[str, Any], scene: str | None) -> Engine:
    """The engine of a model where MuJoCo's state is one."""
    if scene is not None:
        options = {"scene": Engine._scene_of_text(scene), **options}
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, home, INTEGRATION)
    mujoco.mj_forward(model, data)
    mujoco.mj_setState(model, data, home, INTEGRATION)  # with its warm start
    return Engine(model, data, **options)


def problem(
    model: Any,
    data: Any = None,
    *,
    objects: Sequence[str] | str,
    captured: em.regions.Region,
    effector: Sequence[str] | str = (),
    threads: int | None = None,
    **question: Any,
) -> em.Problem:
    """The question whether objects stay where they are to be, in MuJoCo itself.

    Args:
        model: a `mujoco.MjModel`.
        data: a `mujoco.MjData` that says where all starts, with its controls.
        objects: bodies on which disturbances act, by name.
        captured: the capture set, as of em.Problem.
        effector: bodies of the robot, by name.
        threads: that MuJoCo steps on; None: all cores.
        question: as of em.engines.problem.

    Raises ValueError as em.mujoco.Engine and em.Problem do.
    """
    engine = Engine(model, data, objects=objects, effector=effector, threads=threads)
    return em.engines.problem(engine, captured=captured, **question)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Shared by all engines of so many threads."""
    return ThreadPoolExecutor(threads, "mujoco")


def _together(pool: ThreadPoolExecutor, work: Callable[[], None], count: int, over: Event) -> None:
    """Lets threads work. An interrupt comes through between two looks, and ends them soon."""
    pending = [pool.submit(work) for _ in range(count)]
    try:
        while wait(pending, LOOK).not_done:
            pass
    finally:
        over.set()
        wait(pending)
    for done in pending:
        done.result()
