"""The command `energymargin reproduce`: one command a study, and one for all of them.

A study's module is imported when its command is called, so that --help answers at once.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperCommand, TyperGroup

from energymargin.cli.options import Threads, split
from energymargin.cli.terminal import err, say
from energymargin_paper import STUDIES, load
from energymargin_paper.commands import command, make
from energymargin_paper.index import Times, write_index

__all__ = ["app", "everything"]

TOGETHER = tuple(name for name in STUDIES if name != "published")  # which needs the authors' data


class _Named(TyperCommand):
    """A study in the list of commands; the whole command is made when it is called."""

    def make_context(self, *args: Any, **more: Any) -> Any:
        assert self.name is not None  # the group gives it one
        return command(load(self.name)).make_context(*args, **more)


class _Studies(TyperGroup):
    """All STUDIES, beside the app's own commands."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [*STUDIES, *super().list_commands(ctx)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name in STUDIES:
            return _Named(cmd_name, help=STUDIES[cmd_name], rich_markup_mode="markdown")
        return super().get_command(ctx, cmd_name)


app = typer.Typer(
    cls=_Studies,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="""The paper's tables and figures, made again, and what its definitions say on paper.

    Example: `energymargin reproduce table1 --quick`
    """,
)


@app.callback()
def _studies() -> None:
    """Makes the app a group, though it has one command of its own."""


@app.command("all")
def everything(
    *,
    only: Annotated[
        str | None,
        typer.Option(help="Which studies, with commas between.", show_default="all but published"),
    ] = None,
    threads: Threads = None,
    output: Annotated[
        Path | None,
        typer.Option(
            *("--output", "-o"),
            help="Folder for all folders.",
            show_default="out/all, or out/all-quick",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="A first picture of everything, in some minutes.")
    ] = False,
) -> None:
    """Every study of this list, into one folder with an index page (index.html, index.md).

    Each goes into a folder of its own, with its numbers and pictures; the page is written again
    after each. The five of the paper take an hour or more on two cores, the walls hours, the others
    one and a half; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce all --only table2,enlarged`
    """
    from energymargin.executors.threads import thread_count

    chosen = list(TOGETHER) if only is None else split(only)
    wrong = [name for name in chosen if name not in TOGETHER]
    if wrong:
        raise ValueError(f"only has {wrong[0]!r}, expected some of {', '.join(TOGETHER)}")
    count = thread_count(threads)
    folder = output or Path("out", "all-quick" if quick else "all")
    folder.mkdir(parents=True, exist_ok=True)
    times = Times(folder / "times.json")
    times.of(chosen[0])  # a file that holds something else is said now, not after hours
    for number, name in enumerate(chosen, 1):
        err.print(f"[bold]{name}[/] ({number} of {len(chosen)}): {STUDIES[name]}")
        begun, one = time.monotonic(), load(name)
        try:
            make(one, one.settings_in_all(quick), folder / name, threads)
        finally:
            times.add(name, time.monotonic() - begun)
        write_index(folder, {name: STUDIES[name] for name in TOGETHER}, times, count)
    say(f"In {escape(str(folder))}/: index.html, index.md, and a folder for each study")
