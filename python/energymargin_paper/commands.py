"""A study at the terminal: its command, whose options are its settings."""

from __future__ import annotations

import inspect
import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from datetime import date
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter
from rich.markup import escape

from energymargin.base.replacing import replace_figure, replace_text
from energymargin.base.settings import flag_of
from energymargin.cli.options import WHERE, Output, in_words, options_of
from energymargin.cli.terminal import MARK, require_own_folder, say
from energymargin_paper import STUDIES, load
from energymargin_paper.pages import FILE, Head
from energymargin_paper.pieces import PIECES
from energymargin_paper.study import Study

__all__ = ["command", "make", "typed"]

ARGS = """Args:
    output: Folder for all files; out/{name}, or out/{name}-quick if not given.
    quick: A first picture: {quick}.
    overwrite: Take a folder that has files of others too, and replace those of the same names.
    threads: Threads; all cores if not given. Numbers do not depend on it.
"""


def command(study: Study[Any, Any]) -> App:
    """The command of a study: its settings as options, a folder, --quick and --threads."""

    @options_of(study.settings, *(own.name for own in fields(study.settings) if own.metadata))
    def run(
        *,
        output: Output = None,
        quick: bool = False,
        overwrite: bool = False,
        threads: int | None = None,
        **given: Any,
    ) -> None:
        folder = output or Path("out", f"{study.name}-quick" if quick else study.name)
        settings = replace(study.quick if quick else study.settings, **given)
        make(study, settings, folder, threads, overwrite=overwrite)

    there = Parameter(group=WHERE, parse=study.threaded)
    run.__annotations__["threads"] = Annotated[int | None, there]
    args = ARGS.format(name=study.name, quick=" ".join(_options(study.quick, study.settings)))
    run.__doc__ = f"{inspect.getdoc(study)}\n\n{_time(study)}\n\n{args}"
    app = _Command(name=study.name)
    app.default(run)
    return app


class _Command(App):
    """A command whose help is that of its study, not the line of it in the list of studies."""

    help = property(App.help.fget, lambda self, line: None)  # type: ignore[attr-defined]


def __getattr__(name: str) -> App:
    """The command of the study of this name, as the app of all imports it."""
    if name not in STUDIES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return command(load(name))


def typed(study: Study[Any, Any], settings: Any) -> str:
    """What to type for these settings; a folder of data is DIR."""
    words = _options(settings, study.settings)
    return shlex.join(["energymargin", "reproduce", study.name, *words])


def make(
    study: Study[Any, Any],
    settings: Any,
    folder: Path,
    threads: int | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Makes a study: a progress bar, its tables, its pictures, and what the folder then has.

    Raises ValueError on a folder with files of others, unless they may be replaced, and on one that
    was begun with an engine of other bits.
    """
    require_own_folder(folder, overwrite=overwrite)
    try:
        with _headed(study, settings, folder):
            with study.bar() as progress:
                result = study.reproduce(settings, folder, threads=threads, progress=progress)
            study.show(result)
            _draw(study, result, folder)
    except KeyboardInterrupt:
        kept = f"What is done is kept in {escape(str(folder))}"
        say(f"{kept}; the same command goes on from there.")
        raise
    files = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir())
    shown = ", ".join(name for name in files if name != MARK)
    say(f"In {escape(str(folder))}/: {escape(shown)}")


def _draw(study: Study[Any, Any], result: Any, folder: Path) -> None:
    try:
        for name, figure in study.figures(result):
            replace_figure(folder / name, figure)
    except ImportError as error:
        say(f"No picture, which needs pip install 'energymargin[plots]': {escape(str(error))}")


@contextmanager
def _headed(study: Study[Any, Any], settings: Any, folder: Path) -> Iterator[None]:
    """Writes what makes the study into its folder, and in the end when and how long it took."""
    others = {getattr(settings, "engine", "native"), *study.packages} & {"bullet", "mujoco"}
    head = Head.of_today(
        typed(study, settings),
        improved=study.improved,
        seed=getattr(settings, "seed", ""),
        packages=study.packages,
        engines=sorted(others),
        folders=() if getattr(settings, "data", "") else study.folders,
    )
    before = Head.of_folder(folder)
    if before is not None and before.every_bit != head.every_bit:
        raise ValueError(
            f"{folder} was begun with version {before.version} (bits {before.every_bit}), "
            f"whose scores are others than those of this one (bits {head.every_bit}): remove it, "
            "or choose another -o"
        )
    same = before is not None and before.command == head.command
    begun = sum(os.times()[:4])
    spent = float(before.minutes or 0.0) if before is not None and same else 0.0

    def write(**whole: str) -> None:
        minutes = spent + (sum(os.times()[:4]) - begun) / 60.0
        replace_text(
            folder / FILE, replace(head, **{"minutes": f"{minutes:.3g}", **whole}).lines() + "\n"
        )

    write()
    try:
        yield
    except BaseException:
        write()
        raise
    write(date=date.today().isoformat())


def _options(settings: Any, defaults: Any) -> list[str]:
    """Each setting that is not the default, as an option and its value."""
    words = []
    for own in fields(settings):
        value = getattr(settings, own.name)
        if "help" in own.metadata and value != getattr(defaults, own.name):
            said = [] if value is True else ["DIR" if own.name == "data" else in_words(value)]
            words += [flag_of(own), *said]
    return words


def _time(study: Study[Any, Any]) -> str:
    """How long it takes, and what a stop does."""
    pieces = [piece for piece in PIECES if study.name in (piece.name, piece.study)]
    took = [f"{p.minutes:g} minutes of one processor (`{p.name}` of `all`)" for p in pieces]
    words = [f"It takes {', '.join(took)}."] if took else []
    return " ".join([*words, "Stop it with Ctrl-C: the same command goes on from there."])
