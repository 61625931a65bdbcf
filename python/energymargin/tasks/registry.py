"""The tasks that installed packages register, by name.

A package may be broken, or register a name that is taken. That is said of this task alone, and the
others go on.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, cast

from energymargin.tasks.base import Task, parameters_of

__all__ = ["Registered", "TaskError", "make", "names", "overview"]

GROUP = "energymargin.tasks"
OURS = "energymargin"
METHODS = ("rollout", "problem")


class TaskError(ValueError):
    """A registered task that cannot be used; says of which package it is."""


@dataclass(frozen=True)
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


def names() -> list[str]:
    """The names that `make` knows, sorted."""
    return sorted({entry.name for entry in entry_points(group=GROUP)})


def make(name: str, **parameters: Any) -> Task:
    """The task of that name; `parameters` are its constructor's keywords.

    Raises ValueError if there is no such task, or if it does not take those parameters, and
    TaskError, which is one, if the task's package is broken.
    """
    entry = _entry(name)
    constructor = _loaded(entry)
    signature = inspect.signature(constructor)
    try:
        signature.bind(**parameters)
    except TypeError as error:
        known = ", ".join(signature.parameters) or "none"
        raise ValueError(f"task {name!r}: {error}; its parameters: {known}") from error
    try:
        task = constructor(**parameters)
    except TypeError as error:  # such as an abstract method that is missing
        raise TaskError(f"{_whose(entry)}: {error}") from error
    _check(entry, task)
    return cast(Task, task)


def overview() -> list[Registered]:
    """What there is under every name, broken tasks too; sorted by name."""
    return [_registered(name) for name in names()]


def _registered(name: str) -> Registered:
    try:
        task, package = make(name), _package(_entry(name))
        summary = (type(task).__doc__ or "").strip().split("\n")[0]
        parameters = parameters_of(task)
    except Exception as error:  # whatever a stranger's code raises
        text = str(error) if isinstance(error, TaskError) else f"{type(error).__name__}: {error}"
        return Registered(name, "", {}, text, broken=True)
    return Registered(name, summary, parameters, "" if package == OURS else f"from {package}")


def _entry(name: str) -> EntryPoint:
    """The one entry point of that name."""
    found = list(entry_points(group=GROUP, name=name))
    if not found:
        raise ValueError(f"there is no task {name!r}; there are: {', '.join(names())}")
    if len({entry.value for entry in found}) > 1:
        owners = " and ".join(sorted(f"{_package(entry)} ({entry.value})" for entry in found))
        raise TaskError(
            f"task {name!r} is registered by {owners}: uninstall one, or rename its task"
        )
    return found[0]


def _loaded(entry: EntryPoint) -> Any:
    try:
        constructor = entry.load()
    except Exception as error:  # whatever a stranger's module raises when it is imported
        what = f"{type(error).__name__}: {error}"
        raise TaskError(f"{_whose(entry)} cannot be loaded: {what}") from error
    if not callable(constructor):
        raise TaskError(f"{_whose(entry)} is a {type(constructor).__name__}, expected a class")
    return constructor


def _check(entry: EntryPoint, task: Any) -> None:
    """Raises TaskError unless this is a task, of the name under which it is registered."""
    lacking = [method for method in METHODS if not callable(getattr(task, method, None))]
    if lacking:
        raise TaskError(f"{_whose(entry)} has no method {lacking[0]!r}")
    called = getattr(task, "name", None)
    if called != entry.name:
        raise TaskError(f"{_whose(entry)} has the name {called!r}, expected {entry.name!r}")


def _whose(entry: EntryPoint) -> str:
    return f"task {entry.name!r} of {_package(entry)} (entry point {entry.value})"


def _package(entry: EntryPoint) -> str:
    return "an unknown package" if entry.dist is None else entry.dist.name
