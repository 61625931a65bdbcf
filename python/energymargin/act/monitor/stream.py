"""A stream of states: the threads that take them, their pace, how they are scored, what is known of
each."""

from __future__ import annotations

import math
import threading
import time as clock
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, CaptureProbability
from energymargin.base.checks import positive_number, require, shown, whole_number
from energymargin.base.reprs import Record
from energymargin.disturbances import Disturbance, Uniform, text_of

SHARE = 0.7  # of a period that a score takes; the rest is for what else the machine does
MEMORY = 0.8  # of the mean cost, from one score to the next
FASTEST = 2.0  # times as many rollouts as before, at most

Rollouts = int | tuple[int, int]
LONGEST_CLOSE = 0.2  # s


@dataclass(frozen=True)
class Reading:
    """The score of one state of a stream."""

    time: float
    """Time of the state, as it was pushed [s]."""
    value: float
    """Probability of staying captured, or in the success set, over the problem's horizon; NaN with
    an `error`, or if more than one of its rollouts and more than 1 % of them diverged."""
    interval: tuple[float, float]
    """95 % interval of the value."""
    rollouts: int
    """Number of rollouts behind the value, without those that diverged; 0 of a first look."""
    trend: float
    """Slope of the values over the monitor's `trend_window` [1/s]; NaN with fewer than two."""
    alarm: bool
    """Whether the alarm is on."""
    lateness: float
    """From the push to the reading [s], by the machine's clock."""
    late: bool
    """Whether that is more than the monitor's `period`."""
    probability: CaptureProbability | None = field(default=None, repr=False)
    """The probability with its curve over time; None with an `error`, and of a first look."""
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
    foreseen: int = 0
    """Scored by the first look alone."""
    refused: int = 0
    """Unlike the states that the first look learned from, and left to rollouts."""


@dataclass(frozen=True, eq=False, repr=False)
class Pushed(Record):
    """A state that waits."""

    time: float
    state: NDArray[np.float64]
    came: float
    """By the machine's clock [s]."""
    cancel: Cancel
    """Set once nobody wants its score any more."""


Handle = weakref.WeakMethod[Callable[[Pushed], None]]


class Pace:
    """The number of rollouts of the next score: fixed, or as many as fit into a period.

    It is chosen before a score begins, from what those before it took. A score that was cut short
    in its course would count too few of the rollouts that last long, those that stay captured.
    """

    def __init__(self, rollouts: Rollouts, period: float) -> None:
        """`rollouts`: a number, or the least and the most; `period` [s].

        Raises ValueError on others.
        """
        self._least, self._most = _checked_rollouts(rollouts)
        self._budget = SHARE * period
        self._cost: float | None = None  # s, of a rollout, a running mean
        self.rollouts = self._least
        """Number of rollouts of the next score."""

    def note(self, rollouts: int, asking: float, scoring: float) -> None:
        """What a score took [s]: `asking` for the problem, and `scoring` its `rollouts`."""
        cost = scoring / max(rollouts, 1)
        mean = cost if self._cost is None else MEMORY * self._cost + (1 - MEMORY) * cost
        self._cost = mean
        fitting = int(max(self._budget - asking, 0.0) / max(mean, cost, 1e-9))
        wanted = min(fitting, int(FASTEST * self.rollouts))
        self.rollouts = min(max(wanted, self._least), self._most)


@dataclass(frozen=True)
class Conditions:
    """How the scores of a stream are made: a threshold from such scores holds for others like them.

    Raises ValueError on what cannot be.
    """

    rollouts: Rollouts
    """Rollouts of each score, as in Monitor."""
    horizon: float
    """Horizon of each question [s]."""
    period: float
    """Time between two states [s]."""
    disturbance: Any = None
    """Disturbance, as in `capture_probability`; None: Uniform()."""

    def __post_init__(self) -> None:
        """Checks them."""
        _checked_rollouts(self.rollouts)
        positive_number("horizon", self.horizon)
        positive_number("period", self.period)

    def require(self, rollouts: Rollouts, period: float, disturbance: Any) -> None:
        """Raises ValueError unless a monitor's scores are made like these."""
        self._require("rollouts", rollouts, rollouts == self.rollouts)
        self._require("period", period, _same(period, self.period))
        alike = _is_same_disturbance(disturbance, self.disturbance)
        self._require("disturbance", disturbance, alike)

    def require_horizon(self, horizon: float | None) -> None:
        """Raises ValueError unless a question's horizon [s] is this one."""
        alike = horizon is not None and _same(horizon, self.horizon)
        self._require("horizon", horizon, alike, of="the problem's ")

    def _require(self, name: str, value: Any, alike: bool, of: str = "") -> None:
        if not alike:
            holds = f"but the alarm's threshold holds for {shown(getattr(self, name))}"
            way = f"take that, or calibrate a threshold with scores of {shown(value)}"
            raise ValueError(f"{of}{name} is {shown(value)}, {holds}: {way}")


class Stream:
    """The states that wait, and the workers who wait for them.

    Workers hold their monitor only while they score: one that nobody else holds is freed.
    """

    def __init__(self, most_waiting: int) -> None:
        """Without workers. Beyond `most_waiting` states the oldest one goes."""
        self.changed = threading.Condition()
        self.waiting: deque[Pushed] = deque(maxlen=most_waiting)
        self.busy = 0
        self.cancel = Cancel()
        self.closed = False
        self.workers: list[threading.Thread] = []

    def start(self, count: int, handle: Handle) -> None:
        """So many workers, which `handle` states; RuntimeError, and none, without threads."""
        try:
            for k in range(count):
                name = f"energymargin monitor {k}"
                work = threading.Thread(target=_work, args=(self, handle), name=name, daemon=True)
                work.start()
                self.workers.append(work)
        except RuntimeError:
            self.end()
            raise

    def next(self) -> Pushed | None:
        """The newest state that waits, once there is one; None at the end."""
        with self.changed:
            self.changed.wait_for(lambda: self.waiting or self.closed)
            if self.closed:
                return None
            self.busy += 1
            return self.waiting.pop()

    def done(self) -> None:
        """A worker has no state any more."""
        with self.changed:
            self.busy -= 1
            self.changed.notify_all()

    def end(self) -> None:
        """Ends the workers within 0.2 s."""
        with self.changed:
            self.closed = True
            self.cancel.set()
            self.waiting.clear()
            self.changed.notify_all()
        end = clock.monotonic() + LONGEST_CLOSE
        for worker in self.workers:
            if worker is not threading.current_thread():
                worker.join(max(end - clock.monotonic(), 0.0))


def _work(stream: Stream, reference: Handle) -> None:
    while (pushed := stream.next()) is not None:
        try:
            if (handle := reference()) is not None:
                handle(pushed)
        finally:
            del handle  # before anybody hears that it is done
            stream.done()


def _checked_rollouts(rollouts: Rollouts) -> tuple[int, int]:
    """(least, most) of a number of rollouts, or of these two; ValueError on others."""
    ends = rollouts if isinstance(rollouts, tuple) else (rollouts, rollouts)
    require(len(ends) == 2, "rollouts", rollouts, "a number, or (least, most)")
    least = whole_number("rollouts", ends[0], 1)
    return least, whole_number("rollouts", ends[1], least)


def _same(first: float, second: float) -> bool:
    """Whether two times [s] are equal, but for their last digits."""
    return math.isclose(first, second, rel_tol=1e-6)


def _is_same_disturbance(first: Any, second: Any) -> bool:
    """Models are the same that say the same, functions that are one."""
    first, second = (Uniform() if one is None else one for one in (first, second))
    if isinstance(first, Disturbance) and isinstance(second, Disturbance):
        return text_of(first) == text_of(second)
    return first is second or bool(first == second)
