"""Errors of calls of the compiled module: the argument, its value and what is expected."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

__all__ = ["fault_of_call", "shown"]

LONGEST = 60  # characters of a value in an error


class _Fault(NamedTuple):
    """A value that is not what it is expected to be."""

    place: str
    """The argument, or a part of it, as captured['box']."""
    value: Any
    expected: ast.expr


def fault_of_call(
    title: str, signature: str, args: Sequence[Any], kwargs: Mapping[str, Any]
) -> str | None:
    """The first fault of a call that its function refuses, in one line; None if there is none.

    `signature` is the function's, as "(problem: energymargin._core.Problem, nodes: int = 1000)",
    without the self of a method; `title` is what an error calls the function.
    """
    (function,) = ast.parse(f"def call{signature}: ...").body
    assert isinstance(function, ast.FunctionDef)
    parameters = function.args
    positional = [*parameters.posonlyargs, *parameters.args]
    named = {parameter.arg: parameter for parameter in [*positional, *parameters.kwonlyargs]}
    if len(args) > len(positional):
        return _too_many(title, len(args), list(named), len(positional))
    given = dict(zip(named, args, strict=False))
    for name in kwargs:
        if name in given:
            return f"{name} is given twice, by its position and by its name, expected once"
        if name not in named and parameters.kwarg is None:
            known = f"one of {', '.join(named)}" if named else "none"
            return f"{name} is not an argument of {title}, expected {known}"
    given |= {name: value for name, value in kwargs.items() if name in named}
    for name in _required(parameters):
        if name not in given:
            return f"{name} is not given, expected {_words(_annotation(named[name]))}"
    faults = (_fault(name, value, _annotation(named[name])) for name, value in given.items())
    fault = next((fault for fault in faults if fault is not None), None)
    if fault is None:
        return None
    return f"{fault.place} is {shown(fault.value)}, expected {_words(fault.expected)}"


def shown(value: object) -> str:
    """A value in one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a repr of the user's own
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _too_many(title: str, given: int, names: list[str], most: int) -> str:
    by_name = f", and by name {', '.join(names[most:])}" if names[most:] else ""
    which = f" ({', '.join(names[:most])})" if most else ""
    arguments = "1 argument" if given == 1 else f"{given} arguments"
    return f"{title} is given {arguments} by position, expected at most {most}{which}{by_name}"


def _required(parameters: ast.arguments) -> Iterator[str]:
    positional = [*parameters.posonlyargs, *parameters.args]
    for parameter in positional[: len(positional) - len(parameters.defaults)]:
        yield parameter.arg
    for parameter, default in zip(parameters.kwonlyargs, parameters.kw_defaults, strict=True):
        if default is None:
            yield parameter.arg


def _annotation(parameter: ast.arg) -> ast.expr:
    return parameter.annotation or ast.Name("object")


def _fault(place: str, value: Any, expected: ast.expr) -> _Fault | None:
    """Where the value is not what is expected; in a list or dict the item that is not."""
    if isinstance(expected, ast.BinOp):
        faults = [_fault(place, value, kind) for kind in _alternatives(expected)]
        if None in faults:
            return None
        inner = [fault for fault in faults if fault is not None and fault.place != place]
        return inner[0] if inner else _Fault(place, value, expected)
    if isinstance(expected, ast.Subscript):
        return _fault_in_container(place, value, expected)
    if isinstance(expected, ast.Constant):
        return None if value is expected.value else _Fault(place, value, expected)
    return None if _is(value, ast.unparse(expected)) else _Fault(place, value, expected)


def _fault_in_container(place: str, value: Any, expected: ast.Subscript) -> _Fault | None:
    container = ast.unparse(expected.value).rpartition(".")[2]
    kinds = expected.slice.elts if isinstance(expected.slice, ast.Tuple) else [expected.slice]
    if container == "Callable":
        return None if callable(value) else _Fault(place, value, expected)
    if container in ("dict", "Mapping"):
        if not isinstance(value, Mapping):
            return _Fault(place, value, expected)
        parts = [(f"a key of {place}", key, kinds[0]) for key in value]
        parts += [(f"{place}[{key!r}]", item, kinds[1]) for key, item in value.items()]
    else:
        if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
            return _Fault(place, value, expected)
        if container == "tuple" and len(kinds) != len(value):
            return _Fault(place, value, expected)
        each = kinds if container == "tuple" else kinds * len(value)
        parts = [
            (f"{place}[{i}]", item, kind)
            for i, (item, kind) in enumerate(zip(value, each, strict=True))
        ]
    faults = (_fault(*part) for part in parts)
    return next((fault for fault in faults if fault is not None), None)


# What the compiled module takes for these; it checks their values itself.
_PLAIN: dict[str, Callable[[Any], bool]] = {
    "str": lambda value: isinstance(value, (str, bytes)) and _is_text(value),
    "bool": lambda value: value is None or hasattr(value, "__bool__"),
    "int": lambda value: value is not None,
    "float": lambda value: value is not None,
    "numpy.typing.ArrayLike": lambda value: value is not None,
    "typing.SupportsInt": lambda value: hasattr(value, "__index__"),
    "typing.SupportsIndex": lambda value: hasattr(value, "__index__"),
    "typing.SupportsFloat": lambda value: hasattr(value, "__float__"),
    "object": lambda value: True,
    "typing.Any": lambda value: True,
}

_WORDS = {
    "str": "a str",
    "bool": "True or False",
    "int": "a whole number",
    "float": "a number",
    "numpy.typing.ArrayLike": "an array of numbers",
    "typing.SupportsInt": "a whole number",
    "typing.SupportsIndex": "a whole number",
    "typing.SupportsFloat": "a number",
    "object": "a value",
    "typing.Any": "a value",
}


def _is_text(value: str | bytes) -> bool:
    try:
        return bool(value.encode() if isinstance(value, str) else value.decode()) or not value
    except UnicodeError:
        return False


def _is(value: Any, kind: str) -> bool:
    if kind in _PLAIN:
        return _PLAIN[kind](value)
    module, _, name = kind.rpartition(".")
    known = getattr(importlib.import_module(module or "builtins"), name)
    return isinstance(value, known)


def _alternatives(union: ast.expr) -> list[ast.expr]:
    if not isinstance(union, ast.BinOp):
        return [union]
    return [*_alternatives(union.left), *_alternatives(union.right)]


def _words(expected: ast.expr) -> str:
    """As "a Region, or a dict, each value a Region"."""
    kinds = _alternatives(expected)
    words = [_words_of(kind) for kind in kinds if not _is_none(kind)]
    words = sorted(dict.fromkeys(words), key=lambda word: "," in word)  # the simple ones first
    if any(_is_none(kind) for kind in kinds):
        words.append("None")
    comma = "," if any("," in word for word in words) else ""
    return f"{comma} or ".join([", ".join(words[:-1]), words[-1]]) if words[1:] else words[0]


def _is_none(kind: ast.expr) -> bool:
    return isinstance(kind, ast.Constant) and kind.value is None


def _words_of(kind: ast.expr) -> str:
    if isinstance(kind, ast.Subscript):
        container = ast.unparse(kind.value).rpartition(".")[2]
        if container == "Callable":
            return "a function"
        kinds = kind.slice.elts if isinstance(kind.slice, ast.Tuple) else [kind.slice]
        if container in ("dict", "Mapping"):
            item = _words(kinds[1])
            return "a dict" if item == _WORDS["object"] else f"a dict, each value {item}"
        if container == "tuple":
            return f"a tuple ({', '.join(_words(item) for item in kinds)})"
        return f"a list, each item {_words(kinds[0])}"
    text = ast.unparse(kind)
    name = text.rpartition(".")[2]
    return _WORDS.get(text, f"{'an' if name[0] in 'AEIOU' else 'a'} {name}")
