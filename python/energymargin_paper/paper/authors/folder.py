"""The folder of the published data: its parts, and its tables of numbers."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["RECORDINGS", "SIMULATED", "of_part", "parts", "read_columns", "require_same"]

SIMULATED = ("push", "balance", "topple", "grasp")
"""The simulated datasets of Table I, in its order."""
RECORDINGS = tuple(
    f"{tool}-pushes-{object}"
    for object in ("rectangle", "triangle", "convex", "concave", "irregular")
    for tool in ("jaw", "circle")
)
"""The combinations of Table II, in its order."""

Columns = dict[str, NDArray[np.float64]]


def parts(folder: str | os.PathLike[str]) -> list[str]:
    """The names of the parts, simulated first: "push", ..., "jaw-pushes-rectangle", ...

    Raises ValueError if there is none.
    """
    root = Path(folder)
    found = [name for name in SIMULATED if (root / "simulated" / name).is_dir()]
    found += [name for name in RECORDINGS if (root / "recordings" / name).is_dir()]
    if not found:
        raise ValueError(
            f"{root} has no published data, expected a folder with simulated/push and the like, or "
            "recordings/jaw-pushes-rectangle and the like"
        )
    return found


def of_part(folder: str | os.PathLike[str], part: str) -> Path:
    """The folder of a part. Raises ValueError if there is none."""
    known = parts(folder)
    if part not in known:
        raise ValueError(f"part is {part!r}, expected one of {', '.join(known)}")
    kind = "simulated" if part in SIMULATED else "recordings"
    return Path(folder) / kind / part


def read_columns(path: Path, names: Sequence[str], *, optional: Sequence[str] = ()) -> Columns:
    """The columns of these names, shape (R,) each, and those of `optional` that there are.

    A row may have more cells than the header: remarks. "inf" is a number, "nan" is not.
    Raises OSError, and ValueError that names the file, the line and what was expected there.
    """
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        header = [name.strip() for name in next(rows, [])]
        lacking = [name for name in names if name not in header]
        if lacking:
            raise ValueError(f"{path}: the header lacks {lacking[0]!r}; it has {', '.join(header)}")
        wanted = [*names, *(name for name in optional if name in header)]
        places = [header.index(name) for name in wanted]
        values = [
            [_number(path, rows.line_num, header[place], row, place) for place in places]
            for row in rows
            if row
        ]
    if not values:
        raise ValueError(f"{path}: has no rows below its header")
    return dict(zip(wanted, np.array(values, dtype=np.float64).T, strict=True))


def _number(path: Path, line: int, name: str, row: list[str], place: int) -> float:
    if place >= len(row):
        raise ValueError(f"{path}, line {line}: has {len(row)} cells, and none of {name!r}")
    try:
        value = float(row[place])
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise ValueError(f"{path}, line {line}: {name} is {row[place]!r}, expected a number")
    return value


def require_same(
    path: Path, what: str, found: NDArray[np.float64], expected: NDArray[np.float64]
) -> None:
    """Raises ValueError unless a file's rows are of the same states as those of another."""
    if len(found) != len(expected):
        raise ValueError(f"{path}: has {len(found)} rows, expected {len(expected)}, one a state")
    wrong = np.flatnonzero(found != expected)
    if len(wrong):
        k = int(wrong[0])
        raise ValueError(
            f"{path}: row {k + 1} is of {what} {found[k]:g}, expected {expected[k]:g}: the states "
            "have to be in the same order in all files"
        )
