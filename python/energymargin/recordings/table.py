"""From the text of a file to labels, or to numbers in SI units, each with its line."""

from __future__ import annotations

import csv
import io
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.columns import Column, Columns

__all__ = ["FrameTable", "SourceFile", "lines_of", "read_frame_labels", "read_labels", "read_table"]

NOT_SEEN = ("", "nan", "NaN", "NAN")
LARGEST_NUMBER = 2**53  # of a frame; beyond it, doubles are not all whole numbers

MOST_DIGITS = 15  # of a frame's number
WORDS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


@dataclass(frozen=True)
class SourceFile:
    """A file that errors name."""

    path: Path

    def error(self, text: str, line: int | None = None) -> ValueError:
        """That this is wrong, in that line."""
        where = "" if line is None else f", line {line}"
        return ValueError(f"{self.path}{where}: {text}")


@dataclass(frozen=True)
class FrameTable:
    """R rows of a file."""

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
    """Raises ValueError that says what was expected."""
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


def read_labels(path: str | os.PathLike[str]) -> dict[str, bool]:
    """Whether each recording ended well, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, and ValueError with the line that is something else or names a recording again.
    """
    source = SourceFile(Path(path))
    labels: dict[str, bool] = {}
    for line, (name, word) in _label_rows(path, ("recording", "success")):
        if name in labels:
            raise source.error(f"{name!r} has a label already", line)
        labels[name] = _label(source, line, "success", word)
    return labels


def read_frame_labels(path: str | os.PathLike[str]) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    source = SourceFile(Path(path))
    labels: dict[str, dict[int, bool]] = {}
    for line, (name, number, word) in _label_rows(path, ("recording", "frame", "captured")):
        of_recording = labels.setdefault(name, {})
        if not (number.isascii() and number.isdecimal() and len(number) <= MOST_DIGITS):
            raise source.error(f"frame is {number!r}, expected a whole number", line)
        if int(number) in of_recording:
            raise source.error(f"frame {number} of {name!r} has a label already", line)
        of_recording[int(number)] = _label(source, line, "captured", word)
    return labels


def _label_rows(
    path: str | os.PathLike[str], header: tuple[str, ...]
) -> list[tuple[int, list[str]]]:
    """Raises ValueError on another header, and on rows that are not as long."""
    source = SourceFile(Path(path))
    (first, names), *rows = lines_of(path)
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    for line, cells in rows:
        if len(cells) != len(header):
            raise source.error(f"has {len(cells)} cells, expected {len(header)}", line)
        if not cells[0]:
            raise source.error("has no name, expected that of a recording's file", line)
    if not rows:
        raise source.error("has no labels")
    return rows


def _label(source: SourceFile, line: int, name: str, word: str) -> bool:
    if word.lower() not in WORDS:
        raise source.error(f"{name} is {word!r}, expected one of {', '.join(WORDS)}", line)
    return WORDS[word.lower()]
