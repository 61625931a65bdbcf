"""Scores in processes of this machine, and the pool of processes that runs them."""

from __future__ import annotations

import contextlib
import pickle
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from energymargin.closing import Closing
from energymargin.executors.pool import STOP, Job, Outcome
from energymargin.executors.pool_session import PoolSession
from energymargin.executors.threads import core_count
from energymargin.searches import SearchSettings

__all__ = ["ProcessPool", "Processes"]

DEPTH = 2  # jobs that each worker has, so that it never waits for the next
MOST_DEATHS = 30  # of workers in a row, before one of them has finished a job


class _Worker:
    """One process, and the jobs that it has."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "energymargin.executors.worker", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C is for whoever started it
                stdin=subprocess.DEVNULL,
            )
        self.connection: Connection[Any, Any] = Connection(ours.detach())
        self.jobs: deque[tuple[int, bytes]] = deque()

    def send(self, job: int, pickled: bytes) -> None:
        """Adds a job; if the worker has died, `received` says so."""
        self.jobs.append((job, pickled))
        self._try_to_send(job, pickled)

    def stop(self) -> None:
        """Asks its job to return."""
        self._try_to_send(STOP, b"")

    def received(self) -> tuple[int, Any, Exception | None] | None:
        """Number, value and error of its first job; None if the worker has died."""
        try:
            answer: tuple[int, Any, Exception | None] = self.connection.recv()
        except (EOFError, OSError):
            return None
        self.jobs.popleft()
        return answer

    def end(self) -> str:
        """Ends the process; returns how it ended."""
        self.connection.close()
        try:
            code = self.process.wait(0.05 if self.jobs else 0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"

    def _try_to_send(self, job: int, pickled: bytes) -> None:
        with contextlib.suppress(OSError):
            self.connection.send((job, pickled))


class ProcessPool(Closing):
    """A number of worker processes; a Pool.

    They get nothing from this process but jobs, and end with it.
    """

    def __init__(self, processes: int) -> None:
        """Starts them; they take half a second to import the library."""
        self._queue: deque[tuple[int, bytes]] = deque()
        self._deaths = 0
        self._workers = [_Worker() for _ in range(processes)]

    @property
    def slots(self) -> int:
        """The number of processes."""
        return len(self._workers)

    def submit(self, job: int, function: Job, payload: Any) -> None:
        """As Pool.submit. Raises what pickle raises on a payload that it cannot send."""
        self._queue.append((job, pickle.dumps((function, payload))))
        self._hand_out()

    def take(self, timeout: float) -> list[Outcome]:
        """As Pool.take. Raises RuntimeError if worker after worker dies at once."""
        by_connection = {worker.connection: worker for worker in self._workers if worker.jobs}
        if not by_connection:
            time.sleep(timeout)
            return []
        outcomes: list[Outcome] = []
        for ready in wait(list(by_connection), timeout):
            outcomes += self._answer(by_connection[ready])  # type: ignore[index]
        self._hand_out()
        return outcomes

    def stop(self, timeout: float) -> list[Outcome]:
        """As Pool.stop; the jobs that wait are dropped."""
        self._queue.clear()
        for worker in self._workers:
            worker.stop()
        outcomes: list[Outcome] = []
        end = time.monotonic() + timeout
        while any(worker.jobs for worker in self._workers) and time.monotonic() < end:
            outcomes += self.take(max(0.0, end - time.monotonic()))
        return outcomes

    def close(self) -> None:
        """Kills the workers."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            worker.end()

    def _hand_out(self) -> None:
        while self._queue:
            worker = min(self._workers, key=lambda worker: len(worker.jobs))
            if len(worker.jobs) == DEPTH:
                break
            worker.send(*self._queue.popleft())

    def _answer(self, worker: _Worker) -> Iterator[Outcome]:
        answer = worker.received()
        if answer is None:
            yield self._replaced(worker)
            return
        self._deaths = 0
        job, value, error = answer
        yield Outcome(job, value, error)

    def _replaced(self, worker: _Worker) -> Outcome:
        """Puts another in the place of a worker that has died, and gives back its first job."""
        died = worker.end()
        self._deaths += 1
        if self._deaths > MOST_DEATHS:
            raise RuntimeError(
                f"{self._deaths} worker processes in a row have died, the last one {died}"
            )
        (job, _), *others = worker.jobs
        self._queue.extendleft(reversed(others))
        self._workers[self._workers.index(worker)] = _Worker()
        return Outcome(job, died=died)


@dataclass(frozen=True)
class Processes:
    """Processes of this machine: one that crashes costs no more than a second of its work.

    Problems are sent to them as JSON, so regions made of a Python predicate need threads.
    """

    count: int | None = None
    """How many; None is one for each core that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("processes", self.count)

    def pool(self) -> ProcessPool:
        """As Executor.pool."""
        return ProcessPool(core_count("processes", self.count))

    def session(self, settings: SearchSettings) -> PoolSession:
        """As Executor.session."""
        return PoolSession(self.pool(), settings)
