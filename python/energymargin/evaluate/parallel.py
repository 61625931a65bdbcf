"""One runner for work in parallel, on the workers of any `concurrent.futures.Executor`.

Items go out in chunks, and results come back as they are done. A chunk whose worker dies is cut in
halves, which run with nothing beside them: in the end the item that ends worker after worker is
alone, and is given up.
"""

from __future__ import annotations

import pickle
import threading
import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, ClassVar, Generic, TypeVar

from energymargin._core import Cancel
from energymargin.base.closing import Closing
from energymargin.base.interrupts import held_interrupts
from energymargin.base.limits import Limit
from energymargin.evaluate.searches import algorithm

POLL = 0.05  # s; how long a stop may stay unnoticed
TAKE = 0.1  # s; how long items are taken before the workers get them
LAST = 0.1  # s; how long a stop waits for results that are finished
GRACE = 0.1  # s; so long after the limit of a call a worker elsewhere ends what it has begun
MOST = 1000  # items of a chunk
CHUNKS_A_SECOND = 200  # of a large cluster, whose scheduler has no time for more
NEWEST = 0.2  # weight of the newest chunk in how long an item takes
TRIES = 3  # workers that one item may take with it
MOST_DEATHS = 30  # of workers in a row, before one of them has finished a chunk

Item = TypeVar("Item")
Result = TypeVar("Result")

Function = Callable[[Sequence[Item], Cancel], Sequence[Result]]
"""Results of some items. Once the cancel is set it returns early, with those that are finished, or
raises."""
Done = tuple[Sequence[Any], float, bool]
"""Results of a chunk, for how long a worker was at it [s], and whether it was cancelled."""


class Workers(Closing):
    """The workers of an executor. They start with the first chunk, and again after `stop`."""

    chunk: ClassVar[float] = 1.0
    """Work of a chunk [s]: so much is lost with a worker, and beside it sending costs little."""
    ahead: ClassVar[int] = 2
    """Chunks for each worker: one at work, one that waits."""
    deaths: tuple[type[Exception], ...] = (BrokenExecutor,)
    """What is raised in place of a chunk's results if its worker died."""

    def __init__(self, start: Callable[[], Executor], slots: int) -> None:
        """`start` makes the executor that runs them, `slots` chunks at once."""
        self._start, self._slots = start, slots
        self._executor: Executor | None = None

    @property
    def slots(self) -> int:
        """How many chunks can run at once; of a cluster, right now."""
        return self._slots

    def is_death(self, error: Exception) -> bool:
        """Whether a chunk has no results since its worker died."""
        return isinstance(error, self.deaths)

    def executor(self) -> Executor:
        """The one that runs them, started if it was not, or has broken."""
        if self._executor is None:
            self._executor = self._start()
        return self._executor

    @abstractmethod
    def submit(
        self, function: Function[Any, Any], items: Sequence[Any], left: float | None
    ) -> Future[Done]:
        """Puts `work(function, items)` at the end of the queue; `left`: time until the limit of
        the call [s], None without one."""

    def stop(self) -> None:
        """Drops what waits, and ends what runs as soon as that can be."""
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)
            self._executor = None

    def close(self) -> None:
        """Frees them."""
        self.stop()

    def explained(self, error: Exception) -> Exception:
        """What is raised for the error of a chunk."""
        return error


class RemoteWorkers(Workers):
    """Workers in other processes, which get each chunk as bytes: a cluster's scheduler needs no
    energymargin to hand it on."""

    def submit(
        self, function: Function[Any, Any], items: Sequence[Any], left: float | None
    ) -> Future[Done]:
        """As Workers.submit. Raises ValueError on what cannot be sent."""
        try:
            call = pickle.dumps(_RemoteWork(function, items, left))
        except (AttributeError, TypeError, ValueError, pickle.PicklingError) as error:
            raise ValueError(
                f"what is asked cannot be sent to another process ({error}): use threads"
            ) from error
        return self.executor().submit(pickle.loads, call)


class _RemoteWork:
    """A call of `work` in another process: `pickle.loads` runs it there."""

    def __init__(
        self, function: Function[Any, Any], items: Sequence[Any], left: float | None = None
    ) -> None:
        self._arguments = (algorithm(), function, items, left)

    def __reduce__(self) -> tuple[Callable[..., Done], tuple[Any, ...]]:
        return _work_elsewhere, self._arguments


def _work_elsewhere(
    release: str, function: Function[Any, Any], items: Sequence[Any], left: float | None
) -> Done:
    if algorithm() != release:
        raise RuntimeError(
            f"a worker has release {algorithm()} of energymargin, and this is {release}; install "
            "the same release there"
        )
    cancel = Cancel()
    if left is None:
        return work(function, items, cancel)
    end = threading.Timer(min(left + GRACE, threading.TIMEOUT_MAX), cancel.set)
    end.daemon = True
    end.start()
    try:
        return work(function, items, cancel)
    finally:
        end.cancel()


def work(function: Function[Any, Any], items: Sequence[Any], cancel: Cancel) -> Done:
    """What a worker does with a chunk."""
    start = time.perf_counter()
    results = function(items, cancel)
    return results, time.perf_counter() - start, cancel.is_set


def run(
    workers: Workers,
    function: Function[Item, Result],
    batches: Iterable[Sequence[Item]],
    deliver: Callable[[Sequence[Result]], None],
    limit: Limit,
    *,
    give_up: Callable[[Item, str], Result],
    most: int = MOST,
) -> bool:
    """Runs a function on all items; False if the limit came before the last one.

    A batch of items is made when workers have room for it; it may be empty. `deliver` gets results
    as they come, in this thread, and is called again and again. On Ctrl-C it gets within 0.2 s
    those that are finished, and KeyboardInterrupt is raised; so with any other error, which is then
    raised. `give_up(item, why)` makes the result of an item over which three workers have died, or
    raises. A chunk has at most so many items (`most`).
    """
    flow = _Flow(workers, function, iter(batches), give_up, most)
    with held_interrupts() as interrupted:
        try:
            while flow.busy and not (interrupted.is_set() or limit.reached):
                flow.hand_out(limit)
                deliver(flow.results())
        finally:
            deliver(flow.stop())
    if interrupted.is_set():
        raise KeyboardInterrupt
    return not flow.busy


@dataclass(frozen=True, eq=False)
class _Chunk(Generic[Item]):
    items: Sequence[Item]
    deaths: int = 0
    """Workers that died over it."""


@dataclass(eq=False)
class _Flow(Generic[Item, Result]):
    """Chunks of items on their way to workers and back."""

    _workers: Workers
    _function: Function[Item, Result]
    _batches: Iterator[Sequence[Item]]
    _give_up: Callable[[Item, str], Result]
    _most: int
    _all_came: bool = False
    _items: deque[Item] = field(default_factory=deque)  # that came, and were not handed out
    _running: dict[Future[Done], _Chunk[Item]] = field(default_factory=dict)
    _suspects: list[_Chunk[Item]] = field(default_factory=list)  # whose worker has died
    _ended: SimpleQueue[Future[Done]] = field(default_factory=SimpleQueue)
    _error: Exception | None = None
    _cancelled: bool = False  # a chunk was, so items of it may have no results
    _deaths: int = 0  # in a row
    _seconds: float | None = None  # of an item

    @property
    def busy(self) -> bool:
        """Whether there is work to hand out, or a result to come."""
        left = self._running or self._suspects or self._items or not self._all_came
        return bool(left) or self._error is not None or self._cancelled

    def hand_out(self, limit: Limit) -> None:
        """Hands out work as far as there is room. Raises the error of a chunk once the results of
        all others were returned."""
        if self._error is not None:
            raise self._error
        for chunk in self._chunks():
            left = limit.rest()["timeout"]
            future = self._workers.submit(self._function, chunk.items, left)
            self._running[future] = chunk
            future.add_done_callback(self._ended.put)

    def results(self) -> list[Result]:
        """Results that came, after a short wait."""
        found: list[Result] = []
        with suppress(Empty):
            waits = self._running or not self._workers.slots
            future = self._ended.get(timeout=POLL if waits else 0.0)
            while True:
                found += self._results_of(future)
                future = self._ended.get_nowait()
        return found

    def stop(self) -> list[Result]:
        """Ends what runs; results that are finished."""
        if not self._running:
            return []
        self._workers.stop()
        wait(self._running, LAST)
        results: list[Result] = []
        for future in [future for future in self._running if _went_well(future)]:
            found, _, cancelled = future.result()
            results += found
            if not cancelled or len(found) == len(self._running[future].items):
                del self._running[future]
        return results

    def _chunks(self) -> Iterator[_Chunk[Item]]:
        """Those for which there is room; one that a worker has died over is alone."""
        if self._suspects:
            if not self._running:
                yield self._suspects.pop()
            return
        slots = self._workers.slots
        room = self._workers.ahead * slots - len(self._running)
        if room <= 0:
            return
        size = self._size(max(self._workers.chunk, slots / CHUNKS_A_SECOND))
        self._take(room * size)
        if self._all_came and len(self._items) <= room * size:  # none is to be idle at the end
            size = min(size, max(1, -(-len(self._items) // slots)))
        for _ in range(min(room, -(-len(self._items) // size))):
            many = min(size, len(self._items))
            yield _Chunk([self._items.popleft() for _ in range(many)])

    def _take(self, most: int) -> None:
        """Makes batches until so many items are there, but not for longer than TAKE."""
        end = time.monotonic() + TAKE
        while not self._all_came and len(self._items) < most and time.monotonic() < end:
            batch = next(self._batches, None)
            self._all_came = batch is None
            self._items.extend(batch or ())

    def _size(self, seconds: float) -> int:
        """Items of a chunk of so much work; one before it is known how long an item takes."""
        if self._seconds is None:
            return 1
        return max(1, min(self._most, int(seconds / max(self._seconds, 1e-9))))

    def _results_of(self, future: Future[Done]) -> Sequence[Result]:
        chunk = self._running.pop(future)
        try:
            results, seconds, cancelled = future.result()
        except Exception as error:
            if self._workers.is_death(error):
                return self._again(chunk, " ".join(str(error).split()))
            self._error = self._workers.explained(error)
            return []
        self._deaths = 0
        self._cancelled |= cancelled and len(results) < len(chunk.items)
        newest = seconds / len(chunk.items)
        before = newest if self._seconds is None else self._seconds
        self._seconds = before + NEWEST * (newest - before)
        return results

    def _again(self, chunk: _Chunk[Item], why: str) -> Sequence[Result]:
        """A chunk whose worker has died, in halves; an item that is alone, unless it was so often.

        With some executors the chunks beside it end too, so blame is sure where it ran alone.
        """
        self._deaths += chunk.deaths > 0
        if self._deaths > MOST_DEATHS:
            self._error = RuntimeError(f"{self._deaths} workers in a row have died, the last {why}")
        elif len(chunk.items) > 1:
            half = len(chunk.items) // 2
            halves = chunk.items[:half], chunk.items[half:]
            self._suspects += [_Chunk(items, 1) for items in halves]
        elif chunk.deaths + 1 < TRIES:
            self._suspects.append(_Chunk(chunk.items, chunk.deaths + 1))
        else:
            return [self._give_up(chunk.items[0], f"{TRIES} workers died over it, the last {why}")]
        return []


def _went_well(future: Future[Done]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None
