"""A recording's CSV file: which column is what, in which units, and its numbers in SI units."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections import Counter
from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.reprs import short_repr

__all__ = [
    "BODIES",
    "FIELDS",
    "HEADERS",
    "UNITS",
    "Columns",
    "FrameTable",
    "SourceFile",
    "frame_origin",
    "kind_of",
    "lines_of",
    "of_body",
    "read_table",
]

BODIES = ("object", "effector")
POSE = ("x", "y", "yaw")
VELOCITY = ("vx", "vy", "yaw_rate")

UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": math.radians(1.0)},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
"""By kind and unit: its size in SI units. Velocities are such a length or angle a second."""

MOST_NAMED = 100  # columns that an error lists
NOT_SEEN = ("", "nan", "NaN", "NAN")
LARGEST_NUMBER = 2**53  # of a frame; beyond it, doubles are not all whole numbers


def of_body(body: str) -> tuple[list[str], list[str]]:
    """The three columns of a body's pose, and the three of its velocity."""
    return [f"{body}_{axis}" for axis in POSE], [f"{body}_{axis}" for axis in VELOCITY]


FIELDS = ("frame", "time", *(name for body in BODIES for three in of_body(body) for name in three))
"""All columns, in the order of the documented header."""


def kind_of(field: str) -> str | None:
    """ "length", "angle" or "time"; None of the frame's number."""
    if field in ("frame", "time"):
        return "time" if field == "time" else None
    return "angle" if "yaw" in field else "length"


def _headers() -> dict[str, tuple[str, str | None]]:
    found: dict[str, tuple[str, str | None]] = {name: (name, None) for name in FIELDS}
    for name in FIELDS:
        a_second = "_s" if name.rpartition("_")[2] in ("vx", "vy", "rate") else ""
        for unit in UNITS.get(kind_of(name) or "", ()):
            found[f"{name}_{unit}{a_second}"] = (name, unit)
    return found


HEADERS = _headers()
"""By a name in a header, such as "object_yaw_deg" or "object_vx_mm_s": the field and its unit."""


@dataclass(frozen=True)
class Column:
    """Where a field stands in a row, and what its numbers are multiplied with."""

    field: str
    number: int
    """From 0 on."""
    factor: float
    """To SI units."""


@dataclass(frozen=True, eq=False)
class Columns:
    """The layout of a file that has another than the documented one.

    Raises ValueError on unknown fields, units or columns.
    """

    columns: Mapping[str, str | int] = field(default_factory=dict)
    """By field: the name of its column, or its number from 0 on. Empty: the documented header.
    Columns of the file that are not named here are left alone."""
    units: Mapping[str, str] = field(default_factory=dict)
    """By kind: "length" in "m", "cm" or "mm", "angle" in "rad" or "deg", "time" in "s", "ms", "us"
    or "ns". Velocities are such a length or angle a second."""
    delimiter: str = ","
    header: bool | None = None
    """Whether the first line has names; None: unless `columns` has numbers alone."""
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    """Of the camera's frame in the scene's: x, y [m] and yaw [rad]."""

    def __post_init__(self) -> None:
        """Checks what can be checked without a file."""
        _require_known("columns", self.columns, FIELDS)
        _require_known("units", self.units, UNITS)
        for kind, unit in self.units.items():
            if not isinstance(unit, str) or unit not in UNITS[kind]:
                raise ValueError(f"units has the {kind} in {unit!r}, expected {_or(UNITS[kind])}")
        for name, column in self.columns.items():
            if isinstance(column, bool) or not isinstance(column, (str, int)):
                raise ValueError(
                    f"columns has {column!r} for {name!r}, expected a name or a number"
                )
            if isinstance(column, int) and column < 0:
                raise ValueError(f"columns has {column} for {name!r}, expected a number from 0 on")
        if (
            not isinstance(self.delimiter, str)
            or len(self.delimiter) != 1
            or self.delimiter in '\n\r"'
        ):
            raise ValueError(f"delimiter is {self.delimiter!r}, expected one character")
        if self.header not in (None, True, False):
            raise ValueError(f"header is {self.header!r}, expected true or false")
        if self.columns:
            _require_whole("columns", self.columns, needed=FIELDS[1:])
        frame_origin(self.origin)

    @classmethod
    def of(cls, given: Columns | Mapping[str, Any] | str | os.PathLike[str] | None) -> Columns:
        """From a JSON file, or from its content; None is the documented layout.

        Raises ValueError that names the file, or FileNotFoundError.
        """
        if given is None or isinstance(given, Columns):
            return given or cls()
        if isinstance(given, Mapping):
            return cls._made(dict(given))
        if not (isinstance(given, (str, os.PathLike)) and os.fspath(given)):
            raise ValueError(f"columns is {given!r}, expected a mapping or a JSON file of one")
        path = Path(given)
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            if not isinstance(content, dict):
                raise ValueError(f"is a {type(content).__name__}, expected a JSON object")
            return cls._made(content)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{path}: {error}") from error

    @classmethod
    def _made(cls, content: dict[str, Any]) -> Columns:
        names = [known.name for known in fields(cls)]
        _require_known("the mapping of columns", content, names)
        for name in ("columns", "units"):
            if not isinstance(content.get(name, {}), Mapping):
                raise ValueError(f"{name} is {content[name]!r}, expected an object")
        return cls(**content)

    @property
    def has_header(self) -> bool:
        """Whether the first line has names."""
        if self.header is not None:
            return self.header
        return not self.columns or any(isinstance(c, str) for c in self.columns.values())

    def found(self, header: Sequence[str] | None, width: int) -> list[Column]:
        """Where each field stands in rows of `width` cells.

        Raises ValueError on a header that lacks a field, has it twice or, without `columns`, has
        others.
        """
        if header is not None:
            if not self.columns and all(_is_number(name) for name in header):
                raise ValueError(
                    f"there is no header, expected {','.join(FIELDS[:5])},... in the first line; "
                    "or say which column is what: columns="
                )
            doubled = sorted(name for name, count in Counter(header).items() if count > 1)
            used = doubled if not self.columns else [n for n in doubled if n in self._names()]
            if used:
                raise ValueError(f"the header has {used[0]!r} more than once")
        return self._mapped(header, width) if self.columns else self._documented(header or ())

    def _names(self) -> list[str | int]:
        return list(self.columns.values())

    def _documented(self, header: Sequence[str]) -> list[Column]:
        unknown = [name for name in header if name not in HEADERS]
        if unknown:
            raise ValueError(
                f"the header has {unknown[0]!r}, expected {', '.join(FIELDS)}, each "
                "perhaps with its unit, as object_yaw_deg; or say which column is what: columns="
            )
        found: dict[str, Column] = {}
        for number, name in enumerate(header):
            known, unit = HEADERS[name]
            if known in found:
                raise ValueError(f"the header has {known!r} twice, in two units")
            found[known] = Column(known, number, self._factor(known, unit))
        _require_whole("the header", found, needed=FIELDS)
        return list(found.values())

    def _mapped(self, header: Sequence[str] | None, width: int) -> list[Column]:
        found: dict[int, Column] = {}
        for name, given in self.columns.items():
            number = given if isinstance(given, int) else _place(given, header)
            if number >= width:
                raise ValueError(f"there is no column {number} ({name}), expected 0 to {width - 1}")
            if number in found:
                raise ValueError(f"columns has {given!r} for {found[number].field!r} and {name!r}")
            found[number] = Column(name, number, self._factor(name))
        return list(found.values())

    def _factor(self, name: str, unit: str | None = None) -> float:
        kind = kind_of(name)
        if kind is None:
            return 1.0
        return UNITS[kind][unit or self.units.get(kind, next(iter(UNITS[kind])))]


def _place(name: str, header: Sequence[str] | None) -> int:
    """The number of a column. Raises ValueError if there is none of this name."""
    if header is None:
        raise ValueError(f"columns names {name!r}, but the file is to have no header")
    if name not in header:
        raise ValueError(f"there is no column {name!r}, expected one of {_some(header)}")
    return list(header).index(name)


def frame_origin(given: Sequence[float]) -> tuple[float, float, float]:
    """x, y [m] and yaw [rad] of a frame. Raises ValueError on anything else."""
    try:
        values = np.asarray(given, dtype=float)
    except (TypeError, ValueError, OverflowError):
        values = np.array(np.nan)
    if values.shape != (3,) or not (np.abs(values) <= 1e6).all():
        raise ValueError(f"origin is {given!r}, expected x, y [m] and yaw [rad]")
    x, y, yaw = values.tolist()
    return x, y, yaw


def _require_known(what: str, given: Iterable[str], known: Collection[str]) -> None:
    unknown = [name for name in given if name not in known]
    if unknown:
        raise ValueError(f"{what} has {unknown[0]!r}, expected {_or(known)}")


def _require_whole(what: str, given: Container[str], needed: Sequence[str]) -> None:
    """Raises ValueError unless all poses are there, and of each body all velocities or none."""
    velocities = {name for body in BODIES for name in of_body(body)[1]}
    missing = [name for name in needed if name not in given and name not in velocities]
    for body in BODIES:
        some = [name for name in of_body(body)[1] if name in given]
        missing += [name for name in of_body(body)[1] if some and name not in given]
    if missing:
        raise ValueError(
            f"{what} lacks {missing[0]!r}; only the velocities of a body may be missing, all three"
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _some(names: Sequence[str]) -> str:
    more = f", ... ({len(names)} in all)" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def _or(words: Iterable[str]) -> str:
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else str(last)


@dataclass(frozen=True)
class SourceFile:
    """A file that errors name."""

    path: Path
    row: str = "line"
    """What one of its rows is called."""
    of_units: str = "Say so: columns="
    """What to do about numbers in other units."""

    def error(self, text: str, line: int | None = None) -> ValueError:
        """A ValueError that names the file and the line."""
        where = "" if line is None else f", {self.row} {line}"
        return ValueError(f"{self.path}{where}: {text}")


@dataclass(frozen=True, eq=False)
class FrameTable:
    """R rows of a file."""

    __repr__ = short_repr

    source: SourceFile
    lines: NDArray[np.int64]
    """The line of each row in the file, shape (R,)."""
    values: dict[str, NDArray[np.float64]]
    """By field: a column in SI units, shape (R,); NaN where a marker was not seen."""


def lines_of(path: str | os.PathLike[str], delimiter: str = ",") -> list[tuple[int, list[str]]]:
    """The cells of a CSV file, with the number of their line; empty lines are left out.

    Raises OSError, and ValueError on a file that is not text in UTF-8, or is empty.
    """
    source = SourceFile(Path(path))
    raw = source.path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise source.error("is not text in UTF-8; save it as CSV in UTF-8", line) from None
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=delimiter)
    rows = []
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append((reader.line_num, [cell.strip() for cell in cells]))
    except csv.Error as error:
        raise source.error(str(error), reader.line_num) from None
    if not rows:
        raise source.error("is empty")
    return rows


def read_table(path: str | os.PathLike[str], columns: Columns) -> FrameTable:
    """The numbers of a file.

    Raises OSError, and ValueError with the line of a header or cell that is none of those expected.
    """
    source = SourceFile(Path(path))
    rows = lines_of(path, columns.delimiter)
    first, cells = rows[0]
    try:
        found = columns.found(cells if columns.has_header else None, len(cells))
    except ValueError as error:
        raise source.error(str(error), first) from None
    data = rows[1:] if columns.has_header else rows
    for line, row in data:
        if len(row) != len(cells):
            raise source.error(f"has {len(row)} cells, expected {len(cells)}", line)
    return FrameTable(
        source,
        np.array([line for line, _ in data], dtype=np.int64),
        {column.field: _column(source, column, data) for column in found},
    )


def _column(
    source: SourceFile, column: Column, rows: list[tuple[int, list[str]]]
) -> NDArray[np.float64]:
    values = np.empty(len(rows))
    for k, (line, row) in enumerate(rows):
        try:
            values[k] = column.factor * _number(column.field, row[column.number])
        except ValueError as error:
            raise source.error(f"{column.field} is {row[column.number]!r}, {error}", line) from None
    return values


def _number(field: str, cell: str) -> float:
    """Raises ValueError with what was expected."""
    if cell in NOT_SEEN:
        if field in ("frame", "time"):
            raise ValueError("expected a number in each row")
        return math.nan
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else math.inf
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError("expected a number")
    if field == "frame" and not (value.is_integer() and abs(value) < LARGEST_NUMBER):
        raise ValueError("expected a whole number")
    return value
