"""The states of a stream that wait, the threads that take them, and what is known of each."""

from __future__ import annotations

import threading
import time as clock
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel, CaptureProbability
from energymargin.base.reprs import Record

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
