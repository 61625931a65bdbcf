"""Work that waits until nothing has been asked for some moments, and then does the last."""

from __future__ import annotations

import threading
from collections.abc import Callable

__all__ = ["Quiet"]

WAIT = 0.08  # s


class Quiet:
    """One thing at a time: what it was last given."""

    def __init__(self) -> None:
        """Idle."""
        self._lock = threading.Lock()
        self._busy = threading.Lock()
        self._timer: threading.Timer | None = None
        self._idle = threading.Event()
        self._idle.set()
        self._closed = False

    def run(self, work: Callable[[], None]) -> None:
        """Calls `work` soon, on a thread, unless other work comes before."""
        with self._lock:
            if self._closed:
                return
            self._forget()
            self._idle.clear()
            self._timer = threading.Timer(WAIT, self._do, [work])
            self._timer.daemon = True
            self._timer.start()

    def join(self) -> None:
        """Waits until the last work is done."""
        self._idle.wait()

    def close(self) -> None:
        """Forgets what waits, and waits for what is done; nothing more is."""
        with self._lock:
            self._closed = True
            self._forget()
        with self._busy:
            self._idle.set()

    def _forget(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _do(self, work: Callable[[], None]) -> None:
        own = threading.current_thread()
        try:
            with self._busy:
                if not self._closed:
                    work()
        finally:
            with self._lock:
                if own is self._timer:
                    self._idle.set()
