"""Work in processes of this machine, which loky starts and watches."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Collection
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing import resource_tracker

from energymargin.base.checks import core_count
from energymargin.evaluate.parallel import Done, RemoteWorkers

LOOK = 0.1  # s; how long a process may outlive the one that it works for


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
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(1)
