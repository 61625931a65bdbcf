"""The safest of k actions by the same draws: the rule of a guard and of a filter.

All actions are asked with one seed, so they meet the same disturbances, draw by draw: common random
numbers. What they differ in is the action.

The policy's own action is kept unless another one is better by more than the statistical error. The
error is that of two independent shares, after Agresti and Caffo (2000), one-sided and shared out
over the candidates after Bonferroni. Common random numbers make the true error smaller, so the
choice errs towards the policy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Cancel, Cancelled, CaptureProbability, Problem
from energymargin.act.candidates import check_alike
from energymargin.act.draws import OF_ROLLOUTS
from energymargin.base.checks import numbers_of, require, shown, whole_number
from energymargin.base.reprs import Record
from energymargin.evaluate.divergence import is_unknown
from energymargin.evaluate.searches import SearchSettings, metric_search

NUMBERS = "a number or an array of numbers"
LEAST_CONFIDENCE = 0.5  # in a choice; below it, a worse action would be taken

Candidates = Callable[[Any, Any, np.random.Generator], Iterable[Any]]
"""Called with (observation, action, random); returns actions beside the policy's."""


@dataclass(frozen=True)
class Noise:
    """The policy's action with normal noise; raises ValueError on numbers that cannot be.

    A function (observation, action, random), as `em.Guard` and `em.gym.CaptureWrapper` take for
    their candidates.
    """

    count: int
    """How many actions."""
    spread: ArrayLike
    """Standard deviation in the action's units, a number above 0; or an array of the action's
    shape, where some may be 0."""
    low: ArrayLike = -np.inf
    """Least action, a number or an array of the action's shape; others are clipped to it."""
    high: ArrayLike = np.inf
    """Greatest action, the same."""

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("count", self.count, 1)
        spread = numbers_of("spread", self.spread, NUMBERS)
        right = np.isfinite(spread).all() and (spread >= 0).all() and spread.any()
        expected = "a number above 0, or an array of numbers of at least 0 that are not all 0"
        require(right, "spread", self.spread, expected)
        low, high = numbers_of("low", self.low, NUMBERS), numbers_of("high", self.high, NUMBERS)
        if () not in (low.shape, high.shape) and low.shape != high.shape:
            raise ValueError(f"high has shape {high.shape}, expected that of low, {low.shape}")
        require((low < high).all(), "low", self.low, f"below high = {shown(self.high)}")

    def __call__(
        self, observation: Any, action: ArrayLike, random: np.random.Generator
    ) -> list[NDArray[Any]]:
        """`count` actions, each of the action's shape, and of its type if that is a float's.

        Raises ValueError on an action without numbers, or of another shape than the spread, low or
        high.
        """
        middle = numbers_of("action", action, NUMBERS)
        for name in ("spread", "low", "high"):
            shape = np.shape(getattr(self, name))
            if shape not in ((), middle.shape):
                expected = f"a number or the action's shape {middle.shape}"
                raise ValueError(f"{name} has shape {shape}, expected {expected}")
        noise = random.normal(size=(self.count, *middle.shape)) * np.asarray(self.spread)
        kind = np.asarray(action).dtype
        actions = np.clip(middle + noise, self.low, self.high)
        return list(actions.astype(kind) if kind.kind == "f" else actions)


@dataclass(frozen=True, eq=False, repr=False)
class Choice(Record):
    """Which action is taken."""

    number: int
    """Number of the chosen action; 0 is the policy's."""
    probabilities: NDArray[np.float64]
    """Probabilities of staying captured, shape (k,); NaN of an action that was not asked, or of
    which too many rollouts diverged."""
    rollouts: int = 0
    """Rollouts spent on all of them."""
    diverged: int = 0
    """Rollouts that diverged and do not count."""


@dataclass(frozen=True)
class SafestAction:
    """How actions are asked, and which one is taken."""

    settings: SearchSettings
    """Rollouts of each action, and the strength of the disturbance."""
    disturbance: Any = None
    """In place of that of the settings."""
    confidence: float = 0.95
    """With which another action has to be better than the policy's."""
    least: float | None = None
    """Probability that the action has to reach; None: it may even be unknown."""
    threads: int = 1
    cancel: Cancel | None = None

    def of(self, problems: Sequence[Callable[[], Problem]], seed: int, default: int = 0) -> Choice:
        """The choice among actions, by functions that make the problems in which the robot takes
        each of them, the policy's first.

        If the best one does not reach `least`, the most probable one is taken that does; if none
        does, that of the number `default`. Raises Cancelled once the cancel is set, ValueError on
        problems that would not meet the same disturbances for as long.
        """
        settings, asked = replace(self.settings, seed=seed), list[CaptureProbability]()
        made = list[tuple[str, Problem]]()
        rules: Any = OF_ROLLOUTS | {"disturbance": self.disturbance}
        where: Any = {"threads": self.threads, "cancel": self.cancel}

        @cache
        def probability(number: int) -> CaptureProbability:
            problem = problems[number]()
            made.append((f"the problem of action {number}", problem))
            check_alike("probability", dict([made[0], made[-1]]))
            found = metric_search(problem, "probability", settings, **rules, **where)
            if not found.complete:
                raise Cancelled("cancelled before an action was chosen")
            asked.append(found)
            return asked[-1]

        number, probabilities = choose(len(problems), probability, self.confidence)
        if self.least is not None and not probabilities[number] >= self.least:
            probabilities = np.array([_share_of(probability(k)) for k in range(len(problems))])
            known = np.nan_to_num(probabilities, nan=-1.0)
            number = int(np.argmax(known))
            if known[number] < self.least:
                number = default
        diverged = sum(found.diverged for found in asked)
        return Choice(number, probabilities, self.settings.rollouts * len(asked), diverged)


def choose(
    count: int, probability: Callable[[int], CaptureProbability], confidence: float
) -> tuple[int, NDArray[np.float64]]:
    """The number of the best of `count` actions by `probability(number)`, and the probabilities of
    all, NaN of those that were not asked. It is 0 unless another one is better by more than the
    statistical error.

    Actions are asked until one is captured for certain, which none can exceed. Where even that
    would not be better by more than the error, the others are not asked. Nor are they where the
    policy's probability is unknown, since too many of its rollouts diverged.
    """
    probabilities = np.full(count, np.nan)
    first = probability(0)
    probabilities[0] = _share_of(first)
    z = NormalDist().inv_cdf(1 - (1 - confidence) / max(count - 1, 1))
    if is_unknown(first) or not _better(1.0, first.effective, first, z):
        return 0, probabilities
    best, highest = 0, first.captured
    for number in range(1, count):
        found = probability(number)
        probabilities[number] = share = _share_of(found)
        if share > highest and _better(share, found.effective, first, z):
            best, highest = number, share
        if highest == 1.0:
            break
    return best, probabilities


def candidates_of(
    candidates: Candidates | None, observation: Any, action: Any, random: np.random.Generator
) -> list[Any]:
    """The actions beside the policy's; ValueError on what are none, or not finite."""
    if candidates is None:
        return []
    returned: Any = candidates(observation, action, random)
    if not isinstance(returned, Iterable):
        expected = "expected actions, such as a list of them"
        raise ValueError(f"candidates returned {shown(returned)}, {expected}")
    others = list(returned)
    for other in others:
        require_finite("candidates", other)
    return others


def require_finite(name: str, action: Any) -> None:
    """Raises ValueError on a float, or an array of floats, with NaN or infinity."""
    if isinstance(action, (float, np.floating, np.ndarray)):
        numbers = np.asarray(action)
        right = numbers.dtype.kind != "f" or np.isfinite(numbers).all()
        require(right, f"an action of {name}", action, "finite numbers")


def _share_of(found: CaptureProbability) -> float:
    """The probability of staying captured; NaN if too many rollouts diverged."""
    return float("nan") if is_unknown(found) else float(found.captured)


def _better(share: float, size: float, than: CaptureProbability, z: float) -> bool:
    """Whether a share of `size` rollouts exceeds another by more than z standard errors, each with
    one success and one failure more (Agresti and Caffo)."""
    shares, sizes = np.array([share, than.captured]), np.array([size, than.effective])
    shares, sizes = (shares * sizes + 1) / (sizes + 2), sizes + 2
    return bool(shares[0] - shares[1] > z * np.sqrt((shares * (1 - shares) / sizes).sum()))
