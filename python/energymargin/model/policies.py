"""Policies: robots that are asked what to do."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import PolicyPlan
from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of, shown, whole_number
from energymargin.model.agents import arguments_of

Observe = Sequence[str] | Callable[[Floats], ArrayLike]


class Policy(PolicyPlan):
    """A plan whose robot is asked what to do, from one control time to the next.

    It goes where a plan goes: `em.Problem(..., horizon=2.0, plan=policy)`. Rollouts of
    `em.capture_probability` go on together, and `act` gets blocks of 32 rows, of which some may be
    there to fill the block: so an answer has the same bits whatever the number of rollouts and
    threads, as long as row i depends on row i alone. Searches and rare losses ask for one rollout
    at a time.

    A file, a store and a cache have its name in place of its code: they need `name`, and another
    name once what `act` does is another. Other processes get the code, pickled: they need `act`,
    `observe` and `convert` to be functions of a module, or objects of its classes.

    Args:
        act: act(observations (n, d), memory (n, h) or None, time) -> actions (n, m), or with a
            memory (actions, memory). For a module of torch: `lambda x, memory, time:
            net(torch.as_tensor(x, dtype=torch.float32)).numpy()` under `torch.no_grad()`.
        period: between two control times [s]. Each is at the nearest step of the scene.
        observe: names of d numbers, as `observed` of em.Feedback but for forces, or a function of
            (states (n, s)) that returns (n, d); None: the states themselves. Behind the numbers of
            the scene are those of the memory of an em.engines.Engine.
        command: names of m numbers, as `corrected` of em.Feedback: targets of joints "j", wrenches
            "b.fx" to "b.tz", velocities "b.vx" to "b.wz".
        memory: h, numbers that a rollout remembers; at first they are zeros.
        delay: control periods from an observation to its action. Until the first acts, wrenches
            and velocities are zero and joints keep the scene's targets.
        noise: standard deviation of what is added to the observations, a number or (d,); not in
            searches.
        limits: (low, high) of the actions, each (m,).
        convert: a function from what act says (n, a) to the commanded numbers (n, m), as from an
            agent's action; None: they are these.
        name: what files and errors call it; None: no file takes it.

    Raises ValueError on bad arguments, and from pickle on what cannot be. What `act` raises goes
    on, and says at which control time.
    """

    def __init__(
        self,
        act: Callable[[Floats, Floats | None, float], Any],
        *,
        period: float,
        command: Sequence[str],
        observe: Observe | None = None,
        memory: int | None = None,
        delay: int = 0,
        noise: ArrayLike | None = None,
        limits: tuple[ArrayLike, ArrayLike] | None = None,
        convert: Callable[[Any], ArrayLike] | None = None,
        name: str | None = None,
    ) -> None:
        """See the class."""
        self._arguments = {k: v for k, v in locals().items() if k not in ("self", "__class__")}
        if not callable(act):
            raise ValueError(f"act is {shown(act)}, expected a function")
        self.name = name or str(getattr(act, "__name__", type(act).__name__))
        """What errors call it."""
        self._act, self._convert, self._width = act, convert, len(command)
        self._first: Floats | None = None
        self._observe = observe if callable(observe) else None
        self._memory = 0 if memory is None else whole_number("memory", memory, 1)
        self._noise = np.atleast_1d(numbers_of("noise", [] if noise is None else noise))
        if self._noise.ndim > 1 or not (np.isfinite(self._noise) & (self._noise >= 0)).all():
            expected = "expected numbers of at least 0, (d,) or one"
            raise ValueError(f"noise is {shown(noise)}, {expected}")
        super().__init__(
            self._answer,
            observed=[] if observe is None or callable(observe) else list(observe),
            commanded=list(command),
            period=period,
            delay=delay,
            memory=self._memory,
            noise=self._noise,
            limits=limits,
            name=name or "",
        )

    @classmethod
    def from_gymnasium(
        cls,
        env: Any,
        model: Any,
        *,
        observe: Observe | None = None,
        command: Sequence[str] | None = None,
        convert: Callable[[Any], ArrayLike] | None = None,
        period: float | None = None,
        **options: Any,
    ) -> Policy:
        """The policy that does in a problem what an agent does in an environment.

        It is asked at each step of the environment. Its actions are clipped to the bounds of the
        action space.

        Args:
            env: of gymnasium. One of em.gym says the rest itself, if all drives of its task are the
                agent's.
            model: an agent with `predict(observations, deterministic=True)`, as those of
                stable-baselines3; one with `predict_action_chunk(observations)` and
                `config.n_action_steps`, as those of LeRobot, which is to see one observation; a
                module of torch; or a function of observations (n, d), or a dict of them by the
                names of a Dict space, that returns actions (n, a).
            observe: what the agent sees of your scene, names or a function as of em.Policy.
            command: what the agent commands in your scene, m names.
            convert: from actions (n, a) to the commanded numbers (n, m); None: they are these.
            period: duration of the environment's step [s]; None: its `dt`.
            options: memory, delay, noise, limits and name.

        Raises ValueError where the environment does not say what is left out.
        """
        given = {"observe": observe, "command": command, "convert": convert, "period": period}
        return cls(**arguments_of(env, model, given), **options)

    def after(self, action: ArrayLike) -> Policy:
        """The policy with an action, (m,) or as `convert` takes it, in place of its first answer.

        It is the future of that action: what a guard and a filter ask about. A name has the action
        behind it.
        """
        name = self._arguments["name"]
        named = name and f"{name} after {np.asarray(action).tolist()}"
        begun = Policy(**{**self._arguments, "name": named})
        begun._first = begun._commands(np.asarray(action)[None], 1)
        return begun

    def delayed(self, delay: int) -> Policy:
        """The policy whose answers act so many control periods later."""
        late = Policy(**{**self._arguments, "delay": delay})
        late._first = self._first
        return late

    def __reduce__(self) -> tuple[Any, ...]:
        """With its code; ValueError if that cannot be pickled."""
        try:
            code = pickle.dumps((self._arguments, self._first))
        except (AttributeError, TypeError, pickle.PicklingError) as error:
            raise ValueError(
                f"the policy {self.name!r} cannot be pickled, as for another process ({error}), "
                "expected act, observe and convert to be functions of a module or objects of its "
                "classes, no lambda and no function within another"
            ) from error
        return _unpickled, (self.name, code)

    def __repr__(self) -> str:
        """Its name."""
        return f"Policy({self.name!r})"

    def _answer(
        self, time: float, number: int, seen: Floats, seeds: NDArray[np.uint64], memory: Floats
    ) -> tuple[Floats, Floats]:
        """Actions and memory of a block, as numbers."""
        try:
            return self._asked(time, number, seen, seeds, memory)
        except Exception as error:
            kind = ValueError if isinstance(error, ValueError) else RuntimeError
            what = str(error) if kind is ValueError else f"{type(error).__name__}: {error}"
            raise kind(f"the policy {self.name!r}, asked at {time:.6g} s: {what}") from error

    def _asked(
        self, time: float, number: int, seen: Floats, seeds: NDArray[np.uint64], memory: Floats
    ) -> tuple[Floats, Floats]:
        rows = len(seen)
        if self._observe is not None:
            seen = _numbers("observe", self._observe(seen), (rows, None))
        if self._noise.size and len(seeds):
            if self._noise.size not in (1, seen.shape[1]):
                raise ValueError(f"noise has {self._noise.size} numbers, expected {seen.shape[1]}")
            draws = [np.random.default_rng([number, int(seed)]) for seed in seeds]
            seen = seen + [one.standard_normal(seen.shape[1]) for one in draws] * self._noise
        answer = self._act(seen, memory if self._memory else None, time)
        if self._memory:
            if not (isinstance(answer, tuple) and len(answer) == 2):
                raise ValueError(f"act returned {shown(answer)}, expected (actions, memory)")
            answer, memory = answer[0], _numbers("memory", answer[1], memory.shape)
        actions = self._commands(answer, rows)
        if number == 0 and self._first is not None:
            actions = np.repeat(self._first, rows, axis=0)
        return actions, memory

    def _commands(self, answer: Any, rows: int) -> Floats:
        if self._convert is not None:
            answer = self._convert(answer)
        return _numbers("act", answer, (rows, self._width))


def _unpickled(name: str, code: bytes) -> Policy:
    try:
        arguments, first = pickle.loads(code)
    except (AttributeError, ImportError) as error:
        wrong = f"this process has no code of the policy {name!r} ({error})"
        expected = "expected it in a module that both can import, not in the script that runs"
        raise ValueError(f"{wrong}, {expected}") from error
    policy = Policy(**arguments)
    policy._first = first
    return policy


def _numbers(name: str, given: Any, shape: tuple[int, int | None]) -> Floats:
    """What a function returned, as finite numbers."""
    array = np.asarray(given)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} returned the dtype {array.dtype}, expected numbers")
    found = np.ascontiguousarray(array, dtype=float)
    wanted = (shape[0], found.shape[1] if shape[1] is None and found.ndim == 2 else shape[1])
    if found.shape != wanted:
        raise ValueError(f"{name} returned the shape {found.shape}, expected {wanted}")
    if not np.isfinite(found).all():
        row = int(np.argmin(np.isfinite(found).all(axis=1)))
        raise ValueError(f"{name} returned {found[row]} in row {row}, expected finite numbers")
    return found
