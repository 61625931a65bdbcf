"""The tasks by name: those that installed packages register, and those of this process.

A package may be broken, or register a name that is taken. The error is that of this task alone, and
the others can be used.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar, cast

from energymargin.base.errors import EnergyMarginError
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.scripted import engine_of, in_engine

GROUP = "energymargin.tasks"
OURS = "energymargin"
METHODS = ("rollout", "problem")

Constructor = TypeVar("Constructor", bound=Callable[..., Task])

_registered_here: dict[str, Callable[..., Task]] = {}


class TaskError(EnergyMarginError, ValueError):
    """A registered task that cannot be used; the message names its package."""


@dataclass(frozen=True, eq=False)
class Registered:
    """One name under which packages register a task."""

    name: str
    summary: str
    """What the task is: the first line of its docstring; empty if it cannot be used."""
    parameters: dict[str, Any]
    """Its defaults."""
    note: str
    """The package, if it is not energymargin's own, or why the task cannot be used."""
    broken: bool = False


def register(constructor: Constructor) -> Constructor:
    """Makes a task known in this process under its `name`, so that datasets of it are scored,
    viewed and reported as any other. Returns the class, so it is a decorator too.

    It replaces one of that name which was registered in this process. Worker processes and the
    command line know tasks of installed packages alone. Raises TaskError on what is no task, and on
    the name of an installed one.
    """
    name = getattr(constructor, "name", None)
    if not callable(constructor) or not isinstance(name, str):
        raise TaskError(f"constructor is {constructor!r}, expected a task's class, with a `name`")
    whose = f"task {name!r} of {constructor.__module__}"
    _check(whose, name, constructor)
    if is_installed(name):
        raise TaskError(f"{whose}: {_package(_entry(name))} has a task of that name; rename it")
    _registered_here[name] = constructor
    return constructor


def names() -> list[str]:
    """The names that `make` knows, sorted."""
    return sorted({*_registered_here, *(entry.name for entry in entry_points(group=GROUP))})


def is_installed(name: str) -> bool:
    """Whether a package registers that name, so that every process knows it."""
    return bool(entry_points(group=GROUP, name=name))


def make(name: str, /, *, engine: str | None = None, **parameters: Any) -> Task:
    """The task of that name; `parameters` are its constructor's keywords.

    `engine`, "native" or "bullet", steps its trajectories and its problems; None: the task's own.

    Raises ValueError if there is no such task, or if it does not take those parameters, and
    TaskError, which is one, if the task's package is broken.
    """
    _, whose, constructor = _found(name)
    signature = inspect.signature(constructor)
    try:
        signature.bind(**parameters)
    except TypeError as error:
        known = ", ".join(signature.parameters) or "none"
        raise ValueError(f"task {name!r}: {error}; its parameters: {known}") from error
    try:
        task = constructor(**parameters)
    except TypeError as error:  # such as an abstract method that is missing
        raise TaskError(f"{whose}: {error}") from error
    _check(whose, name, task)
    made = cast(Task, task)
    return made if engine is None or engine == engine_of(made) else in_engine(made, engine)


def _found(name: str) -> tuple[str, str, Any]:
    """The package of the task of that name, what an error calls it, and what makes it."""
    if name in _registered_here:
        constructor = _registered_here[name]
        return "", f"task {name!r} of {constructor.__module__}", constructor
    entry = _entry(name)
    package = _package(entry)
    whose = f"task {name!r} of {package} (entry point {entry.value})"
    try:
        constructor = entry.load()
    except Exception as error:  # whatever a stranger's module raises when it is imported
        raise TaskError(f"{whose} cannot be loaded: {type(error).__name__}: {error}") from error
    if not callable(constructor):
        raise TaskError(f"{whose} is a {type(constructor).__name__}, expected a class")
    return package, whose, constructor


def overview() -> list[Registered]:
    """Every registered task, broken ones too; sorted by name."""
    return [_registered(name) for name in names()]


def _registered(name: str) -> Registered:
    try:
        task = make(name)
        package, _, _ = _found(name)
        note = {"": "of this process", OURS: ""}.get(package, f"from {package}")
        summary = (type(task).__doc__ or "").strip().split("\n")[0]
        parameters = parameters_of(task)
    except Exception as error:  # whatever a stranger's code raises
        text = str(error) if isinstance(error, TaskError) else f"{type(error).__name__}: {error}"
        return Registered(name, "", {}, text, broken=True)
    return Registered(name, summary, parameters, note)


def _entry(name: str) -> EntryPoint:
    """The one entry point of that name."""
    found = list(entry_points(group=GROUP, name=name))
    if not found:
        raise ValueError(
            f"there is no task {name!r}; there are: {', '.join(names())}. One of your own is known "
            "once its package is installed, or after em.tasks.register(...) in this process"
        )
    if len({entry.value for entry in found}) > 1:
        owners = " and ".join(sorted(f"{_package(entry)} ({entry.value})" for entry in found))
        raise TaskError(
            f"task {name!r} is registered by {owners}: uninstall one, or rename its task"
        )
    return found[0]


def _check(whose: str, name: str, task: Any) -> None:
    """Raises TaskError unless this is a task, of the name under which it is registered."""
    lacking = [method for method in METHODS if not callable(getattr(task, method, None))]
    if lacking:
        raise TaskError(f"{whose} has no method {lacking[0]!r}")
    called = getattr(task, "name", None)
    if called != name:
        raise TaskError(f"{whose} has the name {called!r}, expected {name!r}")


def _package(entry: EntryPoint) -> str:
    return "an unknown package" if entry.dist is None else entry.dist.name
