"""Fields of settings as options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import Field, fields, replace
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from cyclopts import Parameter, Token

from energymargin.base.settings import flag_of

Command = TypeVar("Command", bound=Callable[..., None])
Settings = TypeVar("Settings")


def options_of(
    settings: Any, *names: str, panel: Parameter | None = None
) -> Callable[[Command], Command]:
    """Decorates a command with the options of these fields, which it gets as **given.

    `settings` has their defaults. `panel` is the heading in the command's help.
    """

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command)
        named = {field.name: field for field in fields(settings)}
        own = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]
        added = [option(settings, named[name], panel) for name in names]
        command.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined]
        return command

    return decorate


def changed(settings: Settings, given: dict[str, Any]) -> Settings:
    """Settings with what was given at the terminal; None was not."""
    there = {name: value for name, value in given.items() if value is not None}
    return replace(settings, **there)  # type: ignore[type-var]


def option(settings: Any, setting: Field[Any], panel: Parameter | None = None) -> inspect.Parameter:
    """The option of a field; None if it is not given. Several values have commas between."""
    default = getattr(settings, setting.name)
    hint = get_type_hints(type(settings))[setting.name]
    shown = setting.metadata["shown"] or ("" if default is None else in_words(default))
    info = Parameter(
        name=flag_of(setting),
        help=setting.metadata["help"],
        show_default=(hint is not bool and shown) or False,
    )
    more = [panel] if panel else []
    more += [SEVERAL] if get_origin(hint) is tuple else []
    return keyword(setting.name, Annotated[(hint | None, info, *more)])


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


def several(hint: Any, tokens: Sequence[Token]) -> tuple[Any, ...]:
    """The values of a tuple of one kind."""
    name, kind = (tokens[0].keyword or "").lstrip("-"), get_args(hint)[0]
    return tuple(as_number(kind, name, word) for word in split(tokens[0].value))


SEVERAL = Parameter(converter=several, n_tokens=1, allow_leading_hyphen=True)
"""Of an option that has several values with commas between."""
