"""How robust is a manipulation, right now? Scores of robustness from energy margins.

From nothing to a table and pictures: `energymargin demo`. Or step by step:

1. `energymargin generate push -o push.h5`
2. `energymargin score push.h5 -o push-scores.db`
3. `energymargin evaluate push-scores.db`
4. `energymargin report push-scores.db -o report.html`
5. `energymargin view push.h5 --scores push-scores.db -o push.html`

Which of several plans holds best: `energymargin rank --help`. How much it can take:
`energymargin limits --help`. Is a scene at rest: `energymargin settle --help`. Where to
set a thing down: `energymargin placements --help`. Which grasps of a file:
`energymargin grasps --help`. The paper's tables again: `energymargin reproduce --help`.

`--traceback`, anywhere: show where an error comes from, line by line.
"""

# The application joins the commands, each of which has its own file; other packages register more,
# as `reproduce`. Its help is this file's docstring. A command is imported when it is called, and
# heavy modules where they are used, so that --help answers at once.

from __future__ import annotations

import sqlite3
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points, version
from traceback import format_exception
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter
from rich.markup import escape

from energymargin.base.bars import bars_by
from energymargin.base.interrupts import interrupted, remembered_interrupts
from energymargin.cli import terminal
from energymargin.cli.options import shown_default

# Errors that are shown as one line: those of bad input, of files and of other packages. Any other
# is a bug, and shown in full.
ERRORS = (CycloptsError, ValueError, OSError, ImportError, MemoryError, RuntimeError, sqlite3.Error)

TRACEBACK = "--traceback"
GROUP = "energymargin.commands"
"""Entry points of this group name functions or cyclopts Apps: commands of other packages."""
OWN = (
    *("demo", "tasks", "generate", "score", "evaluate", "export", "learn", "rank", "compare"),
    *("limits", "settle", "doctor", "placements", "grasps", "report", "import", "view"),
)


app = App(
    name="energymargin",
    help=__doc__,
    help_format="markdown",
    help_flags="--help",
    version=lambda: f"energymargin {version('energymargin')}",
    version_flags="--version",
    default_parameter=Parameter(negative=(), show_default=shown_default, allow_repeating=True),
    exit_on_error=False,
    print_error=False,
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
for _flag in ("--help", "--version"):
    app[_flag].group = "Options"
for _number, _name in enumerate(OWN):
    _file = "importing" if _name == "import" else _name
    app.command(f"energymargin.cli.{_file}:{_file}", name=_name, sort_key=_number)
for _name in sorted({entry.name for entry in entry_points(group=GROUP)} - set(OWN)):
    app.command(f"{__name__}:{_name}", name=_name, sort_key=len(OWN))


def __getattr__(name: str) -> Any:
    """The command of another package. One that cannot be imported says so when it is called."""
    for entry in entry_points(group=GROUP, name=name):
        try:
            return entry.load()
        except ImportError as error:
            return _unusable(entry, error)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _unusable(entry: EntryPoint, error: ImportError) -> Callable[..., None]:
    """A command that takes whatever it is given, and raises ImportError."""
    package = entry.module.partition(".")[0]
    need = f"needs the package {package}, which cannot be imported"
    way_out = f"({error}): install {package}, or energymargin as a whole"

    def refuse(*words: Annotated[str, Parameter(allow_leading_hyphen=True, show=False)]) -> None:
        raise ImportError(f"`energymargin {entry.name}` {need} {way_out}")

    refuse.__doc__ = f"This command {need}."
    return refuse


def run(words: Sequence[str] | None = None) -> int:
    """Runs a command, by default that of the terminal, and returns its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    with remembered_interrupts(), bars_by(terminal.progress_bar), terminal.shown_warnings():
        try:
            if words[:1] in ([], ["--help"]):
                app.resolved_commands()  # whose first lines it shows
            command, given, _ = app.parse_args([word for word in words if word != TRACEBACK])
            terminal.require_apart(given.arguments)
            command(*given.args, **given.kwargs)
        except SystemExit as end:
            return int(end.code or 0)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) or interrupted():
                terminal.warn("stopped")
                return terminal.INTERRUPTED
            if not isinstance(error, ERRORS):
                raise
            if TRACEBACK in words:
                terminal.err.print("".join(format_exception(error)), soft_wrap=True, markup=False)
            late = isinstance(error, TimeoutError) and error.errno is None
            start = "[yellow]nothing is finished:[/]" if late else "[red]error:[/]"
            terminal.say(f"{start} {escape(_one_line(error))}")
            return terminal.TIMED_OUT if late else terminal.BAD_INPUT
    return 0


def main() -> None:
    """Entry point of the command `energymargin`."""
    sys.unraisablehook = _unless_interrupted(sys.unraisablehook)
    code = run()
    if code == terminal.INTERRUPTED:
        terminal.leave(code)
    sys.exit(code)


def _unless_interrupted(hook: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Does not report a Ctrl-C that Python swallows: it is raised again."""
    return lambda lost: None if issubclass(lost.exc_type, KeyboardInterrupt) else hook(lost)


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    if isinstance(error, CycloptsError):
        command = " ".join((*app.name, *(error.command_chain or ())))
        return f"{text} `{command} --help` shows what it takes."
    return text
