"""A worker process of a ProcessPool: `python -m energymargin.executors.worker FD`.

Jobs come in at a connection and are answered in their order. A thread reads them, so that neither
end ever waits for the other's full buffer. When the connection ends, so does the worker: it never
outlives the process that it works for.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

from energymargin.executors.pool import STOP

__all__ = ["sendable"]

Jobs = SimpleQueue[tuple[int, bytes]]


def main(descriptor: int) -> None:
    """Works until the other end closes the connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started the worker stops it
    connection: Connection[Any, Any] = Connection(descriptor)
    jobs: Jobs = SimpleQueue()
    stop = threading.Event()
    threading.Thread(target=_read, args=(connection, jobs, stop), daemon=True).start()
    while True:
        job, pickled = jobs.get()
        try:
            connection.send((job, *_result(pickled, stop)))
        except OSError:
            os._exit(0)  # nobody is there any more


def _read(connection: Connection[Any, Any], jobs: Jobs, stop: threading.Event) -> None:
    try:
        while True:
            job, pickled = connection.recv()
            if job == STOP:
                stop.set()
            else:
                jobs.put((job, pickled))
    except (EOFError, OSError):
        os._exit(0)


def _result(pickled: bytes, stop: threading.Event) -> tuple[Any, Exception | None]:
    """The job's value, and its error."""
    try:
        function, payload = pickle.loads(pickled)
        return function(payload, stop.is_set), None
    except Exception as error:
        return None, sendable(error)


def sendable(error: Exception) -> Exception:
    """The error, or a RuntimeError with its text if it cannot be pickled."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


if __name__ == "__main__":
    main(int(sys.argv[1]))
