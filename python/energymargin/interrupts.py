"""Ctrl-C that waits until what is done is kept."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["held_interrupts", "since_interrupt"]

_came: list[float] = []  # when, of one that is held; of the main thread, as signals are


@contextmanager
def held_interrupts() -> Iterator[threading.Event]:
    """Ctrl-C sets the event instead of raising, so that no row is lost between a pool of workers
    and the file.

    Only where Python's own handler is in place: a program that handles Ctrl-C itself goes on doing
    so.
    """
    interrupted = threading.Event()

    def hold(_signal: int, _frame: FrameType | None) -> None:
        _came.append(time.monotonic())
        interrupted.set()

    python_handles = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not python_handles or threading.current_thread() is not threading.main_thread():
        yield interrupted
        return
    signal.signal(signal.SIGINT, hold)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _came.clear()


def since_interrupt() -> float:
    """How long a Ctrl-C has been held [s]; 0 if none is."""
    return time.monotonic() - _came[0] if _came else 0.0
