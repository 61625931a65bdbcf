"""A wrapper that scores every state of an environment, of any simulator.

What the environment is about is the user's to say: `problem_of(env)` returns a Problem of the state
that `env` is in now. Everything else follows from it.
"""

from __future__ import annotations

import inspect
from typing import Any, Literal, Protocol, TypeVar

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from energymargin._core import CaptureProbability, Problem
from energymargin.actions.choosing import Choice, choose
from energymargin.checks import one_of, whole_number
from energymargin.gym.filters import ActionFilter
from energymargin.gym.scores import Disturbance, Scorer
from energymargin.metrics import is_likelihood
from energymargin.searches import SearchSettings

__all__ = ["SHAPINGS", "CaptureWrapper", "ProblemOf", "Shaping"]

Shaping = Literal["potential", "additive"]
SHAPINGS = ("potential", "additive")
OWN_STREAM = 0x636170747572  # so that the wrapper's draws are not the environment's

ObsType = TypeVar("ObsType")
ActType = TypeVar("ActType")


class ProblemOf(Protocol):
    """What the wrapper asks about the state that an environment is in."""

    def __call__(self, env: gymnasium.Env[Any, Any], /) -> Problem | None:
        """The problem at that state; None where there is nothing to ask."""
        ...


class CaptureWrapper(
    gymnasium.Wrapper[ObsType, ActType, ObsType, ActType],
    RecordConstructorArgs,
):
    """Puts the score of each state into `info`, if asked into the reward, and filters actions.

    `info["capture"]` of `reset` and `step` has "score" and, of a probability, "low" and "high", its
    95 % interval, and "diverged", how many of its rollouts diverged and do not count. "score" is
    NaN where `problem_of` returned None, and where more than one rollout and more than 1 % of them
    diverged; the reward takes it as 0. With a filter `info["filter"]` of `step` has "chosen", the
    number of the candidate that was taken (0 is the policy's action), "changed", "probabilities"
    of the candidates, NaN of those that were not asked or whose rollouts diverged, and "diverged",
    how many of all did. `last_action` is the action that was taken.

    Random draws are the wrapper's own: they follow from the seed of `reset`, and the environment's
    are the same with the wrapper and without.
    """

    def __init__(
        self,
        env: gymnasium.Env[ObsType, ActType],
        problem_of: ProblemOf,
        *,
        metric: str | None = "probability",
        settings: SearchSettings | None = None,
        disturbance: Disturbance | None = None,
        reward_weight: float = 0.0,
        shaping: Shaping = "potential",
        discount: float = 0.99,
        action_filter: ActionFilter | None = None,
        threads: int = 1,
    ) -> None:
        """Wraps an environment.

        Args:
            env: the environment.
            problem_of: a function of the environment that returns the Problem at the state that it
                is in, with a horizon for probabilities, or None where there is nothing to ask. It
                must not change the environment. With a filter it is also called with an action, as
                `problem_of(env, action)`: the problem at the same state, whose plan has the robot
                take that action first; with None the action is not filtered.
            metric: of the score, one of those of `em.score`; None: no score.
            settings: rollouts, nodes, strength of the disturbance and so on of score and filter;
                its seed is not used. None is SearchSettings().
            disturbance: of probabilities, in place of that of the settings.
            reward_weight: w, of the score in the reward; 0 leaves the reward alone.
            shaping: "potential", w (discount x score of the new state - score of the old one) is
                added to the reward, and the score of a state that terminates is taken as 0: optimal
                policies stay optimal (Ng, Harada and Russell 1999). "additive", w x score of the
                new state is added: the score is an aim of its own.
            discount: gamma of the agent that learns, for "potential".
            action_filter: how actions are filtered; None: they are not.
            threads: of rollouts and searches; results do not depend on them.

        Raises ValueError on a bad argument: a metric that is no likelihood in the reward, a
        `problem_of` that takes no action with a filter.
        """
        RecordConstructorArgs.__init__(
            self,
            _disable_deepcopy=True,
            problem_of=problem_of,
            metric=metric,
            settings=settings,
            disturbance=disturbance,
            reward_weight=reward_weight,
            shaping=shaping,
            discount=discount,
            action_filter=action_filter,
            threads=threads,
        )
        super().__init__(env)
        _check_problem_of(problem_of, action_filter)
        self._problem_of: Any = problem_of
        self._told = metric is not None
        self._weight = _checked_weight(reward_weight, metric)
        self._shaping = one_of("shaping", shaping, SHAPINGS)
        self._discount = _share("discount", discount)
        chosen = SearchSettings() if settings is None else settings
        workers = whole_number("threads", threads, 1)
        self._scorer = Scorer(metric or "probability", chosen, disturbance, workers)
        self._filter = action_filter
        if action_filter is not None:
            action_filter.check(env.action_space)
        self._random: np.random.Generator | None = None
        self._potential = 0.0
        self.last_action: ActType | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObsType, dict[str, Any]]:
        """As the environment's; a seed also starts the wrapper's own stream of draws."""
        observation, info = self.env.reset(seed=seed, options=options)
        if seed is not None or self._random is None:
            known = self.env.np_random_seed
            own = known if seed is None and known is not None and known >= 0 else seed
            self._random = np.random.default_rng(None if own is None else [own, OWN_STREAM])
        self.last_action = None
        told = self._score()
        self._potential = _potential(told)
        return observation, {**info, **told}

    def step(self, action: ActType) -> tuple[ObsType, Any, bool, bool, dict[str, Any]]:
        """Takes the action, or the one that the filter prefers, and scores the new state."""
        self._drawing()
        chosen, filtered = self._filtered(action)
        self.last_action = chosen
        observation, reward, terminated, truncated, info = self.env.step(chosen)
        told = self._score()
        if self._weight:
            reward = float(reward) + self._weight * self._bonus(told, terminated)
        return observation, reward, terminated, truncated, {**info, **filtered, **told}

    def _bonus(self, told: dict[str, Any], terminated: bool) -> float:
        """What the score adds to the reward, before its weight."""
        if self._shaping == "additive":
            return _potential(told)
        before, self._potential = self._potential, 0.0 if terminated else _potential(told)
        return self._discount * self._potential - before

    def _score(self) -> dict[str, Any]:
        """The state's score, for `info`."""
        if not self._told:
            return {}
        problem = self._problem_of(self.env)
        if problem is None:
            return {"capture": {"score": float("nan")}}
        return {"capture": self._scorer.tell(problem, self._seed())}

    def _filtered(self, action: ActType) -> tuple[ActType, dict[str, Any]]:
        """The action to take, and how it was chosen, for `info`."""
        if self._filter is None:
            return action, {}
        others = self._filter.others(self.env, action, self._drawing())
        candidates, seed = [action, *others], self._seed()
        problem = self._problem_of(self.env, action)
        asked: dict[int, CaptureProbability] = {}

        def probability(number: int) -> CaptureProbability:
            own = problem if number == 0 else self._problem_of(self.env, candidates[number])
            asked[number] = self._scorer.probability(own, seed)
            return asked[number]

        if problem is None:
            choice = Choice(0, np.full(len(candidates), np.nan))
        else:
            choice = choose(len(candidates), probability, self._filter.confidence)
        told = {
            "chosen": choice.number,
            "changed": choice.number > 0,
            "probabilities": choice.probabilities,
            "diverged": sum(found.diverged for found in asked.values()),
        }
        return candidates[choice.number], {"filter": told}

    def _seed(self) -> int:
        return int(self._drawing().integers(2**63))

    def _drawing(self) -> np.random.Generator:
        if self._random is None:
            raise ValueError("the environment has no state yet, expected reset() before step()")
        return self._random


def _potential(told: dict[str, Any]) -> float:
    """The score; 0 where there is none."""
    value = told.get("capture", {}).get("score", 0.0)
    return 0.0 if np.isnan(value) else float(value)


def _check_problem_of(problem_of: Any, action_filter: ActionFilter | None) -> None:
    if not callable(problem_of):
        raise ValueError(f"problem_of is {problem_of!r}, expected a function of an environment")
    try:
        signature = inspect.signature(problem_of)
    except (TypeError, ValueError):  # of some compiled functions
        return
    words = "env" if action_filter is None else "env, action"
    try:
        signature.bind("env")
        if action_filter is not None:
            signature.bind("env", "action")
    except TypeError as error:
        raise ValueError(
            f"problem_of takes {signature}, expected to be called as problem_of(env)"
            f"{'' if action_filter is None else f' and problem_of({words})'}"
        ) from error


def _checked_weight(weight: float, metric: str | None) -> float:
    number = float(weight)
    if not np.isfinite(number):
        raise ValueError(f"reward_weight is {weight!r}, expected a finite number")
    if number and (metric is None or not is_likelihood(metric)):
        raise ValueError(
            f"reward_weight is {weight!r} with metric {metric!r}, expected a likelihood in the "
            "reward: an effort may be infinite, and a force score has no bound"
        )
    return number


def _share(name: str, value: float) -> float:
    if 0 <= value <= 1:
        return float(value)
    raise ValueError(f"{name} is {value!r}, expected a number from 0 to 1")
