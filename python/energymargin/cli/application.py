"""The command line: energymargin demo | tasks | generate | import | score | evaluate | export |
learn | rank | grasps | report | view. Each command has its own file; other packages register more,
as `reproduce`.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

import sqlite3
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from importlib.metadata import EntryPoint, entry_points
from traceback import format_exception
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperCommand, TyperGroup

from energymargin.base.bars import bars_by
from energymargin.base.interrupts import interrupted, remembered_interrupts
from energymargin.cli.demo import demo
from energymargin.cli.evaluate import evaluate
from energymargin.cli.export import export
from energymargin.cli.fields import described
from energymargin.cli.generate import generate
from energymargin.cli.grasps import grasps
from energymargin.cli.importing import import_recordings
from energymargin.cli.learn import learn
from energymargin.cli.rank import rank
from energymargin.cli.report import report
from energymargin.cli.score import score
from energymargin.cli.tasks import tasks
from energymargin.cli.terminal import (
    BAD_INPUT,
    INTERRUPTED,
    TIMED_OUT,
    err,
    leave,
    say,
    shown_warnings,
    warn,
)
from energymargin.cli.view import view_command

# Errors that are shown as one line: those of bad input, of files and of other packages. Any other
# is a bug, and shown in full.
ERRORS = (ValueError, OSError, ImportError, MemoryError, RuntimeError, sqlite3.Error)


TRACEBACK = "--traceback"
GROUP = "energymargin.commands"
"""Entry points of this group name Typer apps: the commands that other packages register."""


class _Commands(TyperGroup):
    def parse_args(  # type: ignore[override]
        self, ctx: typer.Context, args: list[str]
    ) -> list[str]:
        """Takes --traceback anywhere."""
        if TRACEBACK in args:
            args = [TRACEBACK, *(word for word in args if word != TRACEBACK)]
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: Any) -> list[str]:
        registered = {entry.name for entry in entry_points(group=GROUP)}
        return [*super().list_commands(ctx), *sorted(registered)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        return super().get_command(ctx, cmd_name) or _registered_command(cmd_name)

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        with remembered_interrupts(), bars_by(_bar), shown_warnings():
            try:
                return super().invoke(ctx)
            except typer.Exit:  # how --help ends: a RuntimeError, but no error
                raise
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt) or interrupted():
                    warn("stopped")
                    raise typer.Exit(INTERRUPTED) from None
                if isinstance(error, ERRORS):
                    if ctx.params["traceback"]:
                        err.print("".join(format_exception(error)), soft_wrap=True, markup=False)
                    late = isinstance(error, TimeoutError) and error.errno is None
                    start = "[yellow]nothing is finished:[/]" if late else "[red]error:[/]"
                    say(f"{start} {escape(_one_line(error))}")
                    raise typer.Exit(TIMED_OUT if late else BAD_INPUT) from None
                raise


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="""How robust is a manipulation, right now? Scores of robustness from energy margins.

    From nothing to a table and pictures: `energymargin demo`. Or step by step:

    1. `energymargin generate push -o push.h5`
    2. `energymargin score push.h5 -o push-scores.db`
    3. `energymargin evaluate push-scores.db`
    4. `energymargin report push-scores.db -o report.html`
    5. `energymargin view push.h5 --scores push-scores.db`

    Which of several plans holds best: `energymargin rank --help`. Which grasps of a file:
    `energymargin grasps --help`. The paper's tables again: `energymargin reproduce --help`.
    """,
)


def _bar(title: str, unit: str) -> AbstractContextManager[Callable[[int, int], None]]:
    from energymargin.cli.progress import progress_bar

    return progress_bar(err, title, unit)


def _show_version(wanted: bool) -> None:
    if wanted:
        from energymargin import __version__

        typer.echo(f"energymargin {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
    traceback: Annotated[
        bool,
        typer.Option(
            TRACEBACK, help="Show where an error comes from, line by line; after a command too."
        ),
    ] = False,
) -> None:
    pass


for command in (demo, tasks, generate, score, evaluate, export, learn, rank, grasps, report):
    app.command()(described(command))
app.command("import")(described(import_recordings))
app.command("view")(described(view_command))


def main() -> None:
    """Entry point of the command `energymargin`."""
    sys.unraisablehook = _unless_interrupted(sys.unraisablehook)
    try:
        app()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            leave(INTERRUPTED)
        raise


def _unless_interrupted(hook: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Does not report a Ctrl-C that Python swallows: it is raised again."""
    return lambda lost: None if issubclass(lost.exc_type, KeyboardInterrupt) else hook(lost)


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


def _registered_command(name: str) -> Any:
    """The command of that name; None if there is none. A command whose package cannot be imported
    says so when it is called."""
    for entry in entry_points(group=GROUP, name=name):
        try:
            command: Any = typer.main.get_command(entry.load())
        except ImportError as error:
            command = _unusable(entry, error)
        command.name = name
        return command
    return None


def _unusable(entry: EntryPoint, error: ImportError) -> TyperCommand:
    """A command that takes whatever it is given, and raises ImportError."""
    package = entry.module.partition(".")[0]
    need = f"needs the package {package}, which cannot be imported"
    way_out = f"({error}): install {package}, or energymargin as a whole"

    def refuse() -> None:
        raise ImportError(f"`energymargin {entry.name}` {need} {way_out}")

    anything = {"allow_extra_args": True, "ignore_unknown_options": True}
    help = f"This command {need}."
    return TyperCommand(entry.name, callback=refuse, help=help, context_settings=anything)
