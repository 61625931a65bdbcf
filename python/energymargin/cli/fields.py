"""Options of a command that are the fields of its settings, a dataclass made with `setting`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import Field, fields, replace
from types import NoneType
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import typer

Command = TypeVar("Command", bound=Callable[..., None])
Settings = TypeVar("Settings")


def options_of(
    settings: Any, *names: str, panel: str | None = None, **flags: str
) -> Callable[[Command], Command]:
    """Decorates a command with the options of these fields, which it gets as **given.

    `settings` has their defaults. `panel` is the heading in the command's help, `flags` are options
    of another name than their field's.
    """

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True)
        named = {own.name: own for own in fields(settings)}
        added = [option(settings, named[name], panel, flags.get(name)) for name in names]
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
            one = SEVERAL.get(types[name])
            values[name] = tuple(one(name, word) for word in split(value)) if one else value
    return replace(settings, **values)  # type: ignore[type-var]


def option(
    settings: Any, setting: Field[Any], panel: str | None = None, flag: str | None = None
) -> inspect.Parameter:
    """The option of a field; None is its value if it is not given."""
    default = getattr(settings, setting.name)
    kind, choices = _type(get_type_hints(type(settings))[setting.name])
    shown = setting.metadata["shown"] or (False if default is None else in_words(default))
    flags = [flag or f"--{setting.name.replace('_', '-')}"]
    info = typer.Option(
        *(flags if kind is bool or flag else []),
        help=setting.metadata["help"],
        show_default=False if kind is bool else shown,
        metavar="|".join(choices) or None,
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


def whole(name: str, word: str) -> int:
    """A whole number. Raises ValueError if the word is none."""
    try:
        return int(word)
    except ValueError:
        raise ValueError(f"{name} has {word!r}, expected whole numbers") from None


def real(name: str, word: str) -> float:
    """A number. Raises ValueError if the word is none."""
    try:
        return float(word)
    except ValueError:
        raise ValueError(f"{name} has {word!r}, expected numbers") from None


# By the type of a setting that has several values: one of them, from the setting's name and a word.
SEVERAL: dict[Any, Callable[[str, str], Any]] = {
    tuple[int, ...]: whole,
    tuple[float, ...]: real,
    tuple[str, ...]: lambda _name, word: word,
}


def _type(hint: Any) -> tuple[Any, list[str]]:
    """What typer reads for a field, which also may be None; and the words that a field may be."""
    kinds = [kind for kind in get_args(hint) if kind is not NoneType]
    if NoneType in get_args(hint):
        (hint,) = kinds
    if hint in SEVERAL:
        return str, []
    words = [word for word in get_args(hint) if isinstance(word, str)]
    return (str if words else hint), words
