"""Calls of compiled classes and functions that do not fit: Python's words say what is missing.

A compiled function lists all its arguments with their types, and does not say which one it lacks.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable
from typing import Any


def explained(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """A compiled function that raises TypeError with what a call of `name` lacks, or has too
    much."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except TypeError as error:
            why = _misfit(function.__doc__ or "", args, kwargs)
            if why is None:
                raise
            raise TypeError(f"{name}() {why}") from error

    return call


def _misfit(doc: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> str | None:
    """Why arguments do not fit the signature that a docstring begins with; None if they do."""
    signature = signature_of(doc)
    if signature is None:
        return None
    takes = [name for name in signature.parameters if name != "self"]
    try:
        given = signature.bind_partial(*args, **kwargs).arguments
    except TypeError as error:  # too many, or one that it does not have
        return f"takes {', '.join(takes) or 'nothing'}: {error}"
    needed = [
        name for name in takes if signature.parameters[name].default is inspect.Parameter.empty
    ]
    missing = [name for name in needed if name not in given]
    return f"lacks {', '.join(missing)}: it needs {', '.join(needed)}" if missing else None


def signature_of(doc: str) -> inspect.Signature | None:
    """The arguments that the first line of a compiled function's docstring has, without types."""
    head, arrow, _ = doc.partition("\n")[0].rpartition(" -> ")
    try:
        (function,) = ast.parse(f"def {head}: ...").body
    except SyntaxError:  # it has none
        return None
    if not arrow or not isinstance(function, ast.FunctionDef):
        return None
    own = function.args
    first = len(own.args) - len(own.defaults)
    kinds = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
    has = [k >= first for k in range(len(own.args))], [one is not None for one in own.kw_defaults]
    return inspect.Signature(
        [
            inspect.Parameter(one.arg, kind, default=None if default else inspect.Parameter.empty)
            for kind, group, defaults in zip(kinds, (own.args, own.kwonlyargs), has, strict=True)
            for one, default in zip(group, defaults, strict=True)
        ]
    )
