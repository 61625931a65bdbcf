"""Public names that moved, and arguments that are given by name now: for one version the old way
works, with a DeprecationWarning that names the new one."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from importlib import import_module
from typing import Any, TypeVar, cast

__all__ = ["REMOVED_IN", "moved_names", "once_positional", "warn_deprecated"]

REMOVED_IN = "0.15.0"
"""The version in which the old ways go."""

Function = TypeVar("Function", bound=Callable[..., Any])


def moved_names(
    module: str,
    names: Mapping[str, str],
    instead: Mapping[str, str] | None = None,
    otherwise: Callable[[str], Any] | None = None,
) -> Callable[[str], Any]:
    """The `__getattr__` of a module whose public names have moved.

    A module sets it where type checkers do not look (`if not TYPE_CHECKING`), so that they report
    old names, and misspelt ones.

    Args:
        module: its `__name__`.
        names: by old name the new one, as {"Mesh": "energymargin.mesh"}.
        instead: by old name what to use, where that is another.
        otherwise: the `__getattr__` of names that have not moved.
    """
    advice = {**names, **(instead or {})}

    def moved(name: str) -> Any:
        if name in names:
            warn_deprecated(f"{module}.{name}", advice[name], stacklevel=3)
            home, _, new = names[name].rpartition(".")
            return getattr(import_module(home), new)
        if otherwise is None:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        return otherwise(name)

    return moved


def once_positional(*names: str, after: int) -> Callable[[Function], Function]:
    """Lets a function take by position what it takes by name now, in this order.

    `after` is how many arguments still go by position.
    """

    def of_function(function: Function) -> Function:
        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            late = args[after:]
            if not late or len(late) > len(names):
                return function(*args, **kwargs)
            given = dict(zip(names, late, strict=False))
            by_name = ", ".join(f"{name}=..." for name in given)
            title = function.__name__
            warn_deprecated(f"{title} with {', '.join(given)} by position", by_name, stacklevel=3)
            return function(*args[:after], **given, **kwargs)

        return cast(Function, call)

    return of_function


def warn_deprecated(old: str, new: str, *, stacklevel: int = 2) -> None:
    """Warns that `old` goes in REMOVED_IN, and names what to use instead.

    `stacklevel` 2 is the line that calls the caller of this function.
    """
    text = f"{old} is deprecated and goes in energymargin {REMOVED_IN}: use {new}"
    warnings.warn(text, DeprecationWarning, stacklevel=stacklevel)
