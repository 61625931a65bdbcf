"""Agents of gymnasium, as what a policy asks: gymnasium and torch are not imported here."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.base.checks import shown

Rows = NDArray[np.float64]


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

    @property
    def __name__(self) -> str:
        """What errors call it."""
        return str(getattr(self.model, "__name__", type(self.model).__name__))

    def __call__(self, seen: Rows, memory: Rows | None, time: float) -> NDArray[Any]:
        """Actions, a row an observation. Raises ValueError on other shapes than the spaces'."""
        _require_shape("the agent sees", seen, self.sees, "observation", "give observe=")
        predict = getattr(self.model, "predict", None)
        if predict is None:
            answer, state = _answer(self.model, seen), None
        else:
            answer, state = predict(seen, deterministic=True)
        if state is not None:
            raise ValueError(
                "the agent has a state of its own, expected one without: give em.Policy an act "
                "that keeps it in memory, a row a rollout"
            )
        actions = np.asarray(answer)
        _require_shape("the agent returned", actions, self.does, "action", "ask its own agent")
        return actions


@dataclass(frozen=True)
class Bounded:
    """Actions clipped to the bounds of their space, and then what they command."""

    low: Any
    high: Any
    convert: Callable[[Rows], ArrayLike] | None

    def __call__(self, actions: Rows) -> ArrayLike:
        """Commands, a row an action."""
        clipped = actions if self.low is None else np.clip(actions, self.low, self.high)
        return clipped if self.convert is None else self.convert(clipped)


def arguments_of(env: Any, model: Any, given: dict[str, Any]) -> dict[str, Any]:
    """Arguments of em.Policy: act, convert, command, observe and period; see from_gymnasium.

    `given` are those of the user, None where the environment is to say it.
    """
    inner = getattr(env, "unwrapped", None)
    if inner is None:
        raise ValueError(f"env is {shown(env)}, expected an environment of gymnasium")
    if hasattr(getattr(model, "policy", None), "predict"):
        model = model.policy  # of stable-baselines3: without its environment, which does not pickle
    if not callable(getattr(model, "predict", model)):
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
    act = Agent(model, env.observation_space.shape, space.shape)
    return {**known, "period": period, "act": act,
            "convert": Bounded(low, high, known.get("convert"))}  # fmt: skip


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
        raise ValueError(
            f"{who} rows of the shape {rows.shape[1:]}, expected {shape}, as the {space} space of "
            f"the environment says: {way_out}"
        )


def _answer(model: Any, seen: Rows) -> Any:
    """What a function returns, or a module of torch."""
    torch = sys.modules.get("torch")
    if torch is None or not isinstance(model, torch.nn.Module):
        return model(seen)
    like = next(model.parameters(), torch.zeros(()))
    with torch.no_grad():
        return model(torch.as_tensor(seen, dtype=like.dtype, device=like.device)).cpu().numpy()
