"""Calls of compiled classes and functions that do not fit: Python's words say what is missing.

A compiled function lists all its arguments with their types, and does not say which one it lacks.
"""

from __future__ import annotations

import ast
import difflib
import functools
import inspect
from collections.abc import Callable
from typing import Any

from energymargin.base.checks import with_way


def explained(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """A compiled function that raises TypeError with what a call of `name` lacks, or has too
    much."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except (TypeError, ValueError) as error:
            kind, text = type(error), str(error)
            why = _misfit(function.__doc__ or "", args, kwargs) if kind is TypeError else None
            said = with_way(text) if why is None else f"{name}() {why}"
            if kind not in (TypeError, ValueError) or said == text:
                raise
            raise kind(said) from error

    return call


def _misfit(doc: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> str | None:
    """Why arguments do not fit the signature that a docstring begins with; None if they do."""
    signature = signature_of(doc)
    if signature is None:
        return None
    if too_much := surplus(signature, args, kwargs):
        return too_much
    given = signature.bind_partial(*args, **kwargs).arguments
    needed = [name for name, one in signature.parameters.items() if one.default is one.empty]
    needed = [name for name in needed if name != "self"]
    missing = [name for name in needed if name not in given]
    return f"lacks {', '.join(missing)}: it needs {', '.join(needed)}" if missing else None


def surplus(
    signature: inspect.Signature, args: tuple[Any, ...], kwargs: dict[str, Any]
) -> str | None:
    """What a call has that a signature does not take; None if nothing."""
    try:
        signature.bind_partial(*args, **kwargs)
    except TypeError as error:
        listed = [one for one in signature.parameters.values() if one.name != "self"]
        listed = [one for one in listed if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)]
        by_name = [one.name for one in listed if one.kind == one.KEYWORD_ONLY]
        takes = [one.name for one in listed if one.kind != one.KEYWORD_ONLY]
        unknown = [name for name in kwargs if name not in signature.parameters]
        near = difflib.get_close_matches(unknown[0], by_name + takes, 1) if unknown else []
        why = f"{error}; did you mean {near[0]!r}?" if near else str(error)
        kinds = [", ".join(takes), f"by name {', '.join(by_name)}" if by_name and not near else ""]
        return f"takes {', and '.join(filter(None, kinds)) or 'nothing'}: {why}"
    return None


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
    if own.vararg or own.kwarg:  # the function itself knows what it takes
        return None
    for one in (*own.posonlyargs, *own.args, *own.kwonlyargs):
        one.annotation = None
    own.defaults = [ast.Constant(None) for _ in own.defaults]
    own.kw_defaults = [one and ast.Constant(None) for one in own.kw_defaults]
    return inspect.signature(eval(f"lambda {ast.unparse(own)}: None"))
