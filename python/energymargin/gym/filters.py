"""Other actions beside the policy's, among which the wrapper chooses by their probabilities.

How it chooses: energymargin/actions/choosing.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from energymargin.actions.choosing import check_confidence
from energymargin.checks import whole_number

__all__ = ["ActionFilter", "Propose"]

SPREAD = 0.25  # of the distance from the middle of the action space to its bounds

Propose = Callable[[gymnasium.Env[Any, Any], Any, np.random.Generator], Iterable[Any]]
"""Called with (env, action, random); returns actions beside the policy's."""


@dataclass(frozen=True)
class ActionFilter:
    """How the wrapper chooses among actions. Raises ValueError on numbers out of range."""

    candidates: int = 5
    """k: the policy's action, and k - 1 others with normal noise, clipped to the action space."""
    spread: ArrayLike | None = None
    """Standard deviation of the noise in the action's units, a number or an array of the action's
    shape; None: a quarter of the way from the middle of the action space to its bounds."""
    propose: Propose | None = None
    """In place of noise: a function (env, action, random) that returns the other actions, at most
    k - 1. `random` is the wrapper's Generator."""
    confidence: float = 0.95
    """With which another action has to be better than the policy's."""

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("candidates", self.candidates, 2)
        check_confidence(self.confidence)
        if self.spread is not None:
            spread = np.asarray(self.spread, dtype=float)
            if not (np.isfinite(spread).all() and (spread >= 0).all() and spread.any()):
                raise ValueError(f"spread is {self.spread!r}, expected numbers of at least 0")

    def check(self, space: spaces.Space[Any]) -> None:
        """Raises ValueError if an action space asks for a `spread` or a `propose`."""
        if self.propose is not None:
            return
        if not isinstance(space, spaces.Box):
            raise ValueError(
                f"propose is None, and the action space is {space}: noise needs a Box, expected a "
                "function (env, action, random) that returns other actions"
            )
        if self.spread is None and not space.is_bounded():
            raise ValueError(f"spread is None, expected a number, as {space} has no bounds")
        if self.spread is not None and np.shape(self.spread) not in ((), space.shape):
            raise ValueError(
                f"spread has shape {np.shape(self.spread)}, expected a number or {space.shape}"
            )

    def others(
        self, env: gymnasium.Env[Any, Any], action: Any, random: np.random.Generator
    ) -> list[Any]:
        """The candidates beside the policy's action."""
        if self.propose is not None:
            others = list(self.propose(env, action, random))
            if len(others) >= self.candidates:
                raise ValueError(
                    f"propose returned {len(others)} actions, expected at most "
                    f"{self.candidates - 1} beside the policy's"
                )
            return others
        space = env.action_space
        assert isinstance(space, spaces.Box)
        spread = SPREAD * (space.high - space.low) / 2 if self.spread is None else self.spread
        noise = random.normal(size=(self.candidates - 1, *space.shape)) * np.asarray(spread)
        clipped: NDArray[Any] = np.clip(action + noise, space.low, space.high)
        return list(clipped.astype(space.dtype))
