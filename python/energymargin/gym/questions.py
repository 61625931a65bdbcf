"""`problem_of` for the environments of this package: what the wrapper asks about a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from energymargin._core import Problem
from energymargin.gym.environment import TaskEnv

__all__ = ["ScriptedFuture", "present"]


@dataclass(frozen=True)
class ScriptedFuture:
    """Does it stay captured over a horizon, while the robot follows the task's script?

    For environments of `TaskEnv`. With an action the robot holds that first: the question of a
    filter. Raises ValueError when it is asked about another environment.
    """

    horizon: float = 0.5
    """[s]"""
    hold: float | None = None
    """For how long the action is held [s]; None: for a control step."""

    def __call__(
        self, env: gymnasium.Env[Any, Any], action: NDArray[np.float64] | None = None
    ) -> Problem:
        """The problem of the state that the environment is in."""
        return _task_env(env).future(self.horizon, action, self.hold)


def present(env: gymnasium.Env[Any, Any]) -> Problem:
    """The question without a clock, for the capture score, efforts and the force score.

    For environments of `TaskEnv`; raises ValueError on another.
    """
    return _task_env(env).present()


def _task_env(env: gymnasium.Env[Any, Any]) -> TaskEnv:
    inner = env.unwrapped
    if not isinstance(inner, TaskEnv):
        raise ValueError(
            f"env is {env}, expected one of energymargin; for another write problem_of(env), "
            "which returns a Problem of its state"
        )
    return inner
