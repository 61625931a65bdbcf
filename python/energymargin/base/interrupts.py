"""Handlers of Ctrl-C: it loses no results, and is not lost itself."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

# Only the main thread gets signals, so there is one.
_remembered = threading.Event()  # set once a Ctrl-C was raised


def on_interrupt(act: Callable[[], object]) -> AbstractContextManager[None]:
    """Ctrl-C calls `act` instead of raising. Only where it would raise KeyboardInterrupt: a
    program's own handler stays in place."""
    return _handled_by(lambda *_: act(), signal.default_int_handler, _raise_and_remember)


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
    came = threading.Event()
    try:
        with _handled_by(lambda *_: came.set(), signal.getsignal(signal.SIGINT)):
            yield
    finally:
        if came.is_set():
            signal.raise_signal(signal.SIGINT)


@contextmanager
def remembered_interrupts() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt as ever; where that is swallowed, as in a finalizer or while
    a library loads, `raise_if_interrupted` raises it again.

    Only where Python's own handler is in place; within another such block it changes nothing.
    """
    with _handled_by(_raise_and_remember, signal.default_int_handler) as is_outermost:
        try:
            yield
        finally:
            if is_outermost:
                _remembered.clear()


def interrupted() -> bool:
    """Whether Ctrl-C has raised since the outermost `remembered_interrupts` began."""
    return _remembered.is_set()


def raise_if_interrupted() -> None:
    """Raises KeyboardInterrupt in the main thread if it was `interrupted`."""
    if interrupted() and threading.current_thread() is threading.main_thread():
        raise KeyboardInterrupt


def _raise_and_remember(_signal: int, _frame: FrameType | None) -> None:
    _remembered.set()
    raise KeyboardInterrupt


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], Any], *instead_of: Any) -> Iterator[Any]:
    """Whether the handler is in place: in the main thread, instead of one of these functions."""
    before = signal.getsignal(signal.SIGINT)
    acts = threading.current_thread() is threading.main_thread() and before in instead_of
    if not (acts and callable(before)):
        yield False
        return
    signal.signal(signal.SIGINT, handler)
    try:
        yield True
    finally:
        signal.signal(signal.SIGINT, before)
