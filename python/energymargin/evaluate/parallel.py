"""Items go out to workers in chunks, and their results come back as they are done."""

from __future__ import annotations

import pickle
import threading
import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future, wait
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, ClassVar

from energymargin._core import Cancel
from energymargin.base.closing import Closing
from energymargin.base.errors import ExecutorError
from energymargin.evaluate.searches import algorithm

POLL = 0.05  # s; how long a stop may stay unnoticed
TAKE = 0.1  # s; how long items are taken before the workers get them
LAST = 0.1  # s; how long a stop waits for results that are finished
GRACE = 0.1  # s; so long after the limit of a call a worker elsewhere ends what it has begun
MOST = 1000  # items of a chunk
CHUNKS_A_SECOND = 200  # of a large cluster, whose scheduler has no time for more
NEWEST = 0.2  # weight of the newest chunk in how long an item takes

Function = Callable[[Sequence[Any], Cancel], Sequence[Any]]
"""Results of some items, in their order. Once the cancel is set it returns early, with those of the
first ones, or raises."""
Done = tuple[Sequence[Any], float, bool]
"""Results of a chunk, for how long a worker was at it [s], and whether it was cancelled."""


@dataclass(frozen=True, eq=False)
class Chunk:
    """Items for a worker. To unpickle it is to do its work, so that a cluster's scheduler needs no
    energymargin to hand it on."""

    function: Function
    items: Sequence[Any]
    left: float | None
    """Time until the limit of the call [s], None without one."""

    def work(self, cancel: Cancel) -> Done:
        """What a worker does with it."""
        start = time.perf_counter()
        results = self.function(self.items, cancel)
        return results, time.perf_counter() - start, cancel.is_set

    def __reduce__(self) -> tuple[Callable[..., Done], tuple[Any, ...]]:
        """The call of its work in another process."""
        work = pickle.dumps((self.function, self.items))
        return _work_elsewhere, (algorithm(), work, self.left)


def _work_elsewhere(release: str, work: bytes, left: float | None) -> Done:
    if algorithm() != release:
        text = f"a worker has release {algorithm()} of energymargin, and this is {release}"
        raise RuntimeError(f"{text}; install the same release there")
    cancel, most = Cancel(), threading.TIMEOUT_MAX
    end = threading.Timer(most if left is None else min(left + GRACE, most), cancel.set)
    end.daemon = True
    end.start()
    try:
        function, items = pickle.loads(work)
        return Chunk(function, items, left).work(cancel)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # so it cannot be sent back
            raise RuntimeError(f"{type(error).__name__}: {error}") from None
        raise
    finally:
        end.cancel()


class Workers(Closing):
    """The workers of an executor. They start with the first chunk, and again after `stop`."""

    seconds: ClassVar[float] = 1.0
    """Work of a chunk [s]: so much is lost with a worker, and beside it sending costs little."""
    ahead: ClassVar[int] = 2
    """Chunks for each worker: one at work, one that waits."""

    def __init__(self, slots: int) -> None:
        """`slots`: how many chunks can run at once."""
        self._slots = slots

    @property
    def slots(self) -> int:
        """How many chunks can run at once; of a cluster, right now."""
        return self._slots

    def begin(self, chunks: int) -> None:
        """Makes ready for so many chunks, while none is there."""

    @abstractmethod
    def submit(self, chunk: Chunk) -> Future[Done]:
        """Puts the work of a chunk at the end of the queue."""

    @abstractmethod
    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """Drops the chunks that wait, and ends those that run as soon as that can be."""

    def is_lost(self, error: Exception) -> bool:
        """Whether a chunk has to be done again, as its results were lost on their way."""
        return False

    def explained(self, error: Exception) -> Exception:
        """What is raised for the error of a chunk."""
        return error


class RemoteWorkers(Workers):
    """Workers in other processes, which get each chunk as bytes."""

    _executor: Any

    def submit(self, chunk: Chunk) -> Future[Done]:
        """As Workers.submit. Raises ValueError on what cannot be sent, and ExecutorError if the
        executor is broken, or shut down."""
        try:
            call = pickle.dumps(chunk)
        except (AttributeError, TypeError, ValueError, pickle.PicklingError) as error:
            text = f"what is asked cannot be sent to another process ({error}): use threads"
            raise ValueError(text) from error
        try:
            future: Future[Done] = self._executor.submit(pickle.loads, call)
        except RuntimeError as error:
            raise ExecutorError(error) from error
        return future

    def explained(self, error: Exception) -> Exception:
        """As Workers.explained."""
        return ExecutorError(error) if isinstance(error, BrokenExecutor | CancelledError) else error


Task = tuple[Any, Any]
"""What its result is known by, which stays here, and the item that a worker gets."""


@dataclass(eq=False)
class Flow:
    """Chunks of items on their way to workers and back."""

    _workers: Workers
    _tasks: Iterator[Sequence[Task]]
    """Made when workers have room for them; some may be empty."""
    _most: int = MOST
    """Items of a chunk."""
    _all_came: bool = False
    _waiting: deque[Task] = field(default_factory=deque)
    _running: dict[Future[Done], Sequence[Task]] = field(default_factory=dict)
    _ended: SimpleQueue[Future[Done]] = field(default_factory=SimpleQueue)
    _error: Exception | None = None
    _cancelled: bool = False  # a chunk was, so items of it may have no results
    _seconds: float | None = None  # of an item

    @property
    def busy(self) -> bool:
        """Whether there is work to hand out, or a result to come."""
        left = self._running or self._waiting or not self._all_came
        return bool(left) or self._error is not None or self._cancelled

    def chunks(self) -> list[list[Task]]:
        """Tasks for which there is room. Raises the error of a chunk once the results of all others
        were returned."""
        if self._error is not None:
            raise self._error
        slots = self._workers.slots
        room = self._workers.ahead * slots - len(self._running)
        if room <= 0:
            return []
        size = 1  # before it is known how long an item takes
        if self._seconds is not None:
            chunk = max(self._workers.seconds, slots / CHUNKS_A_SECOND)
            size = max(1, min(self._most, int(chunk / max(self._seconds, 1e-9))))
        self._take(room * size)
        if self._all_came and len(self._waiting) <= room * size:  # none is to be idle at the end
            size = min(size, max(1, -(-len(self._waiting) // slots)))
        chunks = min(room, -(-len(self._waiting) // size))
        if chunks and not self._running:
            self._workers.begin(chunks if self._all_came else room)
        sizes = [min(size, len(self._waiting) - k * size) for k in range(chunks)]
        return [[self._waiting.popleft() for _ in range(one)] for one in sizes]

    def sent(self, future: Future[Done], tasks: Sequence[Task]) -> None:
        """A worker has these tasks."""
        self._running[future] = tasks
        future.add_done_callback(self._ended.put)

    def results(self) -> list[tuple[Any, Any]]:
        """Results that came, after a short wait, each with what it is known by."""
        found: list[tuple[Any, Any]] = []
        with suppress(Empty):
            waits = self._running or not self._workers.slots
            found += self._results_of(self._ended.get(timeout=POLL if waits else 0.0))
            while True:
                found += self._results_of(self._ended.get_nowait())
        return found

    def stop(self) -> list[tuple[Any, Any]]:
        """Ends what runs; results that are finished."""
        if self._running:
            self._workers.stop(self._running)
            wait(self._running, LAST)
        return [one for f in [*self._running] if f.done() for one in self._results_of(f)]

    def _take(self, most: int) -> None:
        """Makes tasks until so many are there, but not for longer than TAKE."""
        end = time.monotonic() + TAKE
        while not self._all_came and len(self._waiting) < most and time.monotonic() < end:
            tasks = next(self._tasks, None)
            self._all_came = tasks is None
            self._waiting.extend(tasks or ())

    def _results_of(self, future: Future[Done]) -> list[tuple[Any, Any]]:
        tasks = self._running.pop(future)
        try:
            results, seconds, cancelled = future.result()
        except Exception as error:
            if self._workers.is_lost(error):
                self._waiting.extend(tasks)
            else:
                self._error = self._workers.explained(error)
            return []
        self._cancelled |= cancelled and len(results) < len(tasks)
        newest = seconds / len(tasks)
        before = newest if self._seconds is None else self._seconds
        self._seconds = before + NEWEST * (newest - before)
        return [(known_by, one) for (known_by, _), one in zip(tasks, results, strict=False)]
