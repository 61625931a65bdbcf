"""Options of several commands, fields of settings among them: their help, and what their words
mean."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Sequence
from dataclasses import Field, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from cyclopts import Group, Parameter, Token

import energymargin as em
from energymargin.base.settings import flag_of
from energymargin.cli.terminal import warn

PlanWord = Literal["script", "hold", "none"]
Command = TypeVar("Command", bound=Callable[..., None])
PICTURE_NODES = 100  # of the trees in the pictures of the tasks; the paper's


def panel(title: str, name: str | None = None) -> Parameter:
    """A heading in the help of a command; the first that is made comes first.

    With the name "*" it decorates a class whose fields are the options.
    """
    group = Group.create_ordered(title, sort_key=0)
    return Parameter(name=name, group=group) if name else Parameter(group=group)


def given(options: Any) -> dict[str, Any]:
    """The fields of options that are not None, as arguments by name."""
    return {name: value for name, value in vars(options).items() if value is not None}


WHERE = Group.create_ordered("Where it runs", sort_key=1)  # the last one

Output = Annotated[Path | None, Parameter(alias="-o")]
Outputs = Annotated[list[Path] | None, Parameter(alias="-o")]
Parameters = Annotated[list[str] | None, Parameter(alias="-p")]


@Parameter(name="*", group=WHERE)
@dataclass(frozen=True)
class Elsewhere:
    """Where a command runs, and how long."""

    scheduler: str | None = None
    """The workers of a Dask cluster instead: its scheduler, tcp://HOST:PORT."""
    timeout: float | None = None
    """Seconds after which it ends with what is done; exit code 124."""

    def cluster(self) -> em.executors.Dask | None:
        """The Dask cluster, if one is given; what its workers lack is printed."""
        return None if self.scheduler is None else em.executors.Dask(self.scheduler, notice=warn)


@Parameter(name="*", group=WHERE)
@dataclass(frozen=True)
class Where(Elsewhere):
    """Where a command runs that has threads too."""

    threads: int | None = None
    """Threads; all cores if not given. Scores do not depend on it."""
    processes: int | None = None
    """So many processes instead of threads: a crash loses what was not kept, a second of work."""

    def executor(self) -> em.executors.Executor:
        """The chosen executor; threads if none is. Raises ValueError on more than one."""
        require_one(threads=self.threads, processes=self.processes, scheduler=self.scheduler)
        if self.processes is not None:
            return em.executors.Processes(self.processes)
        return self.cluster() or em.executors.Threads(self.threads)


def require_one(**options: Any) -> None:
    """Raises ValueError if more than one of these options is given."""
    given = [name for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"--{given[0]} and --{given[1]} are given, expected one of them")


def chosen_future(
    frames: int | None, plan: PlanWord | None, **times: float | None
) -> em.datasets.Future | None:
    """The Future of these options; None without frames. Raises ValueError on what cannot be."""
    require_beside("frames", frames, plan=plan, **times)
    if frames is None:
        return None
    given: dict[str, Any] = {name: time for name, time in times.items() if time is not None}
    return em.datasets.Future(frames, None if plan == "none" else plan or "script", **given)


def chosen_sampling(belief: str | None, particles: int | None) -> em.beliefs.Sampling | None:
    """The Sampling of these options; None without a belief. Raises ValueError on particles without
    one, and on what is no uncertainty."""
    require_beside("belief", belief, particles=particles)
    if belief is None:
        return None
    text = belief if belief.lstrip().startswith("{") else Path(belief).read_text()
    known = em.beliefs.Uncertainty.from_json(text)
    return em.beliefs.Sampling(known, *([] if particles is None else [particles]))


def require_beside(option: str, value: object, **others: object) -> None:
    """Raises ValueError if one of the other options is given without this one, its condition."""
    for name, other in others.items():
        if value is None and other is not None:
            raise ValueError(f"--{name} is {other}, expected --{option} beside it")


def parsed(parameters: list[str] | None) -> dict[str, Any]:
    """NAME=VALUE, where a value is JSON, or else a word. Raises ValueError on another text."""
    values = {}
    for text in parameters or ():
        name, equals, value = text.partition("=")
        if not (equals and name.isidentifier()):
            raise ValueError(f"--parameter is {text!r}, expected NAME=VALUE")
        try:
            values[name] = json.loads(value)
        except json.JSONDecodeError:
            values[name] = value
    return values


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
