"""How commands show and write a result, and how they end where the time was over."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rich.markup import escape

from energymargin.base.replacing import replace_figure, replace_text
from energymargin.cli.places import require_free
from energymargin.cli.terminal import TIMED_OUT, out, say, warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TEXTS, PICTURES = (".csv", ".md"), (".png", ".pdf", ".svg")


class Table(Protocol):
    """A result that is shown as a table."""

    def to_markdown(self) -> str:
        """For the terminal, and for a .md file."""
        ...

    def to_csv(self) -> str:
        """All numbers in full precision."""
        ...


def require_outputs(outputs: Iterable[Path], *, overwrite: bool, pictures: bool = False) -> None:
    """Checks where a result is to be written before it is computed: as `require_free`, and that
    there is matplotlib for its pictures."""
    for path in outputs:
        require_free(path, overwrite=overwrite, suffixes=TEXTS + PICTURES * pictures)
        if path.suffix in PICTURES:
            import energymargin.plots  # noqa: F401


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
