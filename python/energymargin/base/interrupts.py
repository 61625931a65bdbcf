"""Handlers of Ctrl-C: it loses no results, and is not lost itself."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import FrameType
from typing import Any

# Only the main thread gets signals, so there is one.
_remembered = threading.Event()  # set once a Ctrl-C was raised


def on_interrupt(act: Callable[[], object]) -> AbstractContextManager[None]:
    """Ctrl-C calls `act` instead of raising. Only where it would raise KeyboardInterrupt: a
    program's own handler stays in place."""
    raises = signal.getsignal(signal.SIGINT) in (signal.default_int_handler, _raise_and_remember)
    if _in_main_thread() and raises:
        return _handled_by(lambda _signal, _frame: act())
    return nullcontext()


@contextmanager
def held_interrupts() -> Iterator[threading.Event]:
    """Ctrl-C sets the event instead of raising, so that no score is lost between workers and
    file."""
    came = threading.Event()
    with on_interrupt(came.set):
        yield came


@contextmanager
def delayed_interrupts() -> Iterator[None]:
    """Ctrl-C takes effect at the end of the `with` block, which has to be short: for what cannot be
    left half done."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or not _in_main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []
    try:
        with _handled_by(lambda number, frame: came.append((number, frame))):
            yield
    finally:
        if came:
            before(*came[0])


@contextmanager
def remembered_interrupts() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt as ever; where that is swallowed, as in a finalizer or while
    a library loads, `raise_if_interrupted` raises it again.

    Only where Python's own handler is in place; within another such block it changes nothing.
    """
    if not (_in_main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler):
        yield
        return
    _remembered.clear()
    with _handled_by(_raise_and_remember):
        try:
            yield
        finally:
            _remembered.clear()


def interrupted() -> bool:
    """Whether Ctrl-C has raised since the outermost `remembered_interrupts` began."""
    return _remembered.is_set()


def raise_if_interrupted() -> None:
    """Raises KeyboardInterrupt in the main thread if it was `interrupted`."""
    if interrupted() and _in_main_thread():
        raise KeyboardInterrupt


def _raise_and_remember(_signal: int, _frame: FrameType | None) -> None:
    _remembered.set()
    raise KeyboardInterrupt


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
