"""A wrapper that scores every state of an environment, of any simulator.

What the environment is about is the user's to say: `problem_of(env)` returns a Problem of the state
that `env` is in now. Everything else follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import nan
from typing import Any, Literal, TypeVar, get_args

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from energymargin._core import Problem
from energymargin.act import choosing
from energymargin.act.choosing import Candidates, Choice, Noise, SafestAction
from energymargin.act.draws import OF_ROLLOUTS
from energymargin.act.gym.environment import ScriptedFuture
from energymargin.base import checks
from energymargin.base.metrics import TIMED, check_metrics, is_likelihood
from energymargin.disturbances import Disturbance
from energymargin.evaluate.divergence import is_unknown
from energymargin.evaluate.searches import SearchSettings, chosen_metrics, metric_search, value_of
from energymargin.model.policies import Policy

Shaping = Literal["potential", "additive"]
OWN_STREAM = 0x636170747572  # so that the wrapper's draws are not the environment's
SPREAD = 0.25  # of noise, in half the width of the action space

ObsType = TypeVar("ObsType")
ActType = TypeVar("ActType")


ProblemOf = Callable[..., Problem | None]
"""Called with an environment, and for a filter with an action; returns the question about the
environment's state, or None where there is nothing to ask."""


class CaptureWrapper(gymnasium.Wrapper[ObsType, ActType, ObsType, ActType], RecordConstructorArgs):
    """Puts the score of each state into `info`, if asked into the reward, and filters actions.

    `info["capture"]` of `reset` and `step` has "score" and, of a probability, "low" and "high", its
    95 % interval, and "diverged", how many of its rollouts diverged and do not count. "score" is
    NaN where `problem_of` returned None, and where more than one rollout and more than 1 % of them
    diverged; the reward takes it as 0. With candidates `info["filter"]` of `step` has "chosen", the
    number of the candidate that was taken (0 is the policy's action), "changed", "probabilities"
    of the candidates, NaN of those that were not asked or whose rollouts diverged, and "diverged",
    how many of all did. `last_action` is the action that was taken.

    Random draws are the wrapper's own: they follow from the seed of `reset`, and the environment's
    are the same with the wrapper and without.
    """

    def __init__(
        self,
        env: gymnasium.Env[ObsType, ActType],
        problem_of: ProblemOf | None = None,
        *,
        policy: Any = None,
        metric: str | None = "probability",
        settings: SearchSettings | None = None,
        disturbance: Disturbance | None = None,
        reward_weight: float = 0.0,
        shaping: Shaping = "potential",
        discount: float = 0.99,
        candidates: Candidates | int | None = None,
        confidence: float = 0.95,
        threads: int | None = None,
    ) -> None:
        """Wraps an environment.

        Args:
            env: the environment.
            problem_of: a function of the environment that returns the Problem at the state that it
                is in, with a horizon for probabilities, or None where there is nothing to ask. It
                must not change the environment. With candidates it is also called with an action,
                as `problem_of(env, action)`: the problem at the same state, whose plan has the
                robot take that action first; with None the policy's action is taken. None:
                ScriptedFuture(), for environments of this package.
            policy: an em.Policy, or an agent that `em.Policy.from_gymnasium` takes: what the robot
                does in place of the problem's plan, from the state on; with candidates after the
                action, for which `problem_of` is then not asked. A memory begins with zeros.
            metric: of the score, one of those of `em.score`; None: no score.
            settings: rollouts, nodes, strength of the disturbance and so on of score and choice;
                its seed is not used. None is SearchSettings().
            disturbance: of probabilities, in place of that of the settings.
            reward_weight: w, of the score in the reward; 0 leaves the reward alone.
            shaping: "potential", w (discount x score of the new state - score of the old one) is
                added to the reward, and the score of a state that terminates is taken as 0: optimal
                policies stay optimal (Ng, Harada and Russell 1999). "additive", w x score of the
                new state is added: the score is an aim of its own.
            discount: gamma of the agent that learns, for "potential".
            candidates: the safest of the policy's action and of others is taken: a function
                (observation, action, random) that returns them, such as em.actions.Noise, or how
                many are drawn with noise of a quarter of the way from the middle of the action
                space to its bounds. None: the policy's action is taken.
            confidence: with which another action has to be better than the policy's.
            threads: of rollouts and searches; None takes all cores. Results do not depend on them.

        Raises ValueError on a bad argument: a metric that is no likelihood in the reward, a
        `problem_of` that takes no action with candidates.
        """
        given = {n: v for n, v in locals().items() if n not in ("self", "env", "__class__")}
        RecordConstructorArgs.__init__(self, _disable_deepcopy=True, **given)
        super().__init__(env)
        asked = ScriptedFuture() if problem_of is None else problem_of
        self._problem_of: Any = checks.function_of("problem_of", asked, "env")
        if policy is not None and not isinstance(policy, Policy):
            policy = Policy.from_gymnasium(env, policy)
        self._policy: Policy | None = policy
        if candidates is not None and policy is None:
            checks.function_of("problem_of", asked, "env", "action")
        check_metrics([metric or "probability"])
        self._metric = metric
        self._weight = checks.finite_number("reward_weight", reward_weight)
        if self._weight and (metric is None or not is_likelihood(metric)):
            why = "an effort may be infinite, and a force score has no bound"
            said = f"reward_weight is {reward_weight!r} with metric {metric!r}"
            raise ValueError(f"{said}, expected a likelihood in the reward: {why}")
        self._shaping = checks.one_of("shaping", shaping, get_args(Shaping))
        checks.require(0 <= discount <= 1, "discount", discount, "a number from 0 to 1")
        self._discount = float(discount)
        self._settings = SearchSettings() if settings is None else settings
        self._disturbance, self._threads = disturbance, checks.core_count("threads", threads)
        self._candidates: Candidates | None = None
        if callable(candidates):
            takes = ("observation", "action", "random")
            self._candidates = checks.function_of("candidates", candidates, *takes)
        elif candidates is not None:
            count = checks.whole_number("candidates", candidates, 1)
            self._candidates = _noise(count, env.action_space)
        checks.share("confidence", confidence, choosing.LEAST_CONFIDENCE)
        self._safest = SafestAction(self._settings, disturbance, confidence, threads=self._threads)
        self._random: np.random.Generator | None = None
        self._observation: ObsType | None = None
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
        self.last_action, self._observation = None, observation
        told = self._score()
        self._potential = _potential(told)
        return observation, {**info, **told}

    def step(self, action: ActType) -> tuple[ObsType, Any, bool, bool, dict[str, Any]]:
        """Takes the action, or a safer candidate, and scores the new state."""
        self._drawing()
        chosen, filtered = self._filtered(action)
        self.last_action = chosen
        observation, reward, terminated, truncated, info = self.env.step(chosen)
        self._observation = observation
        told = self._score()
        bonus = _potential(told)
        if self._shaping == "potential":
            before, self._potential = self._potential, 0.0 if terminated else bonus
            bonus = self._discount * self._potential - before
        if self._weight:
            reward = float(reward) + self._weight * bonus
        return observation, reward, terminated, truncated, {**info, **filtered, **told}

    def _score(self) -> dict[str, Any]:
        """The state's score, for `info`."""
        if self._metric is None:
            return {}
        problem, score = self._problem(), {"score": nan}
        if problem is not None:
            settings = replace(self._settings, seed=self._seed())
            asked: Any = {"disturbance": self._disturbance, "threads": self._threads}
            score = score_of(problem, self._metric, settings, **asked)
        return {"capture": score}

    def _problem(self, *action: Any) -> Any:
        """The Problem of the state, or of an action in it; None: there is nothing to ask."""
        if self._policy is None:
            return self._problem_of(self.env, *action)
        problem = self._problem_of(self.env)
        if problem is None:
            return None
        robot = self._policy.after(*action) if action else self._policy
        return problem.replace(plan=robot, horizon=problem.horizon)

    def _filtered(self, action: ActType) -> tuple[ActType, dict[str, Any]]:
        """The action to take, and how it was chosen, for `info`."""
        if self._candidates is None:
            return action, {}
        asked = (self._candidates, self._observation, action, self._drawing())
        actions, seed = [action, *choosing.candidates_of(*asked)], self._seed()
        problem, choice = self._problem(action), Choice(0, np.full(len(actions), nan))
        if problem is not None:
            others = (partial(self._problem, one) for one in actions[1:])
            choice = self._safest.of([lambda: problem, *others], seed)
        told: dict[str, Any] = {"chosen": choice.number, "changed": choice.number > 0}
        told |= {"probabilities": choice.probabilities, "diverged": choice.diverged}
        return actions[choice.number], {"filter": told}

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


def score_of(
    problem: Problem, metric: str, settings: SearchSettings, **asked: Any
) -> dict[str, float]:
    """ "score" and, of a probability, "low" and "high", the ends of its 95 % interval, and
    "diverged", how many of its rollouts diverged; NaN but for that one if too many did.

    `asked`: disturbance and threads. Raises ValueError on a problem that lacks what the metric asks
    about.
    """
    chosen_metrics([problem], [metric])
    settings = replace(settings, common_random_numbers=True)
    timed = OF_ROLLOUTS if metric in TIMED else {}
    found = metric_search(problem, metric, settings, 0, **asked, **timed)
    if metric not in TIMED:
        return {"score": value_of(metric, found)}
    score, low, high = nan, nan, nan
    if not is_unknown(found):
        score, (low, high) = value_of(metric, found), found.interval(which=TIMED[metric])
    return {"score": score, "low": low, "high": high, "diverged": found.diverged}


def _noise(count: int, space: spaces.Space[Any]) -> Noise:
    """So many candidates; ValueError on an action space without bounds."""
    if not (isinstance(space, spaces.Box) and space.is_bounded()):
        way = "expected a function (observation, action, random), such as em.actions.Noise"
        why = f"candidates is {count}, and the action space is {space}"
        raise ValueError(f"{why}: noise needs a Box with bounds, {way}")
    return Noise(count, SPREAD * (space.high - space.low) / 2, space.low, space.high)
