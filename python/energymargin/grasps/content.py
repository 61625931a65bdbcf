"""What a file of grasps says, in its own frames and units, between its format and a GraspSet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin.grasps.grasp_set import Column, Poses


@dataclass(frozen=True, eq=False)
class Content:
    """n rows, and what is not of a row."""

    format: str
    poses: Poses
    """Shape (n, 4, 4)."""
    columns: dict[str, Column] = field(default_factory=dict)
    """By name, each of length n; labels and openings too. "a/b" is b within a."""
    names: tuple[str, ...] = ()
    object: Mapping[str, Any] = field(default_factory=dict)
    """What is said of the object: file, scale, mass, com, inertia, friction."""
    header: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    opening: str = ""
    frame: str | None = None
    """The frame of the hand, by name, if all files of the format have the same."""


def column_of(values: Sequence[Any]) -> Column:
    """Values of n rows as an array (n, ...) of numbers or text, or else (n,) of objects."""
    try:
        column = np.asarray(values)
    except ValueError:  # of several lengths
        column = np.empty(0, object)
    if column.dtype.kind not in "biufU":
        column = np.empty(len(values), object)
        column[:] = values
    return column


def plain(column: Column) -> list[Any]:
    """Values of Python, None for NaN."""
    if column.dtype.kind == "f" and column.ndim == 1 and np.isnan(column).any():
        column = np.where(np.isnan(column), np.array(None), column)
    return list(column.tolist())


def flat(entries: Mapping[Any, Any], prefix: str = "") -> dict[str, Any]:
    """Entries by name, b within a as "a/b"."""
    found: dict[str, Any] = {}
    for key, value in entries.items():
        name = f"{prefix}{key}"
        found |= flat(value, f"{name}/") if isinstance(value, dict) else {name: value}
    return found


def nested(entries: Mapping[str, Any]) -> dict[str, Any]:
    """What `flat` was given."""
    whole: dict[str, Any] = {}
    for name, value in entries.items():
        *outer, last = name.split("/")
        place = whole
        for key in outer:
            place = place.setdefault(key, {})
        place[last] = value
    return whole
