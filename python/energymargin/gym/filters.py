"""The best of k actions by their capture probabilities, under the same disturbances.

All candidates are asked with one seed, so they meet the same disturbances, draw by draw: common
random numbers. What they differ in is the action.

The policy's own action is kept unless another one is better by more than the statistical error. The
error is that of two independent shares, after Agresti and Caffo (2000), one-sided and shared out
over the candidates after Bonferroni. Common random numbers make the true error smaller, so the
filter errs towards the policy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from energymargin._core import CaptureProbability
from energymargin.checks import whole_number

__all__ = ["ActionFilter", "Choice", "Propose", "choose"]

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
        if not 0.5 <= self.confidence < 1:
            raise ValueError(f"confidence is {self.confidence!r}, expected from 0.5 to below 1")
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


@dataclass(frozen=True)
class Choice:
    """What the filter did in a step."""

    number: int
    """Of the chosen candidate; 0 is the policy's action."""
    probabilities: NDArray[np.float64]
    """Of the candidates, NaN of those that were not asked, shape (k,)."""


def choose(
    count: int, probability: Callable[[int], CaptureProbability], confidence: float
) -> Choice:
    """The best of `count` candidates by `probability(number)`; 0 unless another one is better by
    more than the statistical error.

    Candidates are asked until one is captured for certain, which none can exceed. Where even that
    would not be better by more than the error, the others are not asked.
    """
    probabilities = np.full(count, np.nan)
    first = probability(0)
    probabilities[0] = first.captured
    others = max(count - 1, 1)
    z = NormalDist().inv_cdf(1 - (1 - confidence) / others)
    if not _better(1.0, first.effective, first, z):
        return Choice(0, probabilities)
    best, highest = 0, first.captured
    for number in range(1, count):
        found = probability(number)
        probabilities[number] = found.captured
        if found.captured > highest and _better(found.captured, found.effective, first, z):
            best, highest = number, found.captured
        if highest == 1.0:
            break
    return Choice(best, probabilities)


def _better(share: float, size: float, than: CaptureProbability, z: float) -> bool:
    """Whether a share of `size` rollouts exceeds another by more than z standard errors."""
    ours, our_size = _adjusted(share, size)
    theirs, their_size = _adjusted(than.captured, than.effective)
    variance = ours * (1 - ours) / our_size + theirs * (1 - theirs) / their_size
    return bool(ours - theirs > z * np.sqrt(variance))


def _adjusted(share: float, size: float) -> tuple[float, float]:
    """With one success and one failure more (Agresti and Caffo)."""
    return (share * size + 1) / (size + 2), size + 2
