"""The command `energymargin reproduce`: one command a study, and one for all, with an index page.

A study's module is imported when its command is called, so that --help answers at once.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperCommand, TyperGroup

from energymargin.cli.fields import described, split
from energymargin.cli.places import MARK, require_own_folder
from energymargin.cli.terminal import err, say
from energymargin.replacing import replace_text
from energymargin.table_text import markdown_table
from energymargin_paper import STUDIES, load
from energymargin_paper.commands import command, make

__all__ = ["app", "everything"]

OF_OTHERS = ("published", "grasps")  # which need data that are not here
TOGETHER = tuple(name for name in STUDIES if name not in OF_OTHERS)
STYLE = """
body { font: 16px/1.5 sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0; }
td, th { border: 1px solid #ccc; padding: .2em .6em; vertical-align: top; }
img { max-width: 100%; }
"""


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


def everything(
    *,
    only: Annotated[
        str | None,
        typer.Option(
            help="Which studies, separated by commas.", show_default="all but published and grasps"
        ),
    ] = None,
    threads: int | None = None,
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
    overwrite: bool = False,
) -> None:
    """Every study of this list, into one folder with an index page (index.html, index.md).

    Each goes into a folder of its own, with its numbers and pictures; the page is written again
    after each. The three of the paper take an hour or more on two cores, the others one and a
    half; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce all --only table1,table2`

    Args:
        overwrite: Take a folder that has files of others too, and replace those of the same
            names.
    """
    from energymargin.checks import core_count

    chosen = list(TOGETHER) if only is None else split(only)
    wrong = [name for name in chosen if name not in TOGETHER]
    if wrong:
        raise ValueError(f"only has {wrong[0]!r}, expected some of {', '.join(TOGETHER)}")
    count = core_count("threads", threads)
    folder = output or Path("out", "all-quick" if quick else "all")
    require_own_folder(folder, overwrite=overwrite)
    times = Times(folder / "times.json")
    times.of(chosen[0])  # raises now, not after hours, if the file holds something else
    for number, name in enumerate(chosen, 1):
        err.print(f"[bold]{name}[/] ({number} of {len(chosen)}): {STUDIES[name]}")
        begun, one = time.monotonic(), load(name)
        try:
            make(one, one.settings_in_all(quick), folder / name, threads, overwrite=overwrite)
        finally:
            times.add(name, time.monotonic() - begun)
        write_index(folder, {name: STUDIES[name] for name in TOGETHER}, times, count)
    say(f"In {escape(str(folder))}/: index.html, index.md, and a folder for each study")


app.command("all")(described(everything))


def write_index(folder: Path, studies: Mapping[str, str], times: Times, threads: int) -> None:
    """Writes index.md and index.html in a folder that has one folder a study.

    `studies`: what each shows, by its name; those that are not there are named as such.
    """
    done = [name for name in studies if any((folder / name).glob("*.md"))]
    rows = [
        (f"[{name}](#{name})", shows, _minutes(times.of(name)))
        if name in done
        else (name, shows, "not yet")
        for name, shows in studies.items()
    ]
    lines = [
        "# The studies of Energy Margin",
        "",
        f"Made by `energymargin reproduce all` with version {version('energymargin')}, "
        f"on {threads} threads.",
        "",
        markdown_table(("", "", "time"), rows),
    ]
    for name in done:
        lines += ["", f'<a id="{name}"></a>', "", *_section(folder, name)]
    text = "\n".join(lines) + "\n"
    replace_text(folder / "index.md", text)
    replace_text(folder / "index.html", _page(text))


def _section(folder: Path, name: str) -> list[str]:
    """A study's own text, one level lower, its pictures and its files."""
    own = folder / name
    lines = []
    for text in sorted(own.glob("*.md")):
        lines += [re.sub(r"(?m)^#", "##", text.read_text().rstrip()), ""]
    for picture in sorted(own.glob("*.png")):
        lines += [f"![{picture.stem}]({name}/{picture.name})", ""]
    files = sorted(path.name for path in own.iterdir() if path.is_file() and path.name != MARK)
    links = ", ".join(f"[{file}]({name}/{file})" for file in files)
    return [*lines, f"Files: {links}. The command: `energymargin reproduce {name}`."]


def _page(text: str) -> str:
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark", {"html": True}).enable("table").render(text)
    head = f'<meta charset="utf-8"><title>Energy Margin</title><style>{STYLE}</style>'
    return f"<!doctype html><html><head>{head}</head><body>{body}</body></html>\n"


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


@dataclass(frozen=True)
class Times:
    """How long each study of a folder took in all its calls [s], in a file."""

    path: Path

    def of(self, study: str) -> float:
        """0 if it was never run; ValueError if the file holds something else."""
        return self._all().get(study, 0.0)

    def add(self, study: str, seconds: float) -> None:
        """Adds a call of a study."""
        times = {**self._all(), study: self.of(study) + seconds}
        replace_text(self.path, json.dumps(times, indent=1))

    def _all(self) -> dict[str, float]:
        if not self.path.exists():
            return {}
        try:
            times = json.loads(self.path.read_text())
            return {str(name): float(seconds) for name, seconds in times.items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"{self.path} holds no times of studies: remove it") from error
