"""Work in processes of this machine.

ProcessPoolExecutor would run the user's script again in each of its processes, and of those that
die it does not tell which chunk they had.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pipe
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any

from energymargin.base.checks import core_count
from energymargin.evaluate.parallel import RemoteWorkers


@dataclass(frozen=True)
class Processes:
    """Processes of this machine: one that crashes costs no more than a second of its work.

    Problems are sent to them as JSON, so regions made of a Python predicate need threads, and so
    does an em.Policy whose code cannot be pickled.
    """

    count: int | None = None
    """How many; None is one for each core that this process may use."""

    def __post_init__(self) -> None:
        """Raises ValueError if `count` is below 1."""
        core_count("processes", self.count)

    def workers(self) -> RemoteWorkers:
        """As Executor.workers."""
        processes = core_count("processes", self.count)
        return RemoteWorkers(partial(_ProcessPool, processes), processes)


class _ProcessPool(ThreadPoolExecutor):
    """Threads, each of which waits for a process, which gets nothing from this one but chunks, and
    ends with it. There are no more than chunks; one that dies is replaced."""

    def __init__(self, processes: int) -> None:
        super().__init__(processes)
        self._idle: SimpleQueue[_Process] = SimpleQueue()
        self._all: list[_Process] = []
        self._starting, self._ended = Lock(), False

    def submit(self, _loads: Any, /, *call: Any, **_: Any) -> Future[Any]:
        """Runs `pickle.loads` of the one argument, some bytes, in a process."""
        return super().submit(self._answer, *call)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = True) -> None:
        """Kills the processes."""
        super().shutdown(wait=False, cancel_futures=cancel_futures)
        with self._starting:
            self._ended = True
        for process in self._all:
            process.close()
        super().shutdown(wait=wait)

    def _answer(self, call: bytes) -> Any:
        process = self._process()
        try:
            value, error = process.answer(call)
        finally:
            self._idle.put(process)
        if error is not None:
            raise error
        return value

    def _process(self) -> _Process:
        """One that is idle, or else a new one: there are as many threads as processes at most."""
        with suppress(Empty):
            return self._idle.get_nowait()
        with self._starting:
            if self._ended:
                raise BrokenExecutor("it was shut down")
            self._all.append(_Process())
            return self._all[-1]


class _Process:
    """A process that answers one call after the other; after its death, another in its place."""

    def __init__(self) -> None:
        self._closed = False
        self._start()

    def _start(self) -> None:
        self._connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    "-m",
                    "energymargin.evaluate.executors.worker",
                    str(theirs.fileno()),
                ],
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C is for whoever started it
                stdin=subprocess.DEVNULL,
            )

    def answer(self, call: bytes) -> Any:
        """What the call returns there, and the error that it raises; BrokenExecutor if the process
        dies."""
        try:
            self._connection.send_bytes(call)
            return self._connection.recv()
        except (EOFError, OSError):
            self._connection.close()
            code = self.kill()
            if not self._closed:
                self._start()
            died = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
            raise BrokenExecutor(died) from None

    def close(self) -> None:
        """Ends it for good."""
        self._closed = True
        self.kill()

    def kill(self) -> int:
        """Its exit code."""
        self._process.kill()
        return self._process.wait()
