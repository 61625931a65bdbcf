"""Scores of a stream of states, in the background and newest first."""

from __future__ import annotations

import bisect
import logging
import math
import threading
import time as clock
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin._core import Cancel, CaptureProbability, Problem, disturbances
from energymargin.act.draws import check_disturbance
from energymargin.act.monitor.alarm import Alarm, Threshold
from energymargin.act.monitor.stream import Counters, Pace, Pushed, Reading, Stream
from energymargin.base import checks
from energymargin.base.closing import Closing
from energymargin.evaluate.divergence import ANY, is_unknown
from energymargin.evaluate.futures import or_success
from energymargin.evaluate.searches import SearchSettings, metric_search

if TYPE_CHECKING:
    from energymargin.act.surrogates import Estimates

MOST_WORKERS = 256

_log = logging.getLogger("energymargin.monitor")

ProblemOf = Callable[[NDArray[np.float64], float], Problem]
"""Called with (state, time); returns the question about that state."""
FirstLook = Callable[[NDArray[np.float64], float], "Estimates"]
"""Called with (state, time); returns what a surrogate says of that state."""


class _Score(NamedTuple):
    """What came of a state, as in its Reading; a first look has no probability."""

    value: float = math.nan
    interval: tuple[float, float] = (math.nan, math.nan)
    rollouts: int = 0
    probability: CaptureProbability | None = None
    error: Exception | None = None


class Monitor(Closing):
    """Scores the states of a robot's loop in the background, at the rate that the machine holds.

    `push` returns at once. Workers take the newest state that waits; of those that wait too long
    the oldest is dropped. What a state's score says is a Reading: `latest`, `history`, or
    `on_reading`. Use it in a `with` statement, or `close` it; one that nobody holds any more ends.
    """

    rule: Alarm | None
    """When the alarm goes on and off; None if it never does."""

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
        first_look: FirstLook | None = None,
    ) -> None:
        """Starts the workers.

        Args:
            problem_of: a function (state, time) of a state, shape (n,), and its time [s] that
                returns the question about it: a problem with a horizon, and best with a plan, as
                `task.future` makes one. A state in its success set is not lost: what is asked is
                `or_success` of it.
            alarm: when the alarm goes on and off; a number is Alarm(on=number), None never. A
                threshold from data has to hold for this monitor's rollouts, period and disturbance.
                A problem with another horizon than the threshold's is a reading with an error.
            period: between two states [s]. A reading is late that comes longer after its push.
            rollouts: of each score; (least, most) takes as many as fit into a period.
            disturbance: as of `capture_probability`; None: Uniform().
            seed: of every score, so that two states meet the same disturbances.
            workers: states that are scored at once, at most 256.
            threads: of each score; None: all cores, shared by the workers.
            waiting: states that may wait for a worker.
            trend_window: time over which the trend is taken [s].
            kept: readings in `history`, at most.
            on_reading: called with each reading, by one worker at a time. It should be short.
            first_look: a function (state, time) that returns what an em.Surrogate says of the
                state. Where its interval is on one side of the alarm, from `off` on or below `on`,
                its value is the reading, without rollouts. An alarm is needed, and none of a
                threshold from data, which holds for rollouts.

        The value depends on state, seed and number of rollouts alone: the same bits on any machine.
        Raises ValueError on bad arguments.
        """
        self._problem_of: ProblemOf = checks.function_of("problem_of", problem_of, "state", "time")
        rule = alarm.alarm() if isinstance(alarm, Threshold) else alarm
        self.rule = rule if rule is None or isinstance(rule, Alarm) else Alarm(rule)
        self._period = checks.positive_number("period", period)
        self._pace = Pace(rollouts, self._period)
        check_disturbance(disturbance)
        self._disturbance = disturbances.Uniform() if disturbance is None else disturbance
        self._settings = SearchSettings(seed=seed, common_random_numbers=True)
        self._conditions = None if self.rule is None else self.rule.holds_for()
        if self._conditions is not None:
            self._conditions.require(rollouts, self._period, self._disturbance)
        of = ("state", "time")
        self._first_look: FirstLook | None = checks.function_or_none("first_look", first_look, *of)
        if first_look is not None and (self.rule is None or self.rule.from_data):
            given = "None" if self.rule is None else "a threshold from data"
            way = "a first look needs an alarm of a number of yours: Alarm(on=..., off=...)"
            raise ValueError(f"alarm is {given}, but {way}")
        count = checks.whole_number("workers", workers, 1, MOST_WORKERS)
        cores = checks.core_count("threads", threads)
        self._threads = cores if threads is not None else max(1, cores // count)
        most_waiting = checks.whole_number("waiting", waiting, 1)
        self._trend_window = checks.positive_number("trend_window", trend_window)
        self._kept = checks.whole_number("kept", kept, 1)
        self._on_reading = checks.function_or_none("on_reading", on_reading, "reading")

        self._stream = Stream(most_waiting)
        self._lock = self._stream.changed
        self._delivery = threading.RLock()  # readings come one after the other
        self._history: list[Reading] = []
        self._counts = Counters(0, 0, 0, 0, 0)
        self._last_error = ""
        self._newest = self._followed = -math.inf  # times of states: pushed, known to the alarm
        self._recent: deque[float] = deque(maxlen=1 if self.rule is None else self.rule.window)
        self._is_on = False
        # Also as the program ends: a worker in the core must not outlive the interpreter.
        self._end = weakref.finalize(self, self._stream.end)
        self._stream.start(count, weakref.WeakMethod(self.handle))

    def push(self, time: float, state: ArrayLike) -> None:
        """A new state, shape (n,), at its time [s]. It is copied, and never waited for.

        Raises ValueError on a state that is no vector, or a time that does not rise (`reset` begins
        anew), RuntimeError once the monitor is closed. A state that makes no problem is a reading
        with an error.
        """
        time = checks.finite_number("time", time)
        vector = np.array(state, dtype=float)
        if vector.ndim != 1:
            raise ValueError(f"state has shape {vector.shape}, expected (n,)")
        vector.setflags(write=False)
        with self._lock:
            if self._stream.closed:
                raise RuntimeError("the monitor is closed")
            if time <= self._newest:
                said = f"time is {time:g} s after {self._newest:g} s, expected it to rise"
                raise ValueError(f"{said}; reset() begins a new trajectory")
            self._newest = time
            waiting = self._stream.waiting
            self._count(pushed=1, dropped=int(len(waiting) == waiting.maxlen))
            waiting.append(Pushed(time, vector, clock.monotonic(), self._stream.cancel))
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
        return self._counts

    @property
    def alarm(self) -> bool:
        """Whether the alarm is on."""
        return self._is_on

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until no state waits and none is scored; whether that came within `timeout` [s]."""
        limit = None if timeout is None else checks.not_negative_number("timeout", timeout)
        stream = self._stream
        with self._lock:
            return self._lock.wait_for(lambda: not (stream.waiting or stream.busy), limit)

    def reset(self) -> None:
        """A new trajectory begins: forgets states that wait, readings, trend and alarm.

        Counters go on.
        """
        with self._lock:
            self._stream.cancel.set()
            self._stream.cancel = Cancel()
            self._drop()
            self._history.clear()
            self._newest = self._followed = -math.inf
            self._recent.clear()
            self._is_on = False

    def close(self) -> None:
        """Ends the workers within 0.2 s. States without a reading are dropped."""
        with self._lock:
            self._stream.closed = True
            self._drop()
        self._end()

    def _drop(self) -> None:
        """The states that wait."""
        self._count(dropped=len(self._stream.waiting))
        self._stream.waiting.clear()

    def _count(self, **more: int) -> None:
        counts = self._counts
        self._counts = counts._replace(**{n: getattr(counts, n) + more[n] for n in more})

    def handle(self, pushed: Pushed) -> None:
        """On a worker: scores a state, and delivers its reading."""
        self._deliver(pushed, self._score(pushed))

    def _foreseen(self, pushed: Pushed) -> _Score | None:
        """What a first look says, if it is on one side of the alarm."""
        if self._first_look is None or self.rule is None:
            return None
        found = self._first_look(pushed.state, pushed.time)
        if found.refused:
            with self._lock:
                self._count(refused=1)
            return None
        low, high = float(found.low), float(found.high)
        sure = high < self.rule.on or low >= self.rule.until
        return _Score(float(found.value), (low, high)) if sure else None

    def _score(self, pushed: Pushed) -> _Score:
        with self._lock:
            rollouts = self._pace.rollouts
        try:
            if (foreseen := self._foreseen(pushed)) is not None:
                return foreseen
            begun = clock.monotonic()
            problem = or_success(self._problem_of(pushed.state, pushed.time))
            if self._conditions is not None:
                self._conditions.require_horizon(problem.horizon)
            asked = clock.monotonic()
            settings = replace(self._settings, rollouts=rollouts)
            rules: Any = {"disturbance": self._disturbance, "most_diverged": ANY}
            where: Any = {"threads": self._threads, "cancel": pushed.cancel}
            found = metric_search(problem, "probability", settings, **rules, **where)
        except Exception as error:  # whatever it is, the next state may be better
            return _Score(error=error)
        with self._lock:
            self._pace.note(rollouts, asked - begun, clock.monotonic() - asked)
        if is_unknown(found):
            return _Score(probability=found)
        return _Score(float(found.captured), found.interval(), found.rollouts, found)

    def _deliver(self, pushed: Pushed, score: _Score) -> None:
        with self._delivery:
            with self._lock:
                if pushed.cancel.is_set:
                    self._count(dropped=1)
                    return
                reading = self._noted(pushed, score)
            try:
                if self._on_reading is not None:
                    self._on_reading(reading)
            except Exception as error:
                self._warn("on_reading failed", _text(error))
            if math.isnan(reading.value):
                diverged = f"{reading.diverged} of its rollouts diverged"
                why = diverged if reading.error is None else _text(reading.error)
                self._warn(f"the state at {reading.time:g} s has no score", why)

    def _noted(self, pushed: Pushed, score: _Score) -> Reading:
        """The reading, once alarm, history and counters know it."""
        lateness = clock.monotonic() - pushed.came
        late, trend = lateness > self._period, math.nan
        if math.isnan(score.value):
            self._count(failed=1)
        else:
            self._follow(pushed.time, score.value)
            trend = self._trend(pushed.time, score.value)
            self._count(scored=1, late=int(late), foreseen=int(score.probability is None))
        now: Any = {"trend": trend, "alarm": self._is_on, "lateness": lateness, "late": late}
        reading = Reading(pushed.time, **score._asdict(), **now)
        bisect.insort(self._history, reading, key=lambda known: known.time)
        del self._history[: -self._kept]
        return reading

    def _follow(self, time: float, value: float) -> None:
        """The alarm; an older state than the newest one changes nothing."""
        if time > self._followed and self.rule is not None:
            self._followed = time
            self._recent.append(value)
            self._is_on = self.rule.after(self._recent, is_on=self._is_on)

    def _trend(self, time: float, value: float) -> float:
        """Slope of the line of least squares through this value and those of the time before it
        [1/s]; NaN below two times."""
        first = time - self._trend_window
        near = [(r.time, r.value) for r in self._history if first <= r.time < time]
        t, y = np.array([*(one for one in near if not math.isnan(one[1])), (time, value)]).T
        if np.ptp(t) == 0:
            return math.nan
        t = t - t.mean()
        return float(t @ (y - y.mean()) / (t @ t))

    def _warn(self, what: str, text: str) -> None:
        """Logs a fault, and the same one again only after another."""
        if text != self._last_error:
            self._last_error = text
            _log.warning("%s: %s", what, text)


def _text(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
