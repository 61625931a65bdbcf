"""A progress bar for counted work, with its rate and the time left (rich)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TaskProgressColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from energymargin.base.interrupts import delayed_interrupts, raise_if_interrupted
from energymargin.cli.terminal import plain

LEFT = (TimeRemainingColumn(), "left")


class _Rate(ProgressColumn):
    """How much is done in a second."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:.1f}/s", style="cyan")


class _Bar(Progress):
    """A bar that is drawn once there is something to show: an error may come first."""

    def show(self, row: TaskID, **change: Any) -> None:
        raise_if_interrupted()
        if not self.live.is_started:
            with delayed_interrupts():  # else rich would be left half begun, and unable to stop
                self.start()
                _drawn.append(self)
        self.update(row, **change)

    def end(self) -> None:
        with delayed_interrupts():
            if self in _drawn:
                _drawn.remove(self)
            if self.live.is_started:
                self.stop()


_drawn: list[_Bar] = []  # on the terminal now; rich draws one at a time


@contextmanager
def progress_bar(console: Console, title: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """Draws a bar while the `with` block runs, which calls `update(done, total)`. Where another bar
    is being drawn it is a row below that, until its end."""
    outer = next((bar for bar in reversed(_drawn) if bar.console is console), None)
    columns = (BarColumn(), MofNCompleteColumn(), "{task.fields[unit]}", _Rate(), *LEFT)
    bar = outer or _Bar("{task.description}", *columns, console=console)
    row = bar.add_task(plain(title), total=None, unit=unit, visible=outer is None)
    try:
        yield lambda done, total: bar.show(row, completed=done, total=total, visible=True)
    finally:
        if outer is None:
            bar.end()
        else:
            bar.remove_task(row)


@contextmanager
def share_bar(console: Console) -> Iterator[Callable[[str, float], None]]:
    """Draws a bar while the `with` block runs, which calls `update(what, share)` with what is being
    done and the share that is done of all."""
    bar = _Bar(
        *("{task.description}", BarColumn(), TaskProgressColumn(), *LEFT),
        console=console,
        transient=True,
        disable=not console.is_terminal,  # elsewhere nothing would be left of it but an empty line
    )
    row = bar.add_task("", total=1.0)
    try:
        yield lambda what, share: bar.show(row, description=plain(what), completed=share)
    finally:
        bar.end()
