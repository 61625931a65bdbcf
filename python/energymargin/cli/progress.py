"""A progress bar for counted work, with its rate and the time left (rich)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from energymargin.interrupts import delayed_interrupts, raise_if_interrupted

_drawn: list[Progress] = []  # on the terminal now; rich draws one at a time


class _Rate(ProgressColumn):
    """How much is done in a second."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:.1f}/s", style="cyan")


@contextmanager
def progress_bar(console: Console, title: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """Draws a bar while the `with` block runs, which calls `update(done, total)`."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[unit]}"),
        _Rate(),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
    )
    bar = progress.add_task(title, total=None, unit=unit)

    def update(done: int, total: int) -> None:
        raise_if_interrupted()
        _start(progress)  # not before there is something to count: an error may come first
        progress.update(bar, completed=done, total=total)

    with _stopped(progress):
        yield update


@contextmanager
def share_bar(console: Console) -> Iterator[Callable[[str, float], None]]:
    """Draws a bar while the `with` block runs, which calls `update(what, share)` with what is being
    done and the share that is done of all."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
        transient=True,
        disable=not console.is_terminal,  # elsewhere nothing would be left of it but an empty line
    )
    bar = progress.add_task("", total=1.0)

    def update(what: str, share: float) -> None:
        raise_if_interrupted()
        _start(progress)
        progress.update(bar, description=what, completed=share)

    with _stopped(progress):
        yield update


@contextmanager
def inner_bar(console: Console, title: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """As `progress_bar`; where another bar is being drawn it is a row below that, until its end."""
    outer = next((p for p in reversed(_drawn) if p.console is console and p.live.is_started), None)
    if outer is None:
        with progress_bar(console, title, unit) as update:
            yield update
        return
    row = outer.add_task(title, total=None, unit=unit, visible=False)

    def update_row(done: int, total: int) -> None:
        raise_if_interrupted()
        outer.update(row, completed=done, total=total, visible=True)

    try:
        yield update_row
    finally:
        outer.remove_task(row)


def _start(progress: Progress) -> None:
    """Begins to draw it; an interrupt would leave rich half begun, and unable to stop."""
    if not progress.live.is_started:
        with delayed_interrupts():
            progress.start()
            _drawn.append(progress)


@contextmanager
def _stopped(progress: Progress) -> Iterator[None]:
    """At the end the bar is no longer drawn, if it ever was."""
    try:
        yield
    finally:
        with delayed_interrupts():
            if progress in _drawn:
                _drawn.remove(progress)
            if progress.live.is_started:
                progress.stop()
