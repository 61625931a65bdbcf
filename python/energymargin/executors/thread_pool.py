"""Jobs on the threads of this process: a Pool, beside those of processes and of a cluster."""

from __future__ import annotations

import threading
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import Any

from energymargin.closing import Closing
from energymargin.executors.pool import Job, Outcome

__all__ = ["ThreadPool"]


class ThreadPool(Closing):
    """A number of threads; a Pool. None of them dies."""

    def __init__(self, threads: int) -> None:
        """They start with the first jobs."""
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads)
        self._done: SimpleQueue[Outcome] = SimpleQueue()
        self._stop = threading.Event()
        self._running: set[Future[None]] = set()

    @property
    def slots(self) -> int:
        """The number of threads."""
        return self._threads

    def submit(self, job: int, function: Job, payload: Any) -> None:
        """As Pool.submit."""
        self._running = {future for future in self._running if not future.done()}
        self._running.add(self._pool.submit(self._run, job, function, payload))

    def take(self, timeout: float) -> list[Outcome]:
        """As Pool.take."""
        outcomes: list[Outcome] = []
        try:
            outcomes.append(self._done.get(timeout=timeout) if timeout else self._done.get_nowait())
            while True:
                outcomes.append(self._done.get_nowait())
        except Empty:
            return outcomes

    def stop(self, timeout: float) -> list[Outcome]:
        """As Pool.stop; jobs that wait are dropped."""
        self._stop.set()
        for future in self._running:
            future.cancel()
        return self.take(0)

    def close(self) -> None:
        """Waits for the jobs that run."""
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)

    def _run(self, job: int, function: Job, payload: Any) -> None:
        try:
            self._done.put(Outcome(job, function(payload, self._stop.is_set)))
        except Exception as error:
            self._done.put(Outcome(job, error=error))
