"""An agent of an environment as a policy of its problems."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from energymargin.checks import shown
from energymargin.gym.channels import Channel
from energymargin.gym.environment import task_env
from energymargin.policies import Policy


def policy_of(env: gymnasium.Env[Any, Any], model: Any, **options: Any) -> Policy:
    """The policy that does in a problem what an agent does in an environment of this package.

    It is asked at each control step of the environment, and its actions are clipped to the
    bounds of the action space, as there.

    Args:
        env: an environment of a task all of whose drives are the agent's.
        model: an agent with `predict(observations, deterministic=True)`, as those of
            stable-baselines3, or a function of observations (n, s) that returns actions (n, m).
        options: delay, noise and name, as of em.Policy.

    Raises ValueError on another environment, on one whose script drives more, and on a model that
    is neither.
    """
    inner = task_env(env)
    driven = {channel.body or channel.joint for channel in inner.channels}
    script = inner.task.script(inner.params)
    others = sorted({*script.wrenches, *script.targets} - driven)
    if others:
        raise ValueError(
            f"env is of a task whose script drives {others[0]!r} too, expected one whose drives "
            "are all the agent's"
        )
    predict = getattr(model, "predict", None)
    if predict is None and not callable(model):
        raise ValueError(f"model is {shown(model)}, expected an agent with predict or a function")
    low, high = (np.array([getattr(c, end) for c in inner.channels]) for end in ("low", "high"))
    offset = np.array([channel.offset for channel in inner.channels])

    def act(
        seen: NDArray[np.float64], memory: NDArray[np.float64] | None, time: float
    ) -> NDArray[np.float64]:
        answer = model(seen) if predict is None else predict(seen, deterministic=True)[0]
        return np.asarray(np.clip(np.asarray(answer), low, high) + offset)

    command = [_name(channel) for channel in inner.channels]
    name = options.pop("name", None) or type(model).__name__
    return Policy(act, period=inner.control_step, command=command, name=name, **options)


def _name(channel: Channel) -> str:
    words = ("fx", "fy", "fz", "tx", "ty", "tz")
    return channel.joint or f"{channel.body}.{words[channel.axis]}"
