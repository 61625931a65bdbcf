"""Options of a command: its own, from its signature and docstring, and the fields of its settings.

A docstring says what an option does below `Args:`, as that of any function, and SHARED what those
of several commands do. Other headings are those of the command's help:

    Args:
        data: A dataset, from `energymargin generate`.
        output: The scores; DATA-scores.db if not given.
    Where it runs:
        processes: So many processes instead of threads.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import Field, fields, replace
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import typer

from energymargin.base.settings import flag_of
from energymargin.cli.options import SHARED

Command = TypeVar("Command", bound=Callable[..., None])
Settings = TypeVar("Settings")

# The words of options that have others than their name.
FLAGS = {
    "output": ("--output", "-o"),
    "parameter": ("--parameter", "-p"),
    "open_browser": ("--open",),
}


def described(command: Command) -> Command:
    """A command whose options have the help in its docstring, or that of SHARED."""
    text, _, entries = (inspect.getdoc(command) or "").partition("\n\nArgs:\n")
    helps = {name: text for shared in SHARED.values() for name, text in shared.items()}
    panels = {name: heading or "" for heading, shared in SHARED.items() for name in shared}
    panel = name = ""
    for line in entries.splitlines():
        if not line.startswith(" "):
            panel = line.removesuffix(":")
        elif line.startswith(" " * 8):
            helps[name] += f" {line.strip()}"
        else:
            name, _, helps[name] = line.strip().partition(": ")
            panels[name] = panel
    signature = inspect.signature(command, eval_str=True)
    parameters = [
        _own(each, helps[each.name], panels[each.name] or None)
        if each.name in helps and get_origin(each.annotation) is not Annotated
        else each
        for each in signature.parameters.values()
    ]
    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__doc__ = text
    return command


def options_of(
    settings: Any, *names: str, panel: str | None = None
) -> Callable[[Command], Command]:
    """Decorates a command with the options of these fields, which it gets as **given.

    `settings` has their defaults. `panel` is the heading in the command's help.
    """

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True)
        named = {own.name: own for own in fields(settings)}
        added = [option(settings, named[name], panel) for name in names]
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        signature = signature.replace(parameters=[*own, *added])
        command.__signature__ = signature  # type: ignore[attr-defined]
        return command

    return decorate


def changed(settings: Settings, given: dict[str, Any]) -> Settings:
    """Settings with what was given at the terminal; None was not."""
    types, values = get_type_hints(type(settings)), {}
    for name, value in given.items():
        if value is not None:
            kind = SEVERAL.get(types[name])
            several = kind and tuple(as_number(kind, name, word) for word in split(value))
            values[name] = value if several is None else several
    return replace(settings, **values)  # type: ignore[type-var]


def option(settings: Any, setting: Field[Any], panel: str | None = None) -> inspect.Parameter:
    """The option of a field; None is its value if it is not given."""
    default = getattr(settings, setting.name)
    kind, choices = _type(get_type_hints(type(settings))[setting.name])
    shown = setting.metadata["shown"] or ("" if default is None else in_words(default))
    info = typer.Option(
        flag_of(setting),
        help=setting.metadata["help"]
        + (f" [default: {shown}]" if shown and kind is not bool else ""),
        show_default=False,
        metavar=choices,
        rich_help_panel=panel,
    )
    return keyword(setting.name, Annotated[kind | None, info])


def keyword(name: str, annotation: Any, *, default: Any = None) -> inspect.Parameter:
    """An option of a command whose signature is made."""
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default, annotation=annotation)


def in_words(value: Any) -> str:
    """As it is typed: several separated by commas."""
    return ",".join(map(in_words, value)) if isinstance(value, tuple) else f"{value}"


def split(words: str) -> list[str]:
    """The words between commas."""
    return [word.strip() for word in words.split(",")]


def as_number(kind: Callable[[str], Any], name: str, word: str) -> Any:
    """A number of this kind, int or float. Raises ValueError if the word is none."""
    try:
        return kind(word)
    except ValueError:
        what = "whole numbers" if kind is int else "numbers"
        raise ValueError(f"{name} has {word!r}, expected {what}") from None


# The kind of one value, by the type of a setting that has several.
SEVERAL: dict[Any, Callable[[str], Any]] = {
    tuple[int, ...]: int,
    tuple[float, ...]: float,
    tuple[str, ...]: str,
}


def _own(parameter: inspect.Parameter, text: str, panel: str | None) -> inspect.Parameter:
    """A parameter of a command as an argument, or if it is a keyword as an option."""
    kind, choices = _type(parameter.annotation)
    if parameter.kind is not parameter.KEYWORD_ONLY:
        info = typer.Argument(help=text)
    else:
        flag = f"--{parameter.name.replace('_', '-')}"
        if parameter.default is True:
            flag += f"/--no-{flag.removeprefix('--')}"
        flags = FLAGS.get(parameter.name, (flag,))
        info = typer.Option(*flags, help=text, metavar=choices, rich_help_panel=panel)
    annotation = kind | None if parameter.default is None else kind
    return parameter.replace(annotation=Annotated[annotation, info])


def _type(hint: Any) -> tuple[Any, str | None]:
    """What typer reads for a hint, which also may be None; and the words that it may be."""
    if NoneType in get_args(hint):
        (hint,) = (kind for kind in get_args(hint) if kind is not NoneType)
    words = [word for word in get_args(hint) if isinstance(word, str)]
    return (str if words or hint in SEVERAL else hint), "|".join(words) or None
