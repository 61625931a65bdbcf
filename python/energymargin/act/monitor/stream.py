"""The states of a stream that wait, and the threads that take them."""

from __future__ import annotations

import threading
import time as clock
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.base.reprs import Record

LONGEST_CLOSE = 0.2  # s


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
