"""What commands show and where they write: what is there is replaced with --overwrite alone."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rich.markup import escape

from energymargin.base.replacing import replace_figure, replace_text
from energymargin.cli.terminal import TIMED_OUT, out, say, warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARK = ".energymargin"
"""The file that marks a folder whose files a command made."""
TEXTS, PICTURES, PAGE, STORE = (".csv", ".md"), (".png", ".pdf", ".svg"), ".html", ".db"


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
        raise ValueError(
            f"{folder} has files of others: choose another -o, or give --overwrite, which replaces "
            "those of the same names"
        )
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
    result: Table, outputs: Iterable[Path], plot: Callable[[], Axes] | None = None
) -> None:
    """Prints the table of a result, and writes it, or what `plot` draws, by the files' suffixes."""
    table = result.to_markdown()
    print_markdown(table)
    for path in outputs:
        if plot is not None and path.suffix in PICTURES:
            write_plot(path, plot())
        else:
            replace_text(path, result.to_csv() if path.suffix == ".csv" else table)
    say_written(outputs)


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
