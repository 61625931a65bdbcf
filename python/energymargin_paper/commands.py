"""A study at the terminal: its command, whose options are its settings."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import Field, fields, replace
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from rich.markup import escape

from energymargin.cli.options import OverwriteFolderOption, ThreadsOption, real, split, whole
from energymargin.cli.places import MARK, require_own_folder
from energymargin.cli.terminal import say
from energymargin_paper.study import Study

__all__ = ["command", "make"]

# By the type of a setting that has several values: one of them, from the setting's name and a word.
SEVERAL: dict[Any, Callable[[str, str], Any]] = {
    tuple[int, ...]: whole,
    tuple[float, ...]: real,
    tuple[str, ...]: lambda _name, word: word,
}


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
        make(study, _settings(study, quick, given), folder, threads, overwrite=overwrite)

    parameters = [
        *(_option(study, own) for own in fields(study.settings) if "help" in own.metadata),
        *([_keyword("threads", ThreadsOption)] if study.threaded else []),
        _keyword("output", _folder(study)),
        _keyword("quick", _quick(study), default=False),
        _keyword("overwrite", OverwriteFolderOption, default=False),
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__doc__ = study.__doc__
    app = typer.Typer(add_completion=False, rich_markup_mode="markdown")
    app.command(study.name)(run)
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


def _settings(study: Study[Any, Any], quick: bool, given: dict[str, Any]) -> Any:
    """Those of the study, with what was given at the terminal; None was not."""
    types, changed = get_type_hints(type(study.settings)), {}
    for name, value in given.items():
        if value is not None:
            one = SEVERAL.get(types[name])
            changed[name] = tuple(one(name, word) for word in split(value)) if one else value
    return replace(study.quick if quick else study.settings, **changed)


def _option(study: Study[Any, Any], setting: Field[Any]) -> inspect.Parameter:
    kind = get_type_hints(type(study.settings))[setting.name]
    typed = str if kind in SEVERAL else kind
    shown = setting.metadata["shown"] or _in_words(getattr(study.settings, setting.name))
    option = typer.Option(help=setting.metadata["help"], show_default=shown)
    return _keyword(setting.name, Annotated[typed | None, option])


def _folder(study: Study[Any, Any]) -> Any:
    shown = f"out/{study.name}, or out/{study.name}-quick"
    names, text = ("--output", "-o"), "Folder for all files."
    return Annotated[Path | None, typer.Option(*names, help=text, show_default=shown)]


def _quick(study: Study[Any, Any]) -> Any:
    """Its help says what is less in it."""
    less = [
        f"--{setting.name.replace('_', '-')} {_in_words(own)}"
        for setting in fields(study.quick)
        if (own := getattr(study.quick, setting.name)) != getattr(study.settings, setting.name)
    ]
    text = f"A first picture: {' '.join(less)}."
    return Annotated[bool, typer.Option("--quick", help=text)]


def _keyword(name: str, annotation: Any, *, default: Any = None) -> inspect.Parameter:
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


def _in_words(value: Any) -> str:
    """As it is typed: several separated by commas."""
    return ",".join(map(_in_words, value)) if isinstance(value, tuple) else f"{value}"
