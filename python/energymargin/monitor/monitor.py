"""Scores of a stream of states, in the background and newest first."""

from __future__ import annotations

import atexit
import bisect
import contextlib
import logging
import math
import threading
import time as clock
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Cancel, CaptureProbability, Problem, disturbances
from energymargin.checks import (
    core_count,
    function_of,
    not_negative_number,
    positive_number,
    whole_number,
)
from energymargin.closing import Closing
from energymargin.divergence import ANY, is_unknown
from energymargin.monitor.alarm import Alarm, Threshold
from energymargin.monitor.conditions import Conditions, Pace
from energymargin.searches import SearchSettings, metric_search

LONGEST_CLOSE = 0.2  # s
UNKNOWN = (math.nan, math.nan)

_log = logging.getLogger("energymargin.monitor")

ProblemOf = Callable[[NDArray[np.float64], float], Problem]
"""Called with (state, time); returns the question about that state."""


@dataclass(frozen=True)
class Reading:
    """The score of one state of a stream."""

    time: float
    """Time of the state, as it was pushed [s]."""
    value: float
    """Probability of staying captured over the problem's horizon; NaN with an `error`, or if more
    than one of its rollouts and more than 1 % of them diverged."""
    interval: tuple[float, float]
    """95 % interval of the value."""
    rollouts: int
    """Number of rollouts behind the value, without those that diverged."""
    trend: float
    """Slope of the values over the monitor's `trend_window` [1/s]; NaN with fewer than two."""
    alarm: bool
    """Whether the alarm is on."""
    lateness: float
    """From the push to the reading [s], by the machine's clock."""
    late: bool
    """Whether that is more than the monitor's `period`."""
    probability: CaptureProbability | None = field(default=None, repr=False)
    """The probability with its curve over time; None with an `error`."""
    error: Exception | None = None
    """Why the state has no value: what `problem_of` or the score raised."""

    @property
    def diverged(self) -> int:
        """Rollouts that diverged, which do not count."""
        return 0 if self.probability is None else self.probability.diverged


class Counters(NamedTuple):
    """States of a stream since it began."""

    pushed: int
    scored: int
    dropped: int
    """Left out for newer ones, or by `reset` and `close`."""
    late: int
    """Scored, but later than a period after their push."""
    failed: int
    """Without a value."""


@dataclass(frozen=True, eq=False)
class _Pushed:
    """A state that waits."""

    time: float
    state: NDArray[np.float64]
    came: float
    """By the machine's clock [s]."""
    cancel: Cancel
    """Set once nobody wants its score any more."""


class Monitor(Closing):
    """Scores the states of a robot's loop in the background, at the rate that the machine holds.

    `push` returns at once. Workers take the newest state that waits; of those that wait too long
    the oldest is dropped. What a state's score says is a Reading: `latest`, `history`, or
    `on_reading`. Use it in a `with` statement, or `close` it.
    """

    def __init__(
        self,
        problem_of: ProblemOf,
        *,
        alarm: Alarm | Threshold | float | None = None,
        period: float = 1 / 30,
        rollouts: int | tuple[int, int] = 30,
        disturbance: Any = None,
        seed: int = 0,
        workers: int = 1,
        threads: int | None = None,
        waiting: int = 1,
        trend_window: float = 0.5,
        kept: int = 1000,
        on_reading: Callable[[Reading], object] | None = None,
    ) -> None:
        """Starts the workers.

        Args:
            problem_of: a function (state, time) of a state, shape (n,), and its time [s] that
                returns the question about it: a problem with a horizon, and best with a plan, as
                `task.future` makes one.
            alarm: when the alarm goes on and off; a number is Alarm(on=number), None never. A
                threshold from data has to hold for this monitor's rollouts, period and disturbance.
                A problem with another horizon than the threshold's is a reading with an error.
            period: between two states [s]. A reading is late that comes longer after its push.
            rollouts: of each score; (least, most) takes as many as fit into a period.
            disturbance: as of `capture_probability`; None: Uniform().
            seed: of every score, so that two states meet the same disturbances.
            workers: states that are scored at once.
            threads: of each score; None: all cores, shared by the workers.
            waiting: states that may wait for a worker.
            trend_window: time over which the trend is taken [s].
            kept: readings in `history`, at most.
            on_reading: called with each reading, by one worker at a time. It should be short.

        The value depends on state, seed and number of rollouts alone: the same bits on any machine.
        Raises ValueError on bad arguments.
        """
        self._problem_of: ProblemOf = function_of("problem_of", problem_of, "state", "time")
        self._alarm = _alarm_of(alarm)
        self._period = positive_number("period", period)
        self._pace = Pace(rollouts, self._period)
        self._disturbance = disturbances.Uniform() if disturbance is None else disturbance
        self._settings = SearchSettings(seed=seed, common_random_numbers=True)
        self._conditions = _conditions_of(self._alarm)
        if self._conditions is not None:
            self._conditions.require(rollouts, self._period, self._disturbance)
        count = whole_number("workers", workers, 1)
        self._threads = max(1, core_count("threads", threads) // (count if threads is None else 1))
        self._most_waiting = whole_number("waiting", waiting, 1)
        self._trend_window = positive_number("trend_window", trend_window)
        self._kept = whole_number("kept", kept, 1)
        if not (on_reading is None or callable(on_reading)):
            raise ValueError(f"on_reading is {on_reading!r}, expected a function of a Reading")
        self._on_reading = on_reading

        self._lock = threading.Condition()
        self._delivery = threading.RLock()  # readings come one after the other
        self._waiting: deque[_Pushed] = deque()
        self._busy = 0
        self._history: list[Reading] = []
        self._counts = Counters(0, 0, 0, 0, 0)
        self._cancel = Cancel()
        self._last_error = ""
        self._closed = False
        self._newest = self._followed = -math.inf  # times of states: pushed, known to the alarm
        self._recent: deque[float] = deque(maxlen=1 if self._alarm is None else self._alarm.window)
        self._is_on = False
        self._workers = [
            threading.Thread(target=self._work, name=f"energymargin monitor {k}", daemon=True)
            for k in range(count)
        ]
        for worker in self._workers:
            worker.start()
        atexit.register(self.close)  # a worker in the core must not outlive the interpreter

    def push(self, time: float, state: ArrayLike) -> None:
        """A new state, shape (n,), at its time [s]. It is copied, and never waited for.

        Raises ValueError on a state that is no vector, or a time that does not rise (`reset` begins
        anew), RuntimeError once the monitor is closed. A state that makes no problem is a reading
        with an error.
        """
        finite = False
        with contextlib.suppress(TypeError):
            finite = math.isfinite(time)
        if not finite:
            raise ValueError(f"time is {time!r}, expected a finite number")
        vector = np.array(state, dtype=float)
        if vector.ndim != 1:
            raise ValueError(f"state has shape {vector.shape}, expected (n,)")
        vector.setflags(write=False)
        with self._lock:
            if self._closed:
                raise RuntimeError("the monitor is closed")
            if time <= self._newest:
                raise ValueError(
                    f"time is {time:g} s after {self._newest:g} s, expected it to rise; reset() "
                    "begins a new trajectory"
                )
            self._newest = float(time)
            self._waiting.append(_Pushed(self._newest, vector, clock.monotonic(), self._cancel))
            self._count(pushed=1)
            if len(self._waiting) > self._most_waiting:
                self._waiting.popleft()
                self._count(dropped=1)
            self._lock.notify()

    @property
    def latest(self) -> Reading | None:
        """The reading of the newest state that has one."""
        with self._lock:
            return self._history[-1] if self._history else None

    @property
    def history(self) -> tuple[Reading, ...]:
        """The last readings, in the order of their times."""
        with self._lock:
            return tuple(self._history)

    @property
    def counters(self) -> Counters:
        """How many states came, and what became of them."""
        with self._lock:
            return self._counts

    @property
    def alarm(self) -> bool:
        """Whether the alarm is on."""
        with self._lock:
            return self._is_on

    @property
    def rule(self) -> Alarm | None:
        """When the alarm goes on and off; None if it never does."""
        return self._alarm

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until no state waits and none is scored; whether that came within `timeout` [s]."""
        limit = None if timeout is None else not_negative_number("timeout", timeout)
        with self._lock:
            return self._lock.wait_for(lambda: not (self._waiting or self._busy), limit)

    def reset(self) -> None:
        """A new trajectory begins: forgets states that wait, readings, trend and alarm.

        Counters go on.
        """
        with self._lock:
            self._cancel.set()
            self._cancel = Cancel()
            self._forget()

    def close(self) -> None:
        """Ends the workers within 0.2 s. States without a reading are dropped."""
        with self._lock:
            self._closed = True
            self._cancel.set()
            self._count(dropped=len(self._waiting))
            self._waiting.clear()
            self._lock.notify_all()
        end = clock.monotonic() + LONGEST_CLOSE
        for worker in self._workers:
            if worker is not threading.current_thread():
                worker.join(max(end - clock.monotonic(), 0.0))
        atexit.unregister(self.close)

    def _forget(self) -> None:
        self._count(dropped=len(self._waiting))
        self._waiting.clear()
        self._history.clear()
        self._newest = self._followed = -math.inf
        self._recent.clear()
        self._is_on = False

    def _count(self, **more: int) -> None:
        own = self._counts._asdict()
        self._counts = Counters(**own | {name: own[name] + more[name] for name in more})

    def _work(self) -> None:
        while (pushed := self._next()) is not None:
            try:
                self._deliver(pushed, self._score(pushed))
            finally:
                with self._lock:
                    self._busy -= 1
                    self._lock.notify_all()

    def _next(self) -> _Pushed | None:
        """The newest state that waits, once there is one; None at the end."""
        with self._lock:
            self._lock.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return None
            self._busy += 1
            return self._waiting.pop()

    def _score(self, pushed: _Pushed) -> CaptureProbability | Exception:
        begun = clock.monotonic()
        with self._lock:
            rollouts = self._pace.rollouts
        try:
            problem = self._problem_of(pushed.state, pushed.time)
            if self._conditions is not None:
                self._conditions.require_horizon(problem.horizon)
            asked = clock.monotonic()
            probability: CaptureProbability = metric_search(
                problem,
                "probability",
                replace(self._settings, rollouts=rollouts),
                disturbance=self._disturbance,
                threads=self._threads,
                cancel=pushed.cancel,
                most_diverged=ANY,
            )
        except Exception as error:  # whatever it is, the next state may be better
            return error
        with self._lock:
            self._pace.note(rollouts, asked - begun, clock.monotonic() - asked)
        return probability

    def _deliver(self, pushed: _Pushed, score: CaptureProbability | Exception) -> None:
        with self._delivery:
            with self._lock:
                if pushed.cancel.is_set:
                    self._count(dropped=1)
                    return
                reading = self._noted(pushed, score)
            self._call(reading)
            if math.isnan(reading.value):
                self._warn(f"the state at {reading.time:g} s has no score", _why(reading))

    def _noted(self, pushed: _Pushed, score: CaptureProbability | Exception) -> Reading:
        """The reading, once alarm, history and counters know it."""
        lateness = clock.monotonic() - pushed.came
        late = lateness > self._period
        unknown = (pushed.time, math.nan, UNKNOWN, 0, math.nan, self._is_on, lateness, late)
        if isinstance(score, Exception):
            reading = Reading(*unknown, error=score)
            self._count(failed=1)
        elif is_unknown(score):
            reading = Reading(*unknown, score)
            self._count(failed=1)
        else:
            value = float(score.captured)
            self._follow(pushed.time, value)
            reading = Reading(
                *(pushed.time, value, score.interval(), score.rollouts, math.nan),
                *(self._is_on, lateness, late, score),
            )
            reading = replace(reading, trend=self._trend(reading))
            self._count(scored=1, late=int(late))
        bisect.insort(self._history, reading, key=lambda known: known.time)
        del self._history[: -self._kept]
        return reading

    def _follow(self, time: float, value: float) -> None:
        """The alarm; an older state than the newest one changes nothing."""
        if time > self._followed:
            self._followed = time
            self._recent.append(value)
            if self._alarm is not None:
                self._is_on = self._alarm.after(self._recent, is_on=self._is_on)

    def _trend(self, reading: Reading) -> float:
        """Slope of this reading and those of the time before it [1/s]."""
        first = reading.time - self._trend_window
        near = [r for r in self._history if first <= r.time < reading.time]
        near = [r for r in near if not math.isnan(r.value)]
        near.append(reading)
        return _slope([r.time for r in near], [r.value for r in near])

    def _call(self, reading: Reading) -> None:
        if self._on_reading is None:
            return
        try:
            self._on_reading(reading)
        except Exception as error:
            self._warn("on_reading failed", _text(error))

    def _warn(self, what: str, text: str) -> None:
        """Logs a fault, and the same one again only after another."""
        if text != self._last_error:
            self._last_error = text
            _log.warning("%s: %s", what, text)


def _why(reading: Reading) -> str:
    """Why it has no value."""
    if reading.error is not None:
        return _text(reading.error)
    return f"{reading.diverged} of its rollouts diverged"


def _text(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def _alarm_of(alarm: Alarm | Threshold | float | None) -> Alarm | None:
    if isinstance(alarm, Threshold):
        return alarm.alarm()
    return alarm if alarm is None or isinstance(alarm, Alarm) else Alarm(alarm)


def _conditions_of(alarm: Alarm | None) -> Conditions | None:
    """What the threshold of an alarm holds for; None of an alarm without one. ValueError where that
    is not known."""
    if alarm is None or not alarm.from_data:
        return None
    if alarm.conditions is None:
        raise ValueError(
            f"alarm is of a threshold of {alarm.on:g} that does not say what it holds for, "
            "expected one of threshold(..., conditions=Conditions(rollouts, horizon, period))"
        )
    return alarm.conditions


def _slope(times: Sequence[float], values: Sequence[float]) -> float:
    """Slope of the line of least squares through values at times [s]; NaN below two times."""
    t, y = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 2 or np.ptp(t) == 0:
        return float("nan")
    t = t - t.mean()
    return float(t @ (y - y.mean()) / (t @ t))
