"""A process of `Processes`: `python -m energymargin.evaluate.executors.worker FD`.

Calls come in at a connection, and are answered in their order. A thread reads them, so that the
process ends with the connection, whatever it does: it never outlives the one that it works for.
"""

from __future__ import annotations

import os
import pickle
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any


def main(descriptor: int) -> None:
    """Works until the other end closes the connection."""
    connection: Connection[Any, Any] = Connection(descriptor)
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_read, args=(connection, calls), daemon=True).start()
    while True:
        connection.send_bytes(_answer(calls.get()))


def _read(connection: Connection[Any, Any], calls: SimpleQueue[bytes]) -> None:
    try:
        while True:
            calls.put(connection.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)


def _answer(call: bytes) -> bytes:
    """The value of a call and its error, pickled; an error that cannot be is sent in words."""
    try:
        return pickle.dumps((pickle.loads(call), None))
    except Exception as error:
        try:
            answer = pickle.dumps((None, error))
            pickle.loads(answer)
        except Exception:
            return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))
        return answer


if __name__ == "__main__":
    main(int(sys.argv[1]))
