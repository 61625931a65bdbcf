"""Who does the work: options of several commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.terminal import say

if TYPE_CHECKING:
    from energymargin.executors import Dask, Executor

__all__ = ["Scheduler", "chosen_executor", "cluster", "require_one"]

Scheduler = Annotated[
    str | None,
    typer.Option(help="The workers of a Dask cluster instead: its scheduler, tcp://HOST:PORT."),
]


def chosen_executor(threads: int | None, processes: int | None, scheduler: str | None) -> Executor:
    """The one that was asked for."""
    from energymargin.executors import Processes, Threads

    require_one(threads=threads, processes=processes, scheduler=scheduler)
    if scheduler is not None:
        return cluster(scheduler)
    return Threads(threads) if processes is None else Processes(processes)


def cluster(scheduler: str) -> Dask:
    """Its workers; what they lack is said."""
    from energymargin.executors import Dask

    return Dask(scheduler, notice=lambda text: say(f"[yellow]{escape(text)}[/]"))


def require_one(**options: Any) -> None:
    """Raises ValueError if more than one of these options is given."""
    given = [name for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"--{given[0]} and --{given[1]} are given, expected one of them")
