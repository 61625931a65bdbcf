"""Ctrl-C that waits until what is done is kept."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = [
    "delayed_interrupts",
    "held_interrupts",
    "on_interrupt",
    "remembered_interrupts",
    "since_interrupt",
]

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

    if not _python_handles():
        yield interrupted
        return
    signal.signal(signal.SIGINT, hold)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _came.clear()


@contextmanager
def delayed_interrupts() -> Iterator[None]:
    """Ctrl-C does what it would have done, but at the end of the `with` block: for what cannot be
    left half done, and takes no time."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: came.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            before(*came[0])


@contextmanager
def remembered_interrupts() -> Iterator[Callable[[], None]]:
    """Ctrl-C raises KeyboardInterrupt as ever; where that was swallowed, as in a finalizer, the
    function that the `with` block gets raises it again.

    Only where Python's own handler is in place.
    """
    interrupted = threading.Event()

    def remember(_signal: int, _frame: FrameType | None) -> None:
        interrupted.set()
        raise KeyboardInterrupt

    def check() -> None:
        if interrupted.is_set():
            raise KeyboardInterrupt

    if not _python_handles():
        yield check
        return
    signal.signal(signal.SIGINT, remember)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def on_interrupt(act: Callable[[], object]) -> Iterator[None]:
    """Ctrl-C calls `act` instead of raising. Only where Python's own handler is in place."""
    if not _python_handles():
        yield
        return
    signal.signal(signal.SIGINT, lambda _signal, _frame: act())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def since_interrupt() -> float:
    """How long a Ctrl-C has been held [s]; 0 if none is."""
    return time.monotonic() - _came[0] if _came else 0.0


def _python_handles() -> bool:
    """Whether Ctrl-C is Python's, and this thread is the one that gets it."""
    own = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return own and threading.current_thread() is threading.main_thread()
