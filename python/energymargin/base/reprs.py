"""Short texts of dataclasses and of compiled classes, for a prompt: states=array(10, 26)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

MOST = 6  # numbers or words of a list that is shown in full


def short_repr(self: Any) -> str:
    """The `__repr__` of a dataclass: a large array by its shape, a long list by its length."""
    return _listed(self, {f.name: getattr(self, f.name) for f in fields(self) if f.repr})


class Record:
    """Base of dataclasses, made with repr=False, that hold large arrays: their repr is short."""

    __repr__ = short_repr


def compiled_repr(self: Any) -> str:
    """The `__repr__` of a compiled class, of its properties: a vector as numbers, all else as
    above."""
    values = {}
    members = {name: m for kind in reversed(type(self).__mro__) for name, m in vars(kind).items()}
    for name, member in members.items():
        if isinstance(member, property):
            values[name] = value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.ndim == 1 and value.size <= MOST:
                values[name] = tuple(float(f"{number:.6g}") for number in value)
    return _listed(self, values)


def _listed(thing: object, values: Mapping[str, object]) -> str:
    texts = (f"{name}={_text(value)}" for name, value in values.items())
    return f"{type(thing).__name__}({', '.join(texts)})"


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {_entry(each)}' for key, each in value.items())}}}"
    return _entry(value)


def _entry(value: object) -> str:
    """An entry of a field or a dictionary in words; its own entries are counted."""
    if isinstance(value, np.ndarray):
        return _text(value)
    if isinstance(value, Mapping) and value:
        return f"{{{len(value)} {_kind(next(iter(value.values())))}}}"
    if isinstance(value, Sequence) and not isinstance(value, str) and value:
        plain = all(isinstance(each, (str, int, float)) for each in value)
        return repr(value) if plain and len(value) <= MOST else f"[{len(value)} {_kind(value[0])}]"
    text = repr(value.item() if isinstance(value, np.generic) else value)
    return f"{_kind(value)}(...)" if "\n" in text else text


def _kind(value: object) -> str:
    return type(value).__name__
