"""The terminal: what commands print, warnings and progress bars among it, where they write, and how
they end. What is there is replaced with --overwrite alone."""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

from rich import progress
from rich.console import Console, ConsoleOptions, RenderableType
from rich.markup import escape
from rich.segment import Segment
from rich.text import Text

from energymargin.base.bars import Update
from energymargin.base.interrupts import delayed_interrupts, on_interrupt, raise_if_interrupted
from energymargin.base.plausibility import HOW_TO_IGNORE
from energymargin.base.replacing import replace_figure, replace_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    done = (progress.MofNCompleteColumn(), "{task.fields[unit]}", _Rate())
    columns = ("{task.description}", progress.BarColumn(), *done, *LEFT)
    bar = outer or _Bar(*columns, console=console)
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
    columns = ("{task.description}", progress.BarColumn(), progress.TaskProgressColumn(), *LEFT)
    off = not console.is_terminal  # elsewhere nothing would be left of it but an empty line
    bar = _Bar(*columns, console=console, transient=True, disable=off)
    row = bar.add_task("", total=1.0)
    try:
        yield lambda what, share: bar.show(row, description=plain(what), completed=share)
    finally:
        bar.end()


MARK = ".energymargin"
"""The file that marks a folder whose files a command made."""
WRITTEN = ("output", "picture", "store", "view", "write")  # parameters: files that are written
TEXTS, PICTURES, PAGE, STORE = (".csv", ".md"), (".png", ".pdf", ".svg"), ".html", ".db"


def require_apart(arguments: Mapping[str, Any]) -> None:
    """Raises ValueError if a file that a command writes is another one of its files."""
    files: dict[Path, str] = {}
    given: list[tuple[str, Any]] = []
    for name, one in arguments.items():
        given += vars(one).items() if is_dataclass(one) else [(name, one)]
    for name, value in sorted(given, key=lambda one: one[0] in WRITTEN):
        for path in value if isinstance(value, list) else [value]:
            if not isinstance(path, Path):
                continue
            other = files.get(path.resolve())
            if name in WRITTEN and other is not None:
                text = f"--{name} is {path}, which is {other} too"
                raise ValueError(f"{text}: expected another file")
            files[path.resolve()] = name


def require_free(
    path: Path, *, overwrite: bool, option: str = "-o", suffixes: Collection[str] = ()
) -> None:
    """Raises ValueError unless a command may write this file: its name ends with one of the
    suffixes, if there are any, its folder exists, and it does not exist or is to be replaced.
    Raises OSError if nothing can be written into its folder."""
    if suffixes and path.suffix not in suffixes:
        raise ValueError(f"{option} is {path}, expected a name with {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise ValueError(f"{option} is {path}, but there is no folder {path.parent}")
    if path.is_dir():
        raise ValueError(f"{path} is a folder: choose another {option}, the name of a file")
    if os.path.lexists(path) and not overwrite:
        raise ValueError(f"{path} exists: choose another {option}, or give --overwrite")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from error


def require_own_folder(folder: Path, *, overwrite: bool) -> None:
    """Makes and marks the folder of a command that goes on with what it has made there.

    Raises ValueError if it has files that no such command made, unless they may be replaced.
    """
    mark = folder / MARK
    files = folder.is_dir() and any(not path.is_dir() for path in folder.iterdir())
    if files and not (overwrite or mark.exists()):
        text = f"{folder} has files of others: choose another -o, or give --overwrite"
        raise ValueError(f"{text}, which replaces those of the same names")
    folder.mkdir(parents=True, exist_ok=True)
    replace_text(mark, "A command of energymargin made this folder, and goes on with its files.\n")


def dataset_of(scores: Path, data: Path | None) -> Path:
    """The dataset that is given, or the one beside its scores: push.h5 of push-scores.db."""
    return data or scores.with_name(f"{scores.stem.removesuffix('-scores')}.h5")


class Table(Protocol):
    """A result that is shown as a table."""

    def to_markdown(self) -> str:
        """For the terminal, and for a .md file."""
        ...

    def to_csv(self) -> str:
        """All numbers in full precision."""
        ...


def require_outputs(
    outputs: Iterable[Path], *, overwrite: bool, suffixes: Collection[str] = TEXTS
) -> None:
    """Checks where a result is to be written before it is computed: as `require_free`, and that
    there is what draws its pictures and pages. A file of scores is never replaced, but goes on."""
    for path in outputs:
        require_free(path, overwrite=overwrite or path.suffix == STORE, suffixes=suffixes)
        if path.suffix in PICTURES:
            import energymargin.plots
        if path.suffix == PAGE:
            import energymargin.report  # noqa: F401


def print_markdown(text: str) -> None:
    """Prints a table as it is."""
    out.print(text, markup=False, highlight=False, soft_wrap=True)


def show_table(
    result: Table, outputs: Iterable[Path], done: str, plot: Callable[[], Axes] | None = None
) -> None:
    """Prints the table of a result, and writes it, or what `plot` draws, by the files' suffixes.
    Ends the command as `require_complete` if it was stopped before it was `done`."""
    table = result.to_markdown()
    print_markdown(table)
    for path in outputs:
        if plot is not None and path.suffix in PICTURES:
            write_plot(path, plot())
        else:
            replace_text(path, result.to_csv() if path.suffix == ".csv" else table)
    say_written(outputs)
    require_complete(result, done)


def write_plot(path: Path, axes: Any) -> None:
    """Writes the figure of these axes."""
    replace_figure(path, axes.get_figure(root=True))


def say_written(paths: Iterable[Path]) -> None:
    """Prints which files were written."""
    for path in paths:
        say(f"Wrote {escape(str(path))}")


def require_complete(result: Any, what: str) -> None:
    """Ends the command unless the result is complete: the time was over before `what`."""
    if not result.complete:
        warn(f"the time was over before {what}")
        raise SystemExit(TIMED_OUT)
