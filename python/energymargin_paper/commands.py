"""A study at the terminal: its command, whose options are its settings."""

from __future__ import annotations

import inspect
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.fields import changed, described, in_words, keyword, option
from energymargin.cli.places import MARK, require_own_folder
from energymargin.cli.terminal import say
from energymargin.settings import flag_of
from energymargin_paper.study import Study

__all__ = ["command", "make"]

ARGS = """Args:
    overwrite: Take a folder that has files of others too, and replace those of the same names.
"""


def command(study: Study[Any, Any]) -> Any:
    """The command of a study: its settings as options, a folder, --quick and --threads."""

    def run(
        *,
        output: Path | None,
        quick: bool,
        overwrite: bool,
        threads: int | None = None,
        **given: Any,
    ) -> None:
        folder = output or Path("out", f"{study.name}-quick" if quick else study.name)
        make(
            study,
            changed(study.quick if quick else study.settings, given),
            folder,
            threads,
            overwrite=overwrite,
        )

    parameters = [
        *(option(study.settings, own) for own in fields(study.settings) if "help" in own.metadata),
        *([keyword("threads", int | None)] if study.threaded else []),
        keyword("output", _folder(study)),
        keyword("quick", _quick(study), default=False),
        keyword("overwrite", bool, default=False),
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__doc__ = f"{inspect.getdoc(study)}\n\n{ARGS}"
    app = typer.Typer(add_completion=False, rich_markup_mode="markdown")
    app.command(study.name)(described(run))
    return typer.main.get_command(app)


def make(
    study: Study[Any, Any],
    settings: Any,
    folder: Path,
    threads: int | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Makes a study: a progress bar, its tables, its pictures, and what the folder then has.

    Raises ValueError on a folder with files of others, unless they may be replaced.
    """
    require_own_folder(folder, overwrite=overwrite)
    try:
        with study.bar() as progress:
            result = study.reproduce(settings, folder, threads=threads, progress=progress)
    except KeyboardInterrupt:
        if study.resumes:
            kept = f"What is done is kept in {escape(str(folder))}"
            say(f"{kept}; the same command goes on from there.")
        raise
    study.show(result)
    try:
        for name, figure in study.figures(result):
            figure.savefig(folder / name)
    except ImportError as error:
        say(f"No picture, which needs pip install 'energymargin[plots]': {escape(str(error))}")
    files = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir())
    shown = ", ".join(name for name in files if name != MARK)
    say(f"In {escape(str(folder))}/: {escape(shown)}")


def _folder(study: Study[Any, Any]) -> Any:
    shown = f"out/{study.name}, or out/{study.name}-quick"
    names, text = ("--output", "-o"), "Folder for all files."
    return Annotated[Path | None, typer.Option(*names, help=text, show_default=shown)]


def _quick(study: Study[Any, Any]) -> Any:
    """Its help says what is less in it."""
    less = [
        f"{flag_of(setting)} {in_words(own)}"
        for setting in fields(study.quick)
        if (own := getattr(study.quick, setting.name)) != getattr(study.settings, setting.name)
    ]
    text = f"A first picture: {' '.join(less)}."
    return Annotated[bool, typer.Option("--quick", help=text)]
