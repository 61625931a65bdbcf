"""What the commands of `energymargin reproduce` share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypeVar

import typer
from rich.markup import escape

from energymargin.cli.progress import progress_bar
from energymargin.cli.terminal import err, out, say

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

__all__ = ["Folder", "Quick", "app", "changed", "folder_of", "picture", "run", "show"]

Folder = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="Folder for all files.",
        show_default="out/COMMAND, or out/COMMAND-quick",
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="A first picture in seconds: less of all.")]

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="""The paper's tables and figures, made again, and what its definitions say on paper.

    Example: `energymargin reproduce table1 --quick`
    """,
)


class _Result(Protocol):
    def to_markdown(self) -> str: ...


Result = TypeVar("Result", bound=_Result)
Settings = TypeVar("Settings", bound="DataclassInstance")


def folder_of(output: Path | None, study: str, quick: bool) -> Path:
    """Where a study's files go, if --output does not say it."""
    return output or Path("out", f"{study}-quick" if quick else study)


def changed(settings: Settings, **given: object) -> Settings:
    """Settings of a study, with what was given at the terminal; None was not."""
    chosen: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    return replace(settings, **chosen)


def run(
    reproduce: Callable[..., Result],
    settings: object,
    folder: Path,
    threads: int | None,
    *,
    title: str,
    unit: str,
) -> Result:
    """What a study's `reproduce` gives, under a progress bar with a title that counts a unit; its
    tables are shown."""
    try:
        with progress_bar(err, title, unit) as progress:
            result = reproduce(settings, folder, threads=threads, progress=progress)
    except KeyboardInterrupt:
        say(f"What is done is kept in {escape(str(folder))}; the same command goes on from there.")
        raise
    out.print(result.to_markdown(), markup=False, highlight=False, soft_wrap=True)
    return result


def show(output: Path, name: str, draw: Callable[[], Any] | None, *more: str) -> None:
    """Saves the figure that `draw` makes, if there is one to make, and says what the folder has:
    the study's own files, which have its name, and `more`."""
    drawn = [] if draw is None else [picture(output / f"{name}.png", draw)]
    files = ", ".join([f"{name}.md", f"{name}.csv", *drawn, *more])
    say(f"In {escape(str(output))}/: {files}")


def picture(path: Path, draw: Callable[[], Any]) -> str:
    """Saves the figure that `draw` makes, and gives its name; or says why there is none."""
    if find_spec("matplotlib") is None:
        return "and no picture: it needs pip install 'energymargin[plots]'"
    draw().savefig(path)
    return path.name
