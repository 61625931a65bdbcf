"""CSV files: a recording's, with its columns and units, and those of labels."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import one_of
from energymargin.base.errors import needs_extra
from energymargin.records.recordings import cleaning, reading
from energymargin.records.recordings.reading import (
    BODIES,
    POSE,
    VELOCITY,
    FrameTable,
    Rules,
    SourceFile,
)
from energymargin.records.recordings.recording import Recording

UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": math.radians(1.0)},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
"""By kind and unit: its size in SI units. Velocities are such a length or angle a second."""

FIELDS = ("frame", "time", *(f"{body}_{axis}" for body in BODIES for axis in (*POSE, *VELOCITY)))
"""All columns, in the order of the documented header."""

NOT_SEEN = ("", "nan", "NaN", "NAN")
LARGEST_NUMBER = 2**53  # of a frame; beyond it, doubles are not all whole numbers


def _kind(name: str) -> str:
    """ "length", "angle" or "time"; "" of the frame's number."""
    if name in ("frame", "time"):
        return name.removeprefix("frame")
    return "angle" if "yaw" in name else "length"


HEADERS: dict[str, tuple[str, float | None]] = {name: (name, None) for name in FIELDS} | {
    f"{name}_{unit}{'_s' * name.endswith(VELOCITY)}": (name, size)
    for name in FIELDS
    for unit, size in UNITS.get(_kind(name), {}).items()
}
"""By a name in a header, as "object_vx_mm_s": the field, and the size of its unit if it has one."""


@dataclass(frozen=True, eq=False)
class Columns:
    """The layout of a file that has another than the documented one.

    Raises ValueError on unknown fields, units or columns.
    """

    columns: Mapping[str, str | int | float] = field(default_factory=dict)
    """By field: the name of its column, or its number from 0 on. Empty: the documented header.
    Columns of the file that are not named here are left alone. A float, as 0.0, is the value in
    each row, as of the yaw of a round body that has no column."""
    units: Mapping[str, str] = field(default_factory=dict)
    """By kind: "length" in "m", "cm" or "mm", "angle" in "rad" or "deg", "time" in "s", "ms", "us"
    or "ns". Velocities are such a length or angle a second."""
    delimiter: str = ","
    header: bool | None = None
    """Whether the first line has names; None: unless `columns` has numbers alone."""
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    """Pose of the camera's frame in the scene's: x, y [m] and yaw [rad]."""

    def __post_init__(self) -> None:
        """Checks what can be checked without a file."""
        _require_keys("columns", self.columns, FIELDS)
        _require_keys("units", self.units, tuple(UNITS))
        for kind, unit in self.units.items():
            one_of(f"the unit of {kind}", unit, list(UNITS[kind]))
        places = [column for column in self.columns.values() if type(column) is not float]
        for name, column in self.columns.items():
            whole = type(column) is int and column >= 0
            constant = type(column) is float and math.isfinite(column) and name not in FIELDS[:2]
            if not constant and (
                not (whole or isinstance(column, str)) or places.count(column) > 1
            ):
                raise ValueError(
                    f"columns has {column!r} for {name!r}, expected a name or a number from 0 on "
                    "that no other field has; or a float, the value in each row"
                )
        one_character = isinstance(self.delimiter, str) and len(self.delimiter) == 1
        if not one_character or self.delimiter in '\n\r"':
            raise ValueError(f"delimiter is {self.delimiter!r}, expected one character")
        if self.header not in (None, True, False):
            raise ValueError(f"header is {self.header!r}, expected true or false")
        if self.columns:
            _require_whole("columns", self.columns, needed=FIELDS[1:])
        reading.frame_origin(self.origin)

    @classmethod
    def of(cls, given: Columns | Mapping[str, Any] | str | os.PathLike[str] | None) -> Columns:
        """From a JSON file, or from its content; None is the documented layout.

        Raises ValueError that names the file, or FileNotFoundError.
        """
        if given is None or isinstance(given, Columns):
            return given or cls()
        file = Path(given) if isinstance(given, (str, os.PathLike)) else None
        try:
            content: Any = json.loads(file.read_text(encoding="utf-8")) if file else given
            _require_keys("the layout", content, [known.name for known in fields(cls)])
            return cls(**content)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{file}: {error}" if file else f"{error}") from error

    @property
    def has_header(self) -> bool:
        """Whether the first line has names."""
        named = not self.columns or any(isinstance(c, str) for c in self.columns.values())
        return named if self.header is None else self.header

    def places(self, first: Sequence[str]) -> dict[str, tuple[int, float]]:
        """By field: the number of its column, and what makes SI units of its numbers.

        `first` has the cells of the first line. Raises ValueError on a header that lacks a field,
        has it twice or, without `columns`, has others.
        """
        found: dict[str, tuple[int, float]] = {}
        for name, given in self.columns.items():
            if not isinstance(given, float):
                found[name] = (self._number(name, given, first), self._size(name))
        for number, cell in enumerate(() if self.columns else first):
            if cell not in HEADERS:
                raise ValueError(
                    f"the header has {cell!r}, expected {', '.join(FIELDS)}, each perhaps with its "
                    "unit, as object_yaw_deg; or say which column is what: columns=, --columns FILE"
                )
            name, size = HEADERS[cell]
            if name in found:
                raise ValueError(f"the header has {name!r} more than once")
            found[name] = (number, size or self._size(name))
        there = {*found, *self.constants}
        _require_whole("the header", there, needed=FIELDS[1:])
        return found

    @property
    def constants(self) -> dict[str, float]:
        """By field that has one, its value in each row, in SI units."""
        return {
            name: value * self._size(name)
            for name, value in self.columns.items()
            if isinstance(value, float)
        }

    def _number(self, field: str, given: str | int, first: Sequence[str]) -> int:
        """The number of a field's column, from 0 on."""
        if isinstance(given, int):
            if given >= len(first):
                raise ValueError(
                    f"there is no column {given} ({field}), expected 0 to {len(first) - 1}"
                )
            return given
        if not self.has_header:
            raise ValueError(f"columns names {given!r}, but the file is to have no header")
        if first.count(given) != 1:
            raise ValueError(f"expected one column {given!r}, the header is {', '.join(first)}")
        return first.index(given)

    def _size(self, name: str) -> float:
        """Size of the unit of a field whose header has none."""
        kind = _kind(name)
        return UNITS[kind][self.units[kind]] if kind in self.units else 1.0


def read_csv(
    path: str | os.PathLike[str],
    columns: Columns | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    *,
    repair: bool = True,
    longest_gap: float = reading.LONGEST_GAP,
    least_jump: float = cleaning.LEAST_JUMP,
    least_turn: float = cleaning.LEAST_TURN,
    smoothing: float = cleaning.SMOOTHING,
    smooth_poses: bool = True,
    causal: bool = False,
    origin: Sequence[float] | None = None,
) -> Recording:
    """The recording in a CSV file: a row a frame, with the poses of two bodies in a plane.

    Missing frames, frames in which a body was not seen, and outliers are interpolated.
    `docs/formats/recordings.md` has the rules. Needs the extra [recordings].

    Args:
        path: the CSV file.
        columns: which column is what, and the units: Columns, or a JSON file of them. None: the
            header is frame,time,object_x,object_y,object_yaw,object_vx,object_vy,object_yaw_rate,
            and the same of the effector [m, rad, s]; frame and velocities may be missing.
        repair: False makes each frame that would be interpolated an error.
        longest_gap: the longest time over which poses are interpolated [s].
        least_jump: an outlier jumps by so much at least [m].
        least_turn: the same of its yaw [rad].
        smoothing: the largest time scale of the smoothing spline [s], which gives the velocities
            that the file does not have.
        smooth_poses: whether the spline gives the poses of such a body, too.
        causal: whether the spline of each frame goes through frames up to it alone, as a robot has
            them: foresight is then not helped by frames to come. The first six are left out.
        origin: of the camera's frame in the scene's, x, y [m] and yaw [rad]; None is that of
            `columns`.

    Raises OSError, ImportError without the extra, and ValueError that names the file, the line and
    what was expected there.
    """
    rules = Rules(repair, longest_gap, least_jump, least_turn, smoothing, smooth_poses, causal)
    layout = Columns.of(columns)
    place = reading.frame_origin(layout.origin if origin is None else origin)
    return reading.recording_of(_table(SourceFile(Path(path)), layout), rules, place)


def _require_keys(what: str, given: Any, known: Collection[str]) -> None:
    """Raises ValueError unless it is a mapping of some of these keys."""
    if not (isinstance(given, Mapping) and set(given) <= set(known)):
        raise ValueError(f"{what} is {given!r}, expected an object with {', '.join(known)}")


def _require_whole(what: str, given: Container[str], needed: Sequence[str]) -> None:
    """Raises ValueError unless all poses are there, and of each body all velocities or none."""
    rates = [[f"{body}_{axis}" for axis in VELOCITY] for body in BODIES]
    optional = {name for three in rates if not any(n in given for n in three) for name in three}
    missing = [name for name in needed if name not in given and name not in optional]
    if missing:
        raise ValueError(
            f"{what} lacks {missing[0]!r}; frame may be missing, and all three velocities of a body"
        )


def read_cells(source: SourceFile, delimiter: str = ",") -> dict[int, list[str]]:
    """The cells of a CSV file as text, by their line; no empty lines.

    Raises OSError, ImportError without pandas, and ValueError on a file that is not text in UTF-8,
    is empty, or has rows of several lengths.
    """
    with needs_extra("a CSV file of recordings", "recordings"):
        import pandas as pd
    try:
        cells = pd.read_csv(
            source.path,
            sep=delimiter,
            header=None,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
            encoding="utf-8-sig",
            engine="python",  # which tells a cell that is missing from one that is empty
        )
    except ValueError as error:  # pandas' own are such
        raise source.error(f"{error}; expected a CSV file in UTF-8") from error
    # Row by row, as pandas takes many columns one by one. A cell that is missing is no text.
    rows = [[cell.strip() for cell in row if isinstance(cell, str)] for row in cells.to_numpy()]
    lines = {line: row for line, row in enumerate(rows, start=1) if any(row)}
    if not lines:
        raise source.error("is empty; expected a CSV file")
    for line, row in lines.items():
        if len(row) < cells.shape[1]:
            raise source.error(f"has {len(row)} cells, expected {cells.shape[1]}", line)
    return lines


def _table(source: SourceFile, columns: Columns) -> FrameTable:
    """The numbers of a recording's file.

    Raises as `read_cells`, and ValueError with the line of a header or cell that is none of those
    expected.
    """
    cells = read_cells(source, columns.delimiter)
    first = next(iter(cells))
    try:
        places = columns.places(cells[first])
    except ValueError as error:
        raise source.error(str(error), first) from None
    lines = [line for line in cells if line > first or not columns.has_header]
    values = {
        name: size * _numbers(source, name, {line: cells[line][number] for line in lines})
        for name, (number, size) in places.items()
    }
    return frame_table(source, np.array(lines, np.int64), {**values, **columns.constants})


def frame_table(
    source: SourceFile, lines: NDArray[np.int64], values: Mapping[str, float | NDArray[np.float64]]
) -> FrameTable:
    """The table of the numbers of R rows by field, each of shape (R,) or one for all rows, in SI
    units. `lines` are the rows' places in the file."""

    def of_body(axes: Sequence[str]) -> dict[str, NDArray[np.float64]]:
        return {
            body: np.stack([row + values[f"{body}_{axis}"] for axis in axes], axis=1)
            for body in BODIES
            if f"{body}_{axes[0]}" in values
        }

    row = np.zeros(len(lines))
    frames = np.asarray(values.get("frame", np.arange(len(lines)))).astype(np.int64)
    times = np.asarray(values["time"])
    return FrameTable(source, lines, frames, times, of_body(POSE), of_body(VELOCITY))


def _numbers(source: SourceFile, name: str, column: dict[int, str]) -> NDArray[np.float64]:
    """The numbers of a column, shape (R,), from its cells by line; NaN where a body was not
    seen."""
    import pandas as pd

    cells = pd.Series(column, dtype=object)
    values = pd.to_numeric(cells, errors="coerce").to_numpy(float)
    needed = name in ("frame", "time")
    wrong = ~np.isfinite(values)
    if not needed:
        wrong &= ~cells.isin(NOT_SEEN).to_numpy()
    if name == "frame":
        wrong |= (values != np.round(values)) | (np.abs(values) >= LARGEST_NUMBER)
    if wrong.any():
        k = int(np.argmax(wrong))
        expected = f"a {'whole ' if name == 'frame' else ''}number{' in each row' * needed}"
        raise source.error(f"{name} is {cells.iloc[k]!r}, expected {expected}", cells.index[k])
    return np.asarray(values)
