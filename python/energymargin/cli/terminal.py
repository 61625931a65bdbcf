"""The terminal: what commands print, and how they end."""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager
from typing import NoReturn

from rich.console import Console

from energymargin.interrupts import on_interrupt

__all__ = [
    "BAD_INPUT",
    "INTERRUPTED",
    "TIMED_OUT",
    "err",
    "leave",
    "loading",
    "out",
    "say",
    "say_stopped",
]

# Exit codes, as shells know them.
BAD_INPUT = 2
TIMED_OUT = 124
INTERRUPTED = 130

out = Console()
err = Console(stderr=True)


def say(text: str) -> None:
    """Prints a line on stderr, for the user; what a command computes goes to stdout."""
    err.print(text, soft_wrap=True, highlight=False)


def say_stopped() -> None:
    """Prints that Ctrl-C stopped the command."""
    say("[yellow]stopped[/]")


def leave(code: int) -> NoReturn:
    """Ends the process at once, when everything is closed: large libraries would take half a second
    to shut down."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def loading() -> AbstractContextManager[None]:
    """Around the import of large libraries, where nothing is lost: Ctrl-C ends the process at once,
    for some of them would swallow an exception."""

    def stop() -> NoReturn:
        say_stopped()
        leave(INTERRUPTED)

    return on_interrupt(stop)
