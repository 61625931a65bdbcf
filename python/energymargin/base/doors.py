"""Arguments of public functions and classes that are of another kind than their annotation says.

The functions check values and bounds themselves. Where they stumble over another kind of object,
such as a str where a Problem is wanted, the argument is named here, in one place.
"""

from __future__ import annotations

import collections.abc
import functools
import inspect
import numbers
import os
import re
import sys
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from energymargin.base.calls import surplus
from energymargin.base.checks import shown, with_way


class ArgumentKind(typing.NamedTuple):
    """What an argument may be."""

    has: Callable[[Any], bool]
    """Whether a value is of this kind."""
    words: str
    """The kind in words, as "a Problem"."""


NONE = ArgumentKind(lambda value: value is None, "None")
NUMBER = ArgumentKind(lambda value: isinstance(value, (numbers.Number, np.bool_)), "a number")
PATH = ArgumentKind(lambda value: isinstance(value, (str, os.PathLike)), "a path")
DICT = ArgumentKind(lambda value: isinstance(value, Mapping), "a dict")
PLAIN = {
    None: NONE,
    type(None): NONE,
    float: NUMBER,  # the function knows the bounds, and whether it has to be whole
    int: NUMBER,
    bool: ArgumentKind(NUMBER.has, "True or False"),
    str: ArgumentKind(lambda value: isinstance(value, str), "a str"),
    Path: PATH,
    os.PathLike: PATH,
    Mapping: DICT,
    dict: DICT,
    Callable: ArgumentKind(callable, "a function"),
}
STUMBLES = (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError)
SEQUENCES = (list, tuple, Sequence, collections.abc.Iterable)


def check_doors(namespace: dict[str, Any], names: Sequence[str]) -> None:
    """Checks what these functions and classes of a package, of its namespace, are called with."""
    package = namespace["__name__"]
    for name in names:
        if name in namespace:
            namespace[name] = checked(namespace[name], package)


def checked(door: Any, package: str) -> Any:
    """A function that names an argument of another kind; a class with such methods.

    Anything else is returned as it is. `package` is where users find it.
    """
    if isinstance(door, types.FunctionType) and not hasattr(door, "__wrapped__"):
        return _checked_function(door, package)
    if isinstance(door, type) and door.__module__.startswith("energymargin."):
        for name, member in list(methods(door)):
            wrapped: Any = _checked_function(getattr(member, "__func__", member))
            if isinstance(member, (classmethod, staticmethod)):
                wrapped = type(member)(wrapped)
            setattr(door, name, wrapped)
    return door


def methods(kind: type) -> Iterator[tuple[str, Any]]:
    """The public methods that a class defines itself, and how it is made unless it only carries
    what a function found."""
    carries = hasattr(kind, "__dataclass_fields__") and "__post_init__" not in vars(kind)
    if getattr(kind, "_is_protocol", False):
        return
    for name, member in vars(kind).items():
        is_public = not name.startswith("_") or (name == "__init__" and not carries)
        function = getattr(member, "__func__", member)
        if is_public and isinstance(inspect.unwrap(function), types.FunctionType):
            yield name, member


def _checked_function(function: Any, package: str | None = None) -> Any:
    @functools.wraps(function)
    def checked_function(*args: Any, **kwargs: Any) -> Any:
        progress = kwargs.get("progress")
        if progress is not None and not callable(progress):  # it may be called late, or never
            raise ValueError(f"progress is {shown(progress)}, expected a function")
        try:
            return function(*args, **kwargs)
        except STUMBLES as error:
            names, kinds = kinds_of(function)
            if type(error).__module__ == "builtins" and with_way(str(error)) != str(error):
                raise type(error)(with_way(str(error))) from error
            if type(error).__module__ != "builtins" or _names_one(error, kinds):
                raise
            for name, value in (*zip(names, args, strict=False), *kwargs.items()):
                kind = kinds.get(name)
                if kind is not None and not kind.has(value):
                    text = f"{name} is {shown(value)}, expected {kind.words}"
                    raise ValueError(with_way(text)) from error
            if isinstance(error, TypeError) and (
                why := surplus(inspect.signature(function), args, kwargs)
            ):
                name = function.__qualname__.removesuffix(".__init__")
                raise TypeError(f"{name}() {why}") from error
            raise

    if package is not None:
        checked_function.__module__ = package  # where pickle looks for it
    return checked_function


def _names_one(error: Exception, arguments: Iterable[str]) -> bool:
    """Whether an error is about an argument, and says so."""
    text = str(error)
    return "expected" in text and any(re.search(rf"\b{name}\b", text) for name in arguments)


@functools.cache
def kinds_of(function: Any) -> tuple[tuple[str, ...], dict[str, ArgumentKind]]:
    """The arguments of a function by position, and by name what each has to be, if that is said."""
    every = inspect.signature(function).parameters.values()
    listed = [one for one in every if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)]
    hints = [_hint(function, one.annotation) for one in listed]
    kinds = {p.name: _kind(hint, str(p.annotation)) for p, hint in zip(listed, hints, strict=True)}
    names = tuple(one.name for one in listed if one.kind != one.KEYWORD_ONLY)
    return names, {name: kind for name, kind in kinds.items() if kind is not None}


def _hint(function: Any, annotation: Any) -> Any:
    """An annotation as an object; Any if it has names that are there for type checkers alone."""
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, {}, _ForTypes(function.__globals__))
    except (NameError, TypeError, AttributeError):
        return Any


class _ForTypes(dict[str, Any]):
    """Names of a module, and the package's classes, which some import for types alone."""

    def __missing__(self, name: str) -> Any:
        package = sys.modules["energymargin"]
        if name not in package.HOMES:
            raise KeyError(name)
        return getattr(package, name)


def _alternatives(hint: Any) -> list[Any]:
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return [one for part in typing.get_args(hint) for one in _alternatives(part)]
    return [hint]


ARRAYS = _alternatives(ArrayLike)  # texts among them, which are no numbers


def _kind(hint: Any, text: str = "") -> ArgumentKind | None:
    """None: anything may be right. `text`: as it is written, where a str beside numbers is seen."""
    alternatives = _alternatives(hint)
    if all(one in alternatives for one in ARRAYS):
        beside = [str] if re.search(r"(^|\| )str( \||$)|PathLike", text) else []
        alternatives = [*beside, ARRAYS, *(one for one in alternatives if one not in ARRAYS)]
    kinds = [_simple_kind(one) for one in alternatives]
    return None if None in kinds else _any_of([kind for kind in kinds if kind is not None])


def _any_of(kinds: Sequence[ArgumentKind]) -> ArgumentKind:
    words = " or ".join(dict.fromkeys(kind.words for kind in kinds))
    return ArgumentKind(lambda value: any(kind.has(value) for kind in kinds), words)


def _simple_kind(hint: Any) -> ArgumentKind | None:
    origin = typing.get_origin(hint) or hint
    if hint is ARRAYS or origin is np.ndarray:
        return _array(0 if hint is ARRAYS else 1)
    if isinstance(origin, collections.abc.Hashable) and origin in PLAIN:
        return PLAIN[origin]
    if origin in SEQUENCES:
        return _sequence(origin, typing.get_args(hint))
    if hint is Any or not isinstance(hint, type):
        return None
    words = f"{'an' if hint.__name__[0] in 'AEIOU' else 'a'} {hint.__name__}"
    if not getattr(hint, "_is_protocol", False):
        return ArgumentKind(lambda value: isinstance(value, hint), words)
    members = [name for name in {*vars(hint), *hint.__annotations__} if not name.startswith("_")]
    return ArgumentKind(lambda value: all(hasattr(value, name) for name in members), words)


def _array(least: int) -> ArgumentKind:
    """Numbers of so many dimensions at least."""

    def has(value: Any) -> bool:
        try:
            array = None if value is None else np.asarray(value)
        except (TypeError, ValueError):
            return False
        return array is not None and array.ndim >= least and array.dtype.kind in "biuf"

    return ArgumentKind(has, "an array of numbers" if least else "numbers")


def _sequence(origin: Any, parts: tuple[Any, ...]) -> ArgumentKind:
    """Of a fixed length if the parts say so, else each item is looked at."""
    fixed = origin is tuple and bool(parts) and parts[-1] is not Ellipsis
    item = _kind(parts[0]) if parts and not fixed else None

    def has(value: Any) -> bool:
        if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__iter__"):
            return False
        if fixed:
            return hasattr(value, "__len__") and len(value) == len(parts)
        if item is None or not isinstance(value, (list, tuple)):  # others may be used once
            return True
        return all(item.has(one) for one in value)

    if fixed:
        return ArgumentKind(has, f"{len(parts)} values")
    return ArgumentKind(has, "a list" if item is None else f"a list, each item {item.words}")
