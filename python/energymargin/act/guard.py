"""A guard in front of a policy: where the margin is low, the safest of k actions or a fallback."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Cancel, Cancelled, Problem
from energymargin.act import choosing
from energymargin.act.choosing import Candidates, SafestAction
from energymargin.act.draws import check_disturbance
from energymargin.act.monitor import Monitor, Reading
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.closing import Closing
from energymargin.base.reprs import Record
from energymargin.evaluate.searches import SearchSettings

Chosen = Literal["policy", "candidate", "fallback"]
Reason = Literal["fine", "alarm", "unknown"]
UNKNOWN = ("fallback", "ask", "policy")

ProblemOfAction = Callable[[Floats, float, Any], Problem]
"""Called with (state, time, action); returns the problem at that state in which the robot takes
that action first."""

_log = logging.getLogger("energymargin.actions.guard")


@dataclass(frozen=True, eq=False, repr=False)
class Decision(Record):
    """One decision of a guard."""

    time: float
    """Time of the state [s]."""
    source: Chosen
    """Whose action it is."""
    reason: Reason
    """Why: the alarm is off ("fine") or on ("alarm"), or the margin is "unknown": no reading, one
    without a value, or one too old; or the policy's action is not finite."""
    action: Any = field(repr=False)
    """The action that the guard returned."""
    reading: Reading | None = field(repr=False)
    """The monitor's, on which it was decided; None if there was none yet."""
    probabilities: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0), repr=False)
    """Probabilities of staying captured after the policy's action, the candidates and last the
    fallback's, shape (k,), (0,) if none was asked; NaN of an action that was not asked, or of which
    too many rollouts diverged."""
    rollouts: int = 0
    """Rollouts spent on the actions, without the monitor's."""
    diverged: int = 0
    """Rollouts that diverged and do not count."""
    error: Exception | None = None
    """Why the actions have no probabilities, or what of the policy's action is not finite."""


class GuardCounters(NamedTuple):
    """Decisions since the guard began."""

    decisions: int
    policy: int
    """By source: the policy's action was taken."""
    candidate: int
    fallback: int
    alarm: int
    """By reason: the alarm was on."""
    unknown: int
    rollouts: int
    """Rollouts spent on actions, without the monitor's."""

    def after(self, decision: Decision) -> GuardCounters:
        """With one decision more."""
        counted = {"decisions", decision.source, decision.reason} - {"fine"}
        more = {name: getattr(self, name) + 1 for name in counted}
        return self._replace(**more, rollouts=self.rollouts + decision.rollouts)


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

    monitor: Monitor
    """The monitor."""
    last: Decision | None
    """The last decision; None before the first one and after `reset`."""
    counters: GuardCounters
    """Decisions since the guard began, by source and reason."""

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
        max_age: float | None = None,
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
            problem_of: a function (state, time, action) that returns the problem at that state in
                which the robot takes that action first; it has a horizon. None: no action is asked,
                and the fallback is taken while the alarm is on; confidence, rollouts and threads
                have no use, least and disturbance are refused.
            candidates: a function (observation, action, random) that returns other actions, such as
                Noise; None: only the policy's action and the fallback's are asked.
            confidence: with which another action has to be better than the policy's.
            least: probability that an action has to reach, or the fallback is taken.
            max_age: largest age of a reading, by the times of the states [s]: for a control loop,
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
        self._policy = checks.function_of("policy", policy, "observation")
        checks.check_type("monitor", monitor, Monitor, "an em.Monitor")
        if monitor.rule is None:
            raise ValueError("monitor has no alarm, expected one with alarm=")
        self.monitor = monitor
        self._fallback = checks.function_or_none("fallback", fallback, "observation")
        asked = ("state", "time", "action"), ("observation", "action", "random")
        self._problem_of = checks.function_or_none("problem_of", problem_of, *asked[0])
        self._candidates = checks.function_or_none("candidates", candidates, *asked[1])
        if candidates is None and fallback is None:
            raise ValueError("candidates and fallback are None, expected one of them at least")
        checks.share("confidence", confidence, choosing.LEAST_CONFIDENCE)
        right = checks.not_negative_number("least", least) <= 1
        checks.require(right, "least", least, "a probability, from 0 to 1")
        if least and fallback is None:
            raise ValueError(f"least is {least!r} without a fallback, expected 0 or a fallback")
        self._max_age = None if max_age is None else checks.not_negative_number("max_age", max_age)
        if unknown == "fallback" and fallback is None:
            raise ValueError("unknown is 'fallback' without a fallback, expected 'ask' or 'policy'")
        usual = "ask" if fallback is None else "fallback"
        self._unknown = checks.one_of("unknown", usual if unknown is None else unknown, UNKNOWN)
        check_disturbance(disturbance)
        asks = "ask" if self._unknown == "ask" else None
        of_use_with_it = {"candidates": candidates, "least": least or None, "unknown": asks}
        for name, value in {**of_use_with_it, "disturbance": disturbance}.items():
            if problem_of is None and value is not None:
                way = "expected a function (state, time, action) too"
                raise ValueError(f"{name} is {checks.shown(value)} without problem_of, {way}")
        self._settings = SearchSettings(rollouts=rollouts, seed=seed)
        self._cancel = Cancel()
        given = (disturbance, confidence, least, checks.core_count("threads", threads))
        self._safest = SafestAction(self._settings, *given, self._cancel)
        self._on_decision = checks.function_or_none("on_decision", on_decision, "decision")
        self._random = np.random.default_rng(self._settings.seed)
        self.last, self.counters = None, GuardCounters(0, 0, 0, 0, 0, 0, 0)

    def __call__(self, observation: Any, *, time: float, state: ArrayLike) -> Any:
        """The action to take at an observation, in the state of shape (n,) at a time [s].

        Raises ValueError on a state that is no vector, a time that does not rise (`reset` begins
        anew), or an action that is not finite, RuntimeError once the guard is closed.
        """
        self.monitor.push(time, state)
        if self._max_age is None:
            self.monitor.wait()
        action = self._policy(observation)
        decision = self._decided(float(time), np.array(state, dtype=float), observation, action)
        self.last = decision
        self.counters = self.counters.after(decision)
        if self._on_decision is not None:
            self._on_decision(decision)
        return decision.action

    def reset(self, seed: int | None = None) -> None:
        """A new trajectory begins, with another seed if one is given; counters go on."""
        if seed is not None:
            self._settings = SearchSettings(rollouts=self._settings.rollouts, seed=seed)
        self._random = np.random.default_rng(self._settings.seed)
        self.last = None
        self.monitor.reset()

    def close(self) -> None:
        """Closes the monitor, within 0.2 s. A call that asks its actions raises Cancelled."""
        self._cancel.set()
        self.monitor.close()

    def _decided(self, time: float, state: Floats, observation: Any, action: Any) -> Decision:
        reading = self.monitor.latest
        reason = self._reason(time, reading)
        decision = partial(Decision, time, reading=reading)
        try:
            choosing.require_finite("policy", action)
        except ValueError as error:
            if self._fallback is None:
                raise
            _log.warning("at %g s: %s", time, error)
            return decision("fallback", "unknown", self._fallback_action(observation), error=error)
        what = self._unknown if reason == "unknown" else "ask"
        if reason == "fine" or what == "policy":
            return decision("policy", reason, action)
        others = [] if self._fallback is None else [self._fallback_action(observation)]
        if self._problem_of is None or what == "fallback":
            return decision("fallback", reason, *others)
        try:
            more = choosing.candidates_of(self._candidates, observation, action, self._random)
            actions = [action, *more, *others]
            seed, last = int(self._random.integers(2**63)), len(actions) - 1
            problems = [partial(self._problem_of, state, time, one) for one in actions]
            choice = self._safest.of(problems, seed, last if others else 0)
        except (Cancelled, MemoryError):
            raise
        except Exception as error:
            if not others:
                raise
            _log.warning("the actions at %g s have no probabilities: %s", time, error)
            return decision("fallback", reason, *others, error=error)
        source: Chosen = "candidate" if choice.number else "policy"
        source = "fallback" if others and choice.number == last else source
        told = {name: one for name, one in vars(choice).items() if name != "number"}
        return decision(source, reason, actions[choice.number], **told)

    def _reason(self, time: float, reading: Reading | None) -> Reason:
        oldest = time - (self._max_age or 0.0)
        if reading is None or math.isnan(reading.value) or reading.time < oldest:
            return "unknown"
        return "alarm" if reading.alarm else "fine"

    def _fallback_action(self, observation: Any) -> Any:
        action = self._fallback(observation)
        choosing.require_finite("fallback", action)
        return action
