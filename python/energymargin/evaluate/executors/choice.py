"""Executors of this machine: threads, processes, or somebody else's; and which one is chosen."""

from __future__ import annotations

import concurrent.futures
import os
import signal
import threading
import time
from collections.abc import Collection
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import ClassVar, Protocol

from energymargin._core import Cancel
from energymargin.base.checks import core_count, usable_cores
from energymargin.evaluate.parallel import Chunk, Done, RemoteWorkers, Workers

LOOK = 0.1  # s; how long a process may outlive the one that it works for


class Executor(Protocol):
    """Where work is done: `Threads`, `Processes` or `Dask`."""

    def workers(self) -> Workers:
        """Its workers, which start with their first work."""
        ...


def chosen_executor(
    executor: Executor | concurrent.futures.Executor | None, threads: int | None = None
) -> Executor:
    """`executor`, or for None so many threads; ValueError if it is none, or both are given."""
    if executor is None:
        return Threads(threads)
    if threads is not None:
        raise ValueError(f"threads is {threads}, expected None with an executor")
    if isinstance(executor, concurrent.futures.Executor):
        return _Given(executor)
    if isinstance(executor, type) or not callable(getattr(executor, "workers", None)):
        text = f"executor is {executor!r}, expected Threads(), Processes()"
        raise ValueError(f"{text}, Dask(...) or an Executor of concurrent.futures")
    return executor


@dataclass(frozen=True)
class Threads:
    """Threads of this process: nothing to set up, the default. Scores do not depend on them."""

    count: int | None = None
    """How many; None takes all cores that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("threads", self.count)

    def workers(self) -> Workers:
        """As Executor.workers."""
        return _ThreadWorkers(core_count("threads", self.count))


class _ThreadWorkers(Workers):
    seconds: ClassVar[float] = 0.2

    def __init__(self, threads: int) -> None:
        super().__init__(threads)
        self._executor, self._cancel = ThreadPoolExecutor(threads), Cancel()

    def submit(self, chunk: Chunk) -> Future[Done]:
        """As Workers.submit; `stop` ends what runs, whatever is left of the time."""
        try:
            return self._executor.submit(chunk.work, self._cancel)
        except RuntimeError:  # no thread can start
            done: Future[Done] = Future()
            done.set_result(chunk.work(self._cancel))
            return done

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop."""
        self._cancel.set()
        for chunk in chunks:
            chunk.cancel()
        self.close()
        self._executor, self._cancel = ThreadPoolExecutor(self.slots), Cancel()

    def close(self) -> None:
        """Ends them."""
        self._executor.shutdown()


@dataclass(frozen=True)
class Processes:
    """Processes of this machine. If one dies, as for want of memory, the call ends with what is
    finished.

    Problems are sent to them as JSON, so regions made of a Python predicate need threads, and so
    does an em.Policy whose code cannot be pickled.
    """

    count: int | None = None
    """How many at most; None is one for each core that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("processes", self.count)

    def workers(self) -> RemoteWorkers:
        """As Executor.workers."""
        return _ProcessWorkers(core_count("processes", self.count))


class _ProcessWorkers(RemoteWorkers):
    _processes = 0  # that the executor has

    def begin(self, chunks: int) -> None:
        """As Workers.begin: no more processes than chunks, none of which ever gets a Ctrl-C."""
        from multiprocessing import resource_tracker

        from loky import ProcessPoolExecutor

        if self._processes >= (wanted := min(chunks, self.slots)):
            return
        self.close()
        self._executor = ProcessPoolExecutor(wanted, initializer=_begin, initargs=(os.getpid(),))
        self._processes = wanted
        resource_tracker.ensure_running()  # as it would let Ctrl-C in again
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._executor.submit(int)  # starts them all
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop: kills them."""
        self.close()

    def close(self) -> None:
        """Kills them."""
        if self._processes:
            self._processes = 0
            self._executor.shutdown(kill_workers=True)


def _begin(parent: int) -> None:
    """In a process: ends it soon after the one that it works for."""

    def end_with_it() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK)
        os._exit(1)

    threading.Thread(target=end_with_it, daemon=True).start()


class _Given(RemoteWorkers):
    """The workers of somebody else's Executor, as mpi4py's MPIPoolExecutor: they stay when the work
    is done. None of their work waits in the executor's queue, as what is there cannot always be
    cancelled."""

    ahead: ClassVar[int] = 1

    def __init__(self, executor: concurrent.futures.Executor) -> None:
        super().__init__(int(getattr(executor, "_max_workers", None) or usable_cores()))
        self._executor = executor

    def workers(self) -> Workers:
        """As Executor.workers."""
        return self

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop; a chunk that is at work runs to its end, or the limit of the call."""
        for chunk in chunks:
            chunk.cancel()

    def close(self) -> None:
        """Leaves them as they are."""
