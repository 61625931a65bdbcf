"""Environments of gymnasium as engines: each step is one of the environment, after an action."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin._core import Box, Scene
from energymargin.base.aliases import Floats
from energymargin.base.checks import each_name, positive_number, shown
from energymargin.model.engines import Engine
from energymargin.model.policies import Policy
from energymargin.model.serial_engines import MOST, Serial

if TYPE_CHECKING:
    from energymargin.mujoco.environment import Inside

SMALL = 0.1  # m, edge of the box that stands for a body which is read by a function
ALONE = 1.0  # kg, its mass

Read = Callable[[Any], Any]
Bodies = Sequence[str] | str | Mapping[str, Read]


class Gymnasium(Serial):
    """An environment of gymnasium, whose actions are the commands "action0", "action1", ...

    It goes on from where it is: reset it, and act, before. One of MuJoCo needs no functions: its
    state is MuJoCo's own (mjSTATE_INTEGRATION), bodies are read by their names in the model, and
    pushes are forces of `xfrc_applied` through all of MuJoCo's steps in one of the environment.
    What it has besides, as the state of a controller, `save` and `restore` say.

    Args:
        env: with its wrappers. Ends of an episode do not matter; an environment that refuses to go
            on has to be told so, as `ignore_done=True` of robosuite does.
        objects: bodies on which pushes act: names in a model of MuJoCo; or a function by name, from
            the environment to position, orientation x, y, z, w, velocity and angular velocity of
            the centre of mass, 13 numbers.
        effector: bodies of the robot, likewise.
        save: save(env) returns what the environment goes on from: numbers, always as many, or
            anything else, which is kept here under a handle. With MuJoCo: what there is besides.
        restore: restore(env, saved) goes back to it.
        push: push(env, wrenches) lets wrenches, shape (k, 6), act on the objects during the next
            step; without MuJoCo.
        observe: observe(env) is what an agent sees; None: `env.unwrapped._get_obs()`.
        scene: that of the problem; None: it is made of the model, or of a small box of 1 kg for
            each function.
        step: of the environment [s]; None: its `dt`, or its `control_timestep`.
        most: handles that are kept at most.
        name: what errors call it.

    Raises ValueError on what the environment does not tell, and on names that it does not have.
    """

    def __init__(
        self,
        env: Any,
        *,
        objects: Bodies,
        effector: Bodies = (),
        save: Callable[[Any], Any] | None = None,
        restore: Callable[[Any, Any], None] | None = None,
        push: Callable[[Any, Floats], None] | None = None,
        observe: Read | None = None,
        scene: Scene | None = None,
        step: float | None = None,
        most: int = MOST,
        name: str = "gymnasium",
    ) -> None:
        """See the class."""
        if (save is None) != (restore is None):
            raise ValueError("save and restore belong together, expected both or none")
        self.env, self.name, self.most = env, name, most
        self._save, self._restore, self._push = save, restore, push
        self._given = {"objects": objects, "effector": effector, "observe": observe, "most": most}
        inner = env.unwrapped
        self.step = _step_of(inner) if step is None else positive_number("step", step)
        self._objects, others = _functions(objects), _functions(effector)
        self._read = {**self._objects, **others}
        self._inside: Inside | None = None
        if self._read:
            if save is None:
                raise ValueError("objects are read by functions, expected save= and restore= too")
            made = _boxes(env, self._objects, others, self.step) if scene is None else scene
            self.scene: Scene = made.with_engine("native")
            """The scene that sets, pictures and searches know, without an engine."""
        else:
            given = {"objects": each_name(objects), "effector": each_name(effector), "scene": scene}
            self._inside = _inside(env, step=self.step, **given)
            self.scene, self.substeps = self._inside.scene, self._inside.substeps
        self.commands = _commands(env.action_space)
        self._observe = observe or (_get_obs if hasattr(inner, "_get_obs") else None)
        self.observed = self.observe().size
        own = [] if save is None else save(env)
        self._own = np.size(own) if _is_numbers(own) else None
        inside = 0 if self._inside is None else self._inside.saved
        self.saved = None if self._own is None else self._own + inside
        self._origin = self.save()
        self.state = self.read()
        """State of the scene at the start, shape (d,)."""
        own = [k for k, v in vars(inner).items() if isinstance(v, int | float | np.ndarray)]
        numbers = [(name, np.asarray(getattr(inner, name))) for name in sorted(own)]
        self._numbers = [(k, v.tobytes()) for k, v in numbers if v.dtype.kind in "biuf"]

    def digest(self) -> str:
        """Of the environment's specification, the numbers that it has as attributes, its model in
        MuJoCo, where it starts, and the version."""
        import gymnasium

        found = sha256(f"{gymnasium.__version__} {_told(self.env)} {self.step!r}".encode())
        for name, numbers in self._numbers:
            found.update(name.encode() + numbers)
        if self._inside is not None:
            found.update(self._inside.digest())
        found.update(self.state.tobytes())
        if self.saved is not None:
            found.update(self._origin.tobytes())
        return found.hexdigest()

    def policy(self, model: Any, **options: Any) -> Policy:
        """The policy of an agent that acts in the environment, asked at each of its steps.

        `model`, `options`: as of `em.Policy.from_gymnasium`. The agent sees what `observe` returns.
        Raises ValueError where the environment does not say what is observed.
        """
        if self._observe is None:
            raise ValueError("the environment has no _get_obs, expected an engine with observe=")
        observe = partial(last, self.observed)
        given: dict[str, Any] = {"observe": observe, "command": list(self.commands)}
        if not self.env.action_space.shape:
            given["convert"] = _columns
        return Policy.from_gymnasium(self.env, model, **{"period": self.step, **given, **options})

    def put(self, state: Floats) -> None:
        """As the base class says. Raises ValueError if only the environment can."""
        self._go_to(self._origin)
        if np.array_equal(state, self.state):
            return
        if self._inside is None:
            raise ValueError(
                f"a rollout of the engine {self.name!r} is to start at another state than its "
                "environment's, expected that: without MuJoCo nobody can put it there"
            )
        self._inside.put(state)

    def save(self) -> Any:
        """As the base class says."""
        inside = np.zeros(0) if self._inside is None else self._inside.save()
        if self._save is None:
            return inside
        own = self._save(self.env)
        if self._own is None:
            return inside, own
        if np.size(own) != self._own:
            expected = f"expected {self._own}, as before"
            raise ValueError(f"save returned {np.size(own)} numbers, {expected}")
        return np.concatenate([inside, np.ravel(own)])

    def restore(self, saved: Any) -> None:
        """As the base class says."""
        self._go_to(saved)

    def _go_to(self, saved: Any) -> None:
        size = 0 if self._inside is None else self._inside.saved
        inside, own = saved if self._own is None else (saved[:size], saved[size:])
        if self._inside is not None:
            self._inside.restore(inside)
        if self._restore is not None:
            self._restore(self.env, own)

    def advance(self, pushes: Floats, commands: Mapping[str, float]) -> None:
        """As the base class says."""
        space = self.env.action_space
        action = np.array(list(commands.values())).reshape(space.shape).astype(space.dtype)
        if self._inside is not None:
            self._inside.refresh()
            self._inside.push(pushes)
        elif self._push is not None:
            self._push(self.env, pushes)
        self.env.step(action if space.shape else action.item())
        if self._inside is not None:
            self._inside.push(np.zeros_like(pushes))

    def read(self) -> Floats:
        """As the base class says."""
        if self._inside is not None:
            return self._inside.read()
        state = self.scene.pack()
        for name, read in self._read.items():
            state[self.scene.slice(name)] = _row(self.env, name, read)
        return np.asarray(state)

    def bodies(self) -> Floats:
        """As the base class says."""
        if self._inside is not None:
            return self._inside.bodies()
        return np.array([_row(self.env, name, read) for name, read in self._objects.items()])

    def __reduce__(self) -> tuple[Any, ...]:
        """With the environment, as that is pickled, and where it is; ValueError with handles."""
        if self.saved is None:
            expected = "expected numbers where it is pickled, as for another process"
            raise ValueError(f"the engine {self.name!r} saves handles, {expected}")
        own = {"save": self._save, "restore": self._restore, "push": self._push}
        given = {**self._given, **own, "step": self.step, "name": self.name}
        scene = self._scene_as_text(self.scene)
        return _unpickled, (self.env, given, scene, self._origin, self.observe())

    def observe(self) -> Floats:
        """As the base class says, flat: the parts of a dict in the order of its space."""
        return np.zeros(0) if self._observe is None else _flat(self.env, self._observe(self.env))


def last(count: int, states: Floats) -> Floats:
    """What an engine observed at states (n, s) with its memory behind them: the last numbers, shape
    (n, count)."""
    return states[:, -count:]


def _unpickled(
    env: Any, given: dict[str, Any], scene: str, origin: Floats, seen: Floats
) -> Gymnasium:
    env.reset()
    engine = Gymnasium(env, scene=Engine._scene_of_text(scene), **given)
    engine._go_to(origin)
    engine._origin, engine.state = origin, engine.read()
    if not np.array_equal(engine.observe(), seen):
        expected = "expected save= and restore= of what it has besides MuJoCo's state, as a goal"
        raise ValueError(f"the environment observes something else in another process, {expected}")
    return engine


def _step_of(inner: Any) -> float:
    for name in ("dt", "control_timestep"):
        if hasattr(inner, name):
            return positive_number("step", getattr(inner, name))
    raise ValueError(f"step is None, and {shown(inner)} has no dt, expected its step [s]")


def _inside(env: Any, **given: Any) -> Inside:
    """The MuJoCo of an environment; ValueError if it has none."""
    inner = env.unwrapped
    sim = getattr(inner, "sim", None)  # of robosuite, which wraps both
    model = getattr(getattr(sim, "model", None), "_model", getattr(inner, "model", None))
    data = getattr(getattr(sim, "data", None), "_data", getattr(inner, "data", None))
    if model is None or data is None:
        expected = "expected functions in objects={...}, save= and restore="
        raise ValueError(f"env is {shown(env)}, which has no model and data of MuJoCo, {expected}")
    from energymargin.mujoco.environment import Inside

    return Inside(model, data, **given)


def _columns(actions: Any) -> Floats:
    return np.asarray(actions, dtype=float).reshape(len(actions), 1)


def _functions(bodies: Bodies) -> dict[str, Read]:
    return dict(bodies) if isinstance(bodies, Mapping) else {}


def _row(env: Any, name: str, read: Read) -> Floats:
    """What a function says of a body, shape (13,)."""
    row = np.asarray(read(env), dtype=float)
    if row.shape != (13,):
        raise ValueError(
            f"the function of {name!r} returns numbers of the shape {row.shape}, expected (13,)"
        )
    return row


def _boxes(env: Any, objects: Mapping[str, Read], others: Mapping[str, Read], step: float) -> Scene:
    """Bodies that stand for those that are read."""
    scene = Scene(gravity=(0, 0, 0), step=step)
    for role, bodies in (("object", objects), ("effector", others)):
        for name, read in bodies.items():
            row = _row(env, name, read)
            place: dict[str, Any] = {"position": row[:3], "orientation": row[3:7]}
            scene.add_body(name, Box([SMALL] * 3), mass=ALONE, role=role, **place)
    return scene


def _commands(space: Any) -> dict[str, float]:
    """Names of the numbers of an action, and zeros, or what is nearest."""
    if getattr(space, "shape", None) is None:
        raise ValueError(f"the action space is {shown(space)}, expected a Box or a Discrete")
    low, high = getattr(space, "low", 0.0), getattr(space, "high", 0.0)
    idle = np.clip(np.zeros(space.shape), low, high).ravel()
    return {f"action{k}": float(value) for k, value in enumerate(idle)}


def _get_obs(env: Any) -> Any:
    return env.unwrapped._get_obs()


def _flat(env: Any, seen: Any) -> Floats:
    """An observation as a row of numbers."""
    parts = [seen[key] for key in env.observation_space] if isinstance(seen, Mapping) else [seen]
    return np.concatenate([np.ravel(part).astype(float) for part in parts])


def _is_numbers(saved: Any) -> bool:
    try:
        return np.asarray(saved).dtype.kind in "fiub"
    except ValueError:  # of different lengths
        return False


def _told(env: Any) -> str:
    """What an environment was made of."""
    spec = getattr(env, "spec", None)
    return f"{type(env.unwrapped).__module__}.{type(env.unwrapped).__qualname__} {spec}"
