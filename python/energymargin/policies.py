"""Policies: robots that are asked what to do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import PolicyPlan
from energymargin.checks import shown, whole_number

Rows = NDArray[np.float64]
Observe = Sequence[str] | Callable[[Rows], ArrayLike]


class Policy(PolicyPlan):
    """A plan whose robot is asked what to do, from one control time to the next.

    It goes where a plan goes: `em.Problem(..., horizon=2.0, plan=policy)`. Rollouts of
    `em.capture_probability` go on together, and `act` gets blocks of 32 rows, of which some may be
    there to fill the block: so an answer has the same bits whatever the number of rollouts and
    threads, as long as row i depends on row i alone. Searches and rare losses ask for one rollout
    at a time. What cannot ask a policy, as a file or another process, says so.

    Args:
        act: act(observations (n, d), memory (n, h) or None, time) -> actions (n, m), or with a
            memory (actions, memory). For a module of torch: `lambda x, memory, time:
            net(torch.as_tensor(x, dtype=torch.float32)).numpy()` under `torch.no_grad()`.
        period: between two control times [s]. Each is at the nearest step of the scene.
        observe: names of d numbers, as `observed` of em.Feedback but for forces, or a function of
            (states (n, s)) that returns (n, d); None: the states themselves.
        command: names of m numbers, as `corrected` of em.Feedback: targets of joints "j", wrenches
            "b.fx" to "b.tz", velocities "b.vx" to "b.wz".
        memory: h, numbers that a rollout remembers; at first they are zeros.
        delay: control periods from an observation to its action. Until the first acts, wrenches
            and velocities are zero and joints keep the scene's targets.
        noise: standard deviation of what is added to the observations, a number or (d,); not in
            searches and rare losses.
        limits: (low, high) of the actions, each (m,).
        name: what errors call it.

    Raises ValueError on bad arguments. What `act` raises goes on, and says at which control time.
    """

    def __init__(
        self,
        act: Callable[[Rows, Rows | None, float], Any],
        *,
        period: float,
        command: Sequence[str],
        observe: Observe | None = None,
        memory: int | None = None,
        delay: int = 0,
        noise: ArrayLike | None = None,
        limits: tuple[ArrayLike, ArrayLike] | None = None,
        name: str | None = None,
    ) -> None:
        """See the class."""
        if not callable(act):
            raise ValueError(f"act is {shown(act)}, expected a function")
        self.name = name or str(getattr(act, "__name__", type(act).__name__))
        """What errors call it."""
        self._act, self._width = act, len(command)
        self._observe = observe if callable(observe) else None
        self._memory = 0 if memory is None else whole_number("memory", memory, 1)
        self._noise = None if noise is None else np.asarray(noise, dtype=float)
        super().__init__(
            self._answer,
            observed=[] if observe is None or callable(observe) else list(observe),
            commanded=list(command),
            period=period,
            delay=delay,
            memory=self._memory,
            limits=limits,
            name=self.name,
        )

    def __repr__(self) -> str:
        """Its name."""
        return f"Policy({self.name!r})"

    def _answer(
        self, time: float, number: int, seen: Rows, seeds: NDArray[np.uint64], memory: Rows
    ) -> tuple[Rows, Rows]:
        """Actions and memory of a block, as numbers."""
        try:
            return self._asked(time, number, seen, seeds, memory)
        except Exception as error:
            kind = ValueError if isinstance(error, ValueError) else RuntimeError
            what = str(error) if kind is ValueError else f"{type(error).__name__}: {error}"
            raise kind(f"the policy {self.name!r}, asked at {time:.6g} s: {what}") from error

    def _asked(
        self, time: float, number: int, seen: Rows, seeds: NDArray[np.uint64], memory: Rows
    ) -> tuple[Rows, Rows]:
        rows = len(seen)
        if self._observe is not None:
            seen = _numbers("observe", self._observe(seen), (rows, None))
        if self._noise is not None and len(seeds):
            draws = [np.random.default_rng([number, int(seed)]) for seed in seeds]
            seen = seen + [one.standard_normal(seen.shape[1]) for one in draws] * self._noise
        answer = self._act(seen, memory if self._memory else None, time)
        if self._memory:
            if not (isinstance(answer, tuple) and len(answer) == 2):
                raise ValueError(f"act returned {shown(answer)}, expected (actions, memory)")
            answer, memory = answer[0], _numbers("memory", answer[1], memory.shape)
        return _numbers("act", answer, (rows, self._width)), memory


def _numbers(name: str, given: Any, shape: tuple[int, int | None]) -> Rows:
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
