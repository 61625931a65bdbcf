"""A guard in front of a policy: where the margin is low, the safest of k actions or a fallback."""

from __future__ import annotations

import inspect
import logging
import math
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin import disturbances
from energymargin._core import Cancel, Cancelled, CaptureProbability, Problem
from energymargin.actions.choosing import check_confidence, choose, share_of
from energymargin.actions.decisions import Decision, GuardCounters, Reason, Source
from energymargin.arguments import shown
from energymargin.checks import not_negative_number, one_of, whole_number
from energymargin.closing import Closing
from energymargin.divergence import ANY
from energymargin.executors.threads import thread_count
from energymargin.monitor import Monitor, Reading
from energymargin.searches import SearchSettings, metric_search

__all__ = ["Candidates", "Guard", "ProblemOfAction"]

UNKNOWN = ("fallback", "ask", "policy")

ProblemOfAction = Callable[[float, NDArray[np.float64], Any], Problem]
"""Called with (time, state, action); returns the problem at that state in which the robot takes
that action first."""
Candidates = Callable[[Any, Any, np.random.Generator], Iterable[Any]]
"""Called with (observation, action, random); returns actions beside the policy's."""

_log = logging.getLogger("energymargin.actions.guard")
_NONE = np.zeros(0)


class _Moment(NamedTuple):
    """When a call decides, and on what."""

    time: float
    reason: Reason
    reading: Reading | None


class Guard(Closing):
    """Lets a policy's actions pass while the margin is fine, and takes the safest one otherwise.

    `guard(observation, time=, state=)` shows the state to the monitor. While the alarm is off it
    returns the policy's action, the same object. While it is on, the policy's action, candidates
    and the fallback's are asked under the same disturbances. Another action is taken if it is
    better than the policy's by more than the statistical error. If the one taken does not reach
    `least`, or its probability is unknown as too many of its rollouts diverged, the most probable
    one that does is taken; if none does, the fallback.

    No action of floats with NaN or infinity is returned. If the policy's is one, the margin counts
    as unknown and the fallback is taken, whatever `unknown` is; without a fallback it is a
    ValueError. Actions that are no floats and no arrays pass unread.

    Call it from one thread. `last` and `counters` may be read from any, and `close` called. Ctrl-C
    ends a call within 0.2 s. Use it in a `with` statement, or `close` it: it closes its monitor.
    """

    def __init__(
        self,
        policy: Callable[[Any], Any],
        monitor: Monitor,
        fallback: Callable[[Any], Any] | None = None,
        *,
        problem_of: ProblemOfAction | None = None,
        candidates: Candidates | None = None,
        confidence: float = 0.95,
        least: float = 0.0,
        stale: float | None = None,
        unknown: Literal["fallback", "ask", "policy"] | None = None,
        rollouts: int = 30,
        disturbance: Any = None,
        seed: int = 0,
        threads: int | None = None,
        on_decision: Callable[[Decision], object] | None = None,
    ) -> None:
        """A guard of a policy.

        Args:
            policy: a function of an observation that returns an action. It is called in each step.
            monitor: with an alarm. The guard pushes the states, nobody else does.
            fallback: a function of an observation that returns an action, such as to stop, to hold
                or to retreat. With problem_of it is asked with the candidates, and taken where it
                is the safest, where none reaches `least`, where the margin is unknown, and where
                asking fails. It is called where it may be taken; what it raises comes out.
            problem_of: a function (time, state, action) that returns the problem at that state in
                which the robot takes that action first; it has a horizon. None: no action is asked,
                and the fallback is taken while the alarm is on; confidence, rollouts and threads
                have no use, least and disturbance are refused.
            candidates: a function (observation, action, random) that returns other actions, such as
                Noise; None: only the policy's action and the fallback's are asked.
            confidence: with which another action has to be better than the policy's.
            least: probability that an action has to reach, or the fallback is taken.
            stale: how old a reading may be, by the times of the states [s]: for a control loop,
                which never waits for the monitor. None: each call waits for the reading of its own
                state, so that a simulation is the same in every run.
            unknown: what happens without a reading, or with one that failed or is too old:
                "fallback", "ask" the actions as if the alarm were on, or "policy". None: "fallback"
                if there is one, else "ask".
            rollouts: of each action that is asked. Few rollouts have a large error, which even an
                action that is always captured may not exceed: then the policy's is kept, and no
                other is asked. With 3 other actions and a confidence of 0.95 that is so from a
                probability of 0.25 on with 4 rollouts, from 0.83 on with 30. `least` still holds.
            disturbance: as of `capture_probability`, a model of em.disturbances or a function
                (random, times); None: Uniform().
            seed: of candidates and disturbances.
            threads: of the rollouts of an action; None: all cores. Results do not depend on them.
            on_decision: called with each Decision. What it raises comes out of the call.

        If `candidates`, `problem_of` or its score fails, the fallback is taken and `last.error`
        says why; without a fallback the error is raised. Raises ValueError on bad arguments.
        """
        self._policy = _function("policy", policy, "observation")
        self._monitor = _with_alarm(monitor)
        self._fallback = (
            None if fallback is None else _function("fallback", fallback, "observation")
        )
        self._problem_of = (
            None
            if problem_of is None
            else _function("problem_of", problem_of, "time", "state", "action")
        )
        if problem_of is None and (fallback is None or candidates is not None):
            raise ValueError(
                "problem_of is None, expected a function (time, state, action), or a fallback and "
                "no candidates"
            )
        self._candidates = (
            None
            if candidates is None
            else _function("candidates", candidates, "observation", "action", "random")
        )
        if candidates is None and fallback is None:
            raise ValueError("candidates and fallback are None, expected one of them at least")
        check_confidence(confidence)
        self._confidence = float(confidence)
        self._least = not_negative_number("least", least)
        if self._least > 1:
            raise ValueError(f"least is {least!r}, expected a probability, from 0 to 1")
        if self._least and fallback is None:
            raise ValueError(f"least is {least!r} without a fallback, expected 0 or a fallback")
        if self._least and problem_of is None:
            raise ValueError(f"least is {least!r} without problem_of, expected 0 or a problem_of")
        self._stale = None if stale is None else not_negative_number("stale", stale)
        self._unknown = _checked_unknown(unknown, fallback)
        if problem_of is None and self._unknown == "ask":
            raise ValueError("unknown is 'ask' without problem_of, expected 'fallback' or 'policy'")
        self._rollouts = whole_number("rollouts", rollouts, 1)
        if disturbance is not None and problem_of is None:
            raise ValueError(
                f"disturbance is {shown(disturbance)} without problem_of, expected None or a "
                "problem_of"
            )
        self._disturbance = _checked_disturbance(disturbance)
        self._seed = whole_number("seed", seed, 0, 2**64 - 1)
        self._threads = thread_count(threads)
        self._on_decision = (
            None if on_decision is None else _function("on_decision", on_decision, "decision")
        )
        self._random = np.random.default_rng(self._seed)
        self._cancel = Cancel()
        self._last: Decision | None = None
        self._counters = GuardCounters(0, 0, 0, 0, 0, 0, 0)

    @property
    def monitor(self) -> Monitor:
        """The monitor."""
        return self._monitor

    @property
    def last(self) -> Decision | None:
        """The last decision; None before the first one and after `reset`."""
        return self._last

    @property
    def counters(self) -> GuardCounters:
        """Decisions since the guard began, by source and reason."""
        return self._counters

    def __call__(self, observation: Any, *, time: float, state: ArrayLike) -> Any:
        """The action to take at an observation, in the state of shape (n,) at a time [s].

        Raises ValueError on a state that is no vector, a time that does not rise (`reset` begins
        anew), or an action that is not finite, RuntimeError once the guard is closed.
        """
        seconds = _checked_time(time)
        self._monitor.push(seconds, state)
        if self._stale is None:
            self._monitor.wait()
        action = self._policy(observation)
        reading = self._monitor.latest
        now = _Moment(seconds, self._reason(seconds, reading), reading)
        fault = _not_finite("policy", action)
        if fault is not None:
            decision = self._without_policy(observation, now, fault)
        elif now.reason == "fine" or (now.reason == "unknown" and self._unknown == "policy"):
            decision = Decision(seconds, "policy", now.reason, action, reading, _NONE)
        elif self._problem_of is None or (now.reason == "unknown" and self._unknown == "fallback"):
            taken = self._fallback_action(observation)
            decision = Decision(seconds, "fallback", now.reason, taken, reading, _NONE)
        else:
            decision = self._asked(observation, action, now, np.array(state, dtype=float))
        self._last = decision
        self._counters = self._counters.after(decision)
        if self._on_decision is not None:
            self._on_decision(decision)
        return decision.action

    def reset(self, seed: int | None = None) -> None:
        """A new trajectory begins, with another seed if one is given; counters go on."""
        if seed is not None:
            self._seed = whole_number("seed", seed, 0, 2**64 - 1)
        self._random = np.random.default_rng(self._seed)
        self._last = None
        self._monitor.reset()

    def close(self) -> None:
        """Closes the monitor, within 0.2 s. A call that asks its actions raises Cancelled."""
        self._cancel.set()
        self._monitor.close()

    def _reason(self, time: float, reading: Reading | None) -> Reason:
        oldest = time - (self._stale or 0.0)
        if reading is None or math.isnan(reading.value) or reading.time < oldest:
            return "unknown"
        return "alarm" if reading.alarm else "fine"

    def _without_policy(self, observation: Any, now: _Moment, fault: ValueError) -> Decision:
        """The fallback in place of a policy's action that is not finite."""
        if self._fallback is None:
            raise fault
        _log.warning("at %g s: %s", now.time, fault)
        taken = self._fallback_action(observation)
        return Decision(now.time, "fallback", "unknown", taken, now.reading, _NONE, error=fault)

    def _asked(
        self, observation: Any, action: Any, now: _Moment, state: NDArray[np.float64]
    ) -> Decision:
        """The decision among the policy's action, the candidates, and last the fallback's."""
        last = [] if self._fallback is None else [self._fallback_action(observation)]
        try:
            actions = [action, *self._others(observation, action), *last]
            number, probabilities, asked = self._safest(now.time, state, actions)
        except (Cancelled, MemoryError):
            raise
        except Exception as error:
            if not last:
                raise
            _log.warning("the actions at %g s have no probabilities: %s", now.time, error)
            return Decision(
                *(now.time, "fallback", now.reason, last[0], now.reading, _NONE), error=error
            )
        source = self._source(number, len(actions))
        return Decision(
            *(now.time, source, now.reason, actions[number], now.reading),
            *(probabilities, self._rollouts * len(asked)),
            diverged=sum(found.diverged for found in asked),
        )

    def _others(self, observation: Any, action: Any) -> list[Any]:
        """The candidates."""
        if self._candidates is None:
            return []
        returned = self._candidates(observation, action, self._random)
        try:
            iterator = iter(returned)
        except TypeError as error:
            raise ValueError(
                f"candidates returned {shown(returned)}, expected actions, such as a list of them"
            ) from error
        others = list(iterator)
        for other in others:
            fault = _not_finite("candidates", other)
            if fault is not None:
                raise fault
        return others

    def _safest(
        self, time: float, state: NDArray[np.float64], actions: list[Any]
    ) -> tuple[int, NDArray[np.float64], list[CaptureProbability]]:
        """The number of the action to take, the probabilities of all, and those that were asked."""
        seed = int(self._random.integers(2**63))
        problem_of = self._problem_of
        assert problem_of is not None  # without it no action is asked

        asked: dict[int, CaptureProbability] = {}

        def probability(number: int) -> CaptureProbability:
            if number in asked:
                return asked[number]
            found: CaptureProbability = metric_search(
                problem_of(time, state, actions[number]),
                "probability",
                SearchSettings(rollouts=self._rollouts, seed=seed),
                disturbance=self._disturbance,
                threads=self._threads,
                undisturbed=False,
                most_diverged=ANY,
                cancel=self._cancel,
            )
            if not found.complete:
                raise Cancelled("the guard was closed")
            asked[number] = found
            return found

        choice = choose(len(actions), probability, self._confidence)
        number, probabilities = choice.number, choice.probabilities
        if not probabilities[number] >= self._least:  # also where it is unknown
            probabilities = np.array([share_of(probability(k)) for k in range(len(actions))])
            known = np.nan_to_num(probabilities, nan=-1.0)
            number = int(np.argmax(known))
            if known[number] < self._least:
                number = 0 if self._fallback is None else len(actions) - 1
        return number, probabilities, list(asked.values())

    def _source(self, number: int, count: int) -> Source:
        if number == 0:
            return "policy"
        is_last = self._fallback is not None and number == count - 1
        return "fallback" if is_last else "candidate"

    def _fallback_action(self, observation: Any) -> Any:
        assert self._fallback is not None  # "fallback" is refused without one
        action = self._fallback(observation)
        fault = _not_finite("fallback", action)
        if fault is not None:
            raise fault
        return action


def _function(name: str, value: Any, *arguments: str) -> Any:
    """The value; ValueError unless it is called with so many arguments."""
    expected = f"expected a function ({', '.join(arguments)})"
    if not callable(value):
        raise ValueError(f"{name} is {value!r}, {expected}")
    try:
        signature = inspect.signature(value)
    except (TypeError, ValueError):  # of some compiled functions
        return value
    try:
        signature.bind(*arguments)
    except TypeError as error:
        raise ValueError(f"{name} takes {signature}, {expected}") from error
    return value


def _with_alarm(monitor: Monitor) -> Monitor:
    if not isinstance(monitor, Monitor):
        raise ValueError(f"monitor is {monitor!r}, expected an em.Monitor")
    if monitor.rule is None:
        raise ValueError("monitor has no alarm, expected one with alarm=")
    return monitor


def _checked_time(time: float) -> float:
    try:
        finite = math.isfinite(time)
    except TypeError:
        finite = False
    if not finite:
        raise ValueError(f"time is {shown(time)}, expected a finite number")
    return float(time)


def _not_finite(name: str, action: Any) -> ValueError | None:
    """The fault of a float, or an array of floats, with NaN or infinity."""
    if not isinstance(action, (float, np.floating, np.ndarray)):
        return None
    numbers = np.asarray(action)
    if numbers.dtype.kind != "f" or np.isfinite(numbers).all():
        return None
    return ValueError(f"an action of {name} is {shown(action)}, expected finite numbers")


def _checked_disturbance(disturbance: Any) -> Any:
    if disturbance is None:
        return disturbances.Uniform()
    if isinstance(disturbance, disturbances.Disturbance):
        return disturbance
    if not callable(disturbance) or isinstance(disturbance, type):
        raise ValueError(
            f"disturbance is {shown(disturbance)}, expected a model of em.disturbances or a "
            "function (random, times)"
        )
    return _function("disturbance", disturbance, "random", "times")


def _checked_unknown(unknown: str | None, fallback: object) -> str:
    if unknown is None:
        return "ask" if fallback is None else "fallback"
    if unknown == "fallback" and fallback is None:
        raise ValueError("unknown is 'fallback' without a fallback, expected 'ask' or 'policy'")
    return one_of("unknown", unknown, UNKNOWN)
