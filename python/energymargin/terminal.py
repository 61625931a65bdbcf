"""What the commands share: the terminal, words on it, and options."""

from __future__ import annotations

import json
import os
import sys
from contextlib import AbstractContextManager
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console

from energymargin.interrupts import on_interrupt

__all__ = [
    "BAD_INPUT",
    "INTERRUPTED",
    "PICTURE_NODES",
    "TIMED_OUT",
    "Nodes",
    "Parameters",
    "RunNumber",
    "Seed",
    "Threads",
    "Timeout",
    "err",
    "leave",
    "loading",
    "out",
    "parsed",
    "real",
    "say",
    "say_stopped",
    "split",
    "whole",
]

PICTURE_NODES = 100  # of the trees in the pictures of the tasks; the paper's

# Exit codes, as shells know them.
BAD_INPUT = 2
TIMED_OUT = 124
INTERRUPTED = 130

out = Console()
err = Console(stderr=True)

Seed = Annotated[int, typer.Option(help="The same seed gives the same numbers, to the last bit.")]
Nodes = Annotated[
    int, typer.Option(help="Nodes of each search tree: more take longer and say more.")
]
Threads = Annotated[
    int | None, typer.Option(help="Threads; all cores if not given. Scores do not depend on it.")
]
Parameters = Annotated[
    list[str] | None,
    typer.Option("--parameter", "-p", help="A parameter of the task: NAME=VALUE."),
]
RunNumber = Annotated[
    int | None,
    typer.Option(
        "--run", help="Which run, if there are several; `energymargin export` lists them."
    ),
]
Timeout = Annotated[
    float | None, typer.Option(help="Seconds after which it ends with what is done; exit code 124.")
]


def say(text: str) -> None:
    """A line to whoever sits at the terminal; what a command computes goes to stdout instead."""
    err.print(text, soft_wrap=True, highlight=False)


def say_stopped() -> None:
    """The last word after Ctrl-C."""
    say("[yellow]stopped[/]")


def leave(code: int) -> NoReturn:
    """Ends the process at once, with everything closed: large libraries take half a second to shut
    down, for which nobody who pressed Ctrl-C wants to wait."""
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


def split(words: str) -> list[str]:
    """The words between commas."""
    return [word.strip() for word in words.split(",")]


def whole(name: str, word: str) -> int:
    """A whole number. Raises ValueError if the word is none."""
    try:
        return int(word)
    except ValueError:
        raise ValueError(f"{name} has {word!r}, expected whole numbers") from None


def parsed(parameters: list[str]) -> dict[str, Any]:
    """NAME=VALUE, where a value is JSON, or else a word. Raises ValueError on another text."""
    values = {}
    for text in parameters:
        name, equals, value = text.partition("=")
        if not (equals and name.isidentifier()):
            raise ValueError(f"--parameter is {text!r}, expected NAME=VALUE")
        try:
            values[name] = json.loads(value)
        except json.JSONDecodeError:
            values[name] = value
    return values


def real(name: str, word: str) -> float:
    """A number. Raises ValueError if the word is none."""
    try:
        return float(word)
    except ValueError:
        raise ValueError(f"{name} has {word!r}, expected numbers") from None
