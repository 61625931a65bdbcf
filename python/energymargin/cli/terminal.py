"""The terminal: what commands print, warnings and progress bars among it, and how they end."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, NoReturn

from rich import progress
from rich.console import Console, ConsoleOptions, RenderableType
from rich.markup import escape
from rich.segment import Segment
from rich.text import Text

from energymargin.base.bars import Update
from energymargin.base.interrupts import delayed_interrupts, on_interrupt, raise_if_interrupted
from energymargin.base.plausibility import HOW_TO_IGNORE

# Exit codes, as shells know them.
BAD_INPUT = 2
TIMED_OUT = 124
INTERRUPTED = 130

# What makes a terminal do something other than show text, or show it in another order: control
# characters but for new lines and tabs, and marks of direction.
_COMMANDS = {
    code: None
    for codes in (range(9), range(11, 32), range(127, 160), range(0x202A, 0x202F))
    for code in codes
} | dict.fromkeys((0x200E, 0x200F, 0x61C, *range(0x2066, 0x206A)))


def plain(text: str) -> str:
    """The text without characters that command a terminal."""
    return text.translate(_COMMANDS)


class _Console(Console):
    """One that prints no characters which command a terminal: names are of files."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(plain(text), style)


out, err = _Console(), _Console(stderr=True)


def say(text: str) -> None:
    """Prints a line on stderr, for the user; what a command computes goes to stdout."""
    err.print(text, soft_wrap=True, highlight=False)


def warn(text: str) -> None:
    """Prints a line as it is, as a warning."""
    say(f"[yellow]{escape(text)}[/]")


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
        warn("stopped")
        leave(INTERRUPTED)

    return on_interrupt(stop)


@contextmanager
def shown_warnings() -> Iterator[None]:
    """While it lasts, a UserWarning is a line on stderr; others are shown as ever, with their
    place."""
    as_ever = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, UserWarning):
            as_ever(message, category, *place, **more)
            return
        text = " ".join(str(message).removesuffix(HOW_TO_IGNORE).split())
        say(f"[yellow]warning:[/] {escape(text)}")

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = as_ever


LEFT = (progress.TimeRemainingColumn(), "left")


class _Rate(progress.ProgressColumn):
    """How much is done in a second."""

    def render(self, task: progress.Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:.1f}/s", style="cyan")


class _Bar(progress.Progress):
    """A bar that is drawn once there is something to show: an error may come first."""

    def show(self, row: progress.TaskID, **change: Any) -> None:
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
def progress_bar(title: str, unit: str, console: Console = err) -> Iterator[Update]:
    """Draws a bar while the `with` block runs, which calls `update(done, total)`. Where another bar
    is being drawn it is a row below that, until its end."""
    outer = next((bar for bar in reversed(_drawn) if bar.console is console), None)
    columns = (
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        "{task.fields[unit]}",
        _Rate(),
        *LEFT,
    )
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
def share_bar(console: Console = err) -> Iterator[Callable[[str, float], None]]:
    """Draws a bar while the `with` block runs, which calls `update(what, share)` with what is being
    done and the share that is done of all."""
    bar = _Bar(
        *("{task.description}", progress.BarColumn(), progress.TaskProgressColumn(), *LEFT),
        console=console,
        transient=True,
        disable=not console.is_terminal,  # elsewhere nothing would be left of it but an empty line
    )
    row = bar.add_task("", total=1.0)
    try:
        yield lambda what, share: bar.show(row, description=plain(what), completed=share)
    finally:
        bar.end()
