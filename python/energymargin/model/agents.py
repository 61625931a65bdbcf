"""Agents of gymnasium, as what a policy asks: gymnasium and torch are not imported here."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.aliases import Floats
from energymargin.base.checks import shown


@dataclass(frozen=True)
class Agent:
    """What a model does at the observations of an environment."""

    model: Any
    """With `predict(observations, deterministic=True)`, as those of stable-baselines3; a module of
    torch; or a function of observations (n, d)."""
    sees: tuple[int, ...] | None
    """Shape of one observation; None: the space has none, as a Dict."""
    does: tuple[int, ...] | None
    """Shape of one action; None: the same."""
    parts: tuple[tuple[str, tuple[int, ...]], ...] = ()
    """Names and shapes of a Dict observation, which comes as one row of all."""

    @property
    def __name__(self) -> str:
        """What errors call it."""
        return str(getattr(self.model, "__name__", type(self.model).__name__))

    def __call__(self, seen: Floats, memory: Floats | None, time: float) -> NDArray[Any]:
        """Actions, a row an observation. Raises ValueError on other shapes than the spaces'."""
        parts = self.given(seen)
        given = parts if self.parts else parts[""]
        predict = getattr(self.model, "predict", None)
        if predict is None:
            answer, state = _answer(self.model, given), None
        else:
            answer, state = predict(given, deterministic=True)
        if state is not None:
            way = "give em.Policy an act that keeps it in memory, a row a rollout"
            raise ValueError(f"the agent has a state of its own, expected one without: {way}")
        actions = np.asarray(answer)
        _require_shape("the agent returned", actions, self.does, "action", "ask its own agent")
        return actions.reshape(len(actions), -1) if len(self.does or ()) > 1 else actions

    def given(self, seen: Floats) -> dict[str, Floats]:
        """Observations by the names of their space; "" of one that is no Dict."""
        if self.parts:
            ends = np.cumsum([int(np.prod(shape)) for _, shape in self.parts])
            if seen.shape[1:] != (ends[-1],):
                raise ValueError(
                    f"the agent sees rows of the shape {seen.shape[1:]}, expected ({ends[-1]},), "
                    "all parts of the observation space in its order"
                )
            columns = zip(self.parts, np.split(seen, ends[:-1], axis=1), strict=True)
            return {name: part.reshape(len(seen), *shape) for (name, shape), part in columns}
        if self.sees is not None and seen.shape[1:] == (int(np.prod(self.sees)),):
            seen = seen.reshape(len(seen), *self.sees)
        _require_shape("the agent sees", seen, self.sees, "observation", "give observe=")
        return {"": seen}


@dataclass(frozen=True)
class Chunks:
    """What an agent of LeRobot does, which plans several actions at a time: its memory has those
    that are left, and how many."""

    agent: Agent
    actions: int
    """Of one plan that are carried out."""

    @property
    def __name__(self) -> str:
        """What errors call it."""
        return self.agent.__name__

    @property
    def memory(self) -> int:
        """Numbers that a rollout remembers."""
        return 1 + self.actions * int(np.prod(self.agent.does or ()))

    def __call__(self, seen: Floats, memory: Floats, time: float) -> tuple[Floats, Floats]:
        """Actions, a row an observation, and the memory."""
        rows, memory = len(seen), memory.copy()
        empty = memory[:, 0] == 0.0
        if empty.any():
            named = {_NAMES.get(name, f"observation.{name}"): part
                     for name, part in self.agent.given(seen).items()}  # fmt: skip
            plan = np.asarray(_answer(self.agent.model, named, "predict_action_chunk"))
            wanted = (rows, *(self.agent.does or ()))
            if plan.ndim != 3 or (plan.shape[0], plan.shape[2]) != wanted:
                expected = f"expected {wanted[0]}, their number, {wanted[1]}"
                raise ValueError(f"the agent planned actions of the shape {plan.shape}, {expected}")
            memory[empty, 0] = self.actions
            memory[empty, 1:] = plan[empty, : self.actions].reshape(int(empty.sum()), -1)
        width = int(np.prod(self.agent.does or ()))
        first = 1 + width * (self.actions - memory[:, :1].astype(int)) + np.arange(width)
        actions = np.take_along_axis(memory, first, axis=1)
        memory[:, 0] -= 1.0
        return actions, memory


_NAMES = {"": "observation.state", "agent_pos": "observation.state"}
"""Of parts of an observation, as LeRobot calls them."""


Convert = Callable[[Floats], ArrayLike]


def bounded(low: Any, high: Any, convert: Convert | None, actions: Floats) -> ArrayLike:
    """Actions clipped to the bounds of their space, and then what they command, a row an action."""
    clipped = actions if low is None else np.clip(actions, np.ravel(low), np.ravel(high))
    return clipped if convert is None else convert(clipped)


def arguments_of(env: Any, model: Any, given: dict[str, Any]) -> dict[str, Any]:
    """Arguments of em.Policy: act, convert, command, observe and period; see from_gymnasium.

    `given` are those of the user, None where the environment is to say it.
    """
    inner = getattr(env, "unwrapped", None)
    if inner is None:
        raise ValueError(f"env is {shown(env)}, expected an environment of gymnasium")
    if hasattr(getattr(model, "policy", None), "predict"):
        model = model.policy  # of stable-baselines3: without its environment, which does not pickle
    if not (hasattr(model, "predict_action_chunk") or callable(getattr(model, "predict", model))):
        raise ValueError(f"model is {shown(model)}, expected an agent with predict or a function")
    known = {name: value for name, value in given.items() if value is not None}
    if hasattr(inner, "policy_arguments"):
        if not {"observe", "convert"} & set(known):
            _require_no_change(env, inner)
        known = {**inner.policy_arguments(), **known}
    elif "command" not in known:
        raise ValueError(
            f"env is {shown(env)}, which is not of this package, expected command=, names of what "
            "the agent commands in your scene, and observe=, a function from its states (n, s) to "
            "what the agent sees"
        )
    period = known.pop("period", getattr(inner, "dt", None))
    if period is None:
        raise ValueError(f"period is None, and {shown(env)} has no dt, expected its step [s]")
    space = env.action_space
    low, high = getattr(space, "low", None), getattr(space, "high", None)
    seen = env.observation_space
    parts = tuple((name, seen[name].shape) for name in getattr(seen, "spaces", ()))
    agent = Agent(model, seen.shape, space.shape, parts)
    act: Agent | Chunks = agent
    if hasattr(model, "predict_action_chunk"):
        act = Chunks(agent, int(model.config.n_action_steps))
        known["memory"] = act.memory
    convert = partial(bounded, low, high, known.get("convert"))
    return {**known, "period": period, "act": act, "convert": convert}


def _require_no_change(env: Any, inner: Any) -> None:
    """Raises ValueError on wrappers that change what the agent sees or does."""
    for space in ("observation_space", "action_space"):
        if getattr(env, space) != getattr(inner, space):
            raise ValueError(
                f"env is {shown(env)}, whose wrappers change the {space}, expected env.unwrapped "
                "for an agent that is asked without them, or observe= and convert= that do the same"
            )


def _require_shape(
    who: str, rows: NDArray[Any], shape: tuple[int, ...] | None, space: str, way_out: str
) -> None:
    if shape is not None and rows.shape[1:] != shape:
        expected = f"expected {shape}, as the {space} space of the environment says: {way_out}"
        raise ValueError(f"{who} rows of the shape {rows.shape[1:]}, {expected}")


def _answer(model: Any, seen: Any, method: str = "__call__") -> Any:
    """What a function returns, or a method, of arrays; a module of torch gets tensors."""
    torch, asked = sys.modules.get("torch"), getattr(model, method)
    if torch is None or not isinstance(model, torch.nn.Module):
        return asked(seen)
    like = next(model.parameters(), torch.zeros(()))

    def tensor(rows: Floats) -> Any:
        return torch.as_tensor(rows, dtype=like.dtype, device=like.device)

    named = isinstance(seen, dict)
    with torch.no_grad():
        given = {name: tensor(part) for name, part in seen.items()} if named else tensor(seen)
        return asked(given).cpu().numpy()
