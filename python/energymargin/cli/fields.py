"""Fields of settings as options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import Field, fields
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from cyclopts import Parameter, Token

from energymargin.base.settings import flag_of

Command = TypeVar("Command", bound=Callable[..., None])


def options_of(
    settings: Any, *names: str, panel: Parameter | None = None
) -> Callable[[Command], Command]:
    """Decorates a command with the options of these fields. Its **given has those that are typed.

    `settings` has their defaults. `panel` is the heading in the command's help.
    """

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command)
        named = {field.name: field for field in fields(settings)}
        own = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]
        added = [_option(settings, named[name], panel) for name in names]
        command.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined]
        return command

    return decorate


def in_words(value: Any) -> str:
    """As it is typed: several separated by commas."""
    return ",".join(map(in_words, value)) if isinstance(value, tuple) else f"{value}"


def shown_default(value: Any) -> str | None:
    """A default in the help; None if there is none to be shown."""
    return None if value is None or value is False else in_words(value)


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
    """The values of a tuple of one kind. Of an option that is repeated the last one counts."""
    last, kind = tokens[-1], get_args(hint)[0]
    name = (last.keyword or "").lstrip("-")
    return tuple(as_number(kind, name, word) for word in split(last.value))


SEVERAL = Parameter(converter=several, n_tokens=1, allow_leading_hyphen=True)
"""Of an option that has several values with commas between."""


def _option(
    settings: Any, setting: Field[Any], panel: Parameter | None = None
) -> inspect.Parameter:
    """The option of a field."""
    hint = get_type_hints(type(settings))[setting.name]
    text, shown = setting.metadata["help"], setting.metadata["shown"]
    info = [Parameter(name=flag_of(setting), help=text, show_default=shown or shown_default)]
    info += [panel] if panel else []
    info += [SEVERAL] if get_origin(hint) is tuple else []
    default = getattr(settings, setting.name)
    kind, annotation = inspect.Parameter.KEYWORD_ONLY, Annotated[(hint, *info)]
    return inspect.Parameter(setting.name, kind, default=default, annotation=annotation)
