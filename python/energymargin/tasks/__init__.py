"""The manipulation tasks, by name: `make("push", friction=0.3)`.

Tasks are plugins: whatever an installed package registers under the entry point group
`energymargin.tasks` is one.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, cast

from energymargin.tasks.base import Drive, ScriptedTask, Task, Trajectory

__all__ = ["Drive", "ScriptedTask", "Task", "Trajectory", "make", "names"]

GROUP = "energymargin.tasks"


def names() -> list[str]:
    """The names that `make` knows, sorted."""
    return sorted({entry.name for entry in entry_points(group=GROUP)})


def make(name: str, **parameters: Any) -> Task:
    """The task of that name; `parameters` are its constructor's keywords.

    Raises ValueError if there is no such task, or if it does not take those parameters.
    """
    found = list(entry_points(group=GROUP, name=name))
    if not found:
        raise ValueError(f"there is no task {name!r}; there are: {', '.join(names())}")
    constructor = found[0].load()
    try:
        return cast(Task, constructor(**parameters))
    except TypeError as error:
        raise ValueError(f"task {name!r}: {error}") from error
