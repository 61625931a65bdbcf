"""Short texts of dataclasses that hold large arrays, for a prompt: states=array(10, 26)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

__all__ = ["short_repr"]

MOST = 6  # numbers or words of a list that is shown in full


def short_repr(self: Any) -> str:
    """The `__repr__` of a dataclass: an array by its shape, a long list by its length."""
    texts = (f"{field.name}={_text(getattr(self, field.name))}" for field in fields(self))
    return f"{type(self).__name__}({', '.join(texts)})"


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {_entry(each)}' for key, each in value.items())}}}"
    return _entry(value)


def _entry(value: object) -> str:
    """Of a field or a dictionary; its own entries are counted."""
    if isinstance(value, np.ndarray):
        return _text(value)
    if isinstance(value, Mapping) and value:
        return f"{{{len(value)} {_kind(next(iter(value.values())))}}}"
    if isinstance(value, Sequence) and not isinstance(value, str) and value:
        plain = all(isinstance(each, (str, int, float)) for each in value)
        return repr(value) if plain and len(value) <= MOST else f"[{len(value)} {_kind(value[0])}]"
    return repr(value)


def _kind(value: object) -> str:
    return type(value).__name__
