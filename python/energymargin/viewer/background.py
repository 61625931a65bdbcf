"""Work in the background: one search at a time, and drawing that waits until the controls rest."""

from __future__ import annotations

import threading
from collections.abc import Callable

from energymargin._core import Cancel

__all__ = ["Debounced", "SearchThread"]

WAIT = 0.08  # s


class SearchThread:
    """One search at a time, in the background."""

    def __init__(self) -> None:
        """Idle."""
        self._lock = threading.RLock()
        self._cancel = Cancel()
        # Waited for instead of the thread, which Python takes for ended once Ctrl-C ends a join.
        self._done = threading.Event()
        self._done.set()
        self._closed = False

    @property
    def running(self) -> bool:
        """Whether it searches."""
        return not self._done.is_set()

    def start(self, work: Callable[[Cancel], None]) -> None:
        """Stops what runs, and calls `work` with the cancel that ends it; not once it is closed."""
        with self._lock:
            self.stop()
            if self._closed:
                return
            self._cancel, self._done = Cancel(), threading.Event()
            arguments = (work, self._cancel, self._done)
            threading.Thread(target=_run, args=arguments, daemon=True).start()

    def join(self) -> None:
        """Waits until it is done."""
        self._done.wait()

    def stop(self) -> None:
        """Ends the search, and waits for that: within one rollout."""
        with self._lock:
            self._cancel.set()
            self.join()

    def close(self) -> None:
        """Ends the search, and starts no other."""
        self._closed = True
        self.stop()


def _run(work: Callable[[Cancel], None], cancel: Cancel, done: threading.Event) -> None:
    try:
        work(cancel)
    finally:
        done.set()


class Debounced:
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
