"""CSV files: recordings, with their columns and units, and labels: what happened to recordings, and
in each of their frames."""

from __future__ import annotations

import csv
import json
import math
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin.base.aliases import AnyPath, Floats
from energymargin.base.checks import one_of
from energymargin.base.errors import needs_extra
from energymargin.records.recordings.cleaning import LooseRules, Rules, cleaned, require_origin
from energymargin.records.recordings.formats import require_recording
from energymargin.records.recordings.recording import Recording
from energymargin.records.recordings.table import FileSource, fields_of, first, require_whole

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack

UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": math.radians(1.0)},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
"""By kind and unit: its size in SI units. Velocities are such a length or angle a second."""

RATES = ("_vx", "_vy", "_vz", "_yaw_rate", "_wx", "_wy", "_wz")

NOT_SEEN = ("", "nan", "NaN", "NAN")
LARGEST_NUMBER = 2**53  # of a frame; beyond it, doubles are not all whole numbers
FRAME = re.compile(r"0|[1-9][0-9]{,14}")
WORDS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


def _kind(name: str) -> str:
    """ "length", "angle" or "time"; "" of a frame's number or a quaternion."""
    if name.endswith(("time", "yaw", "rate", "_wx", "_wy", "_wz")):
        return "time" if name == "time" else "angle"
    return "length" if re.search("_v?[xyz]$", name) else ""


def headers(names: Collection[str]) -> dict[str, tuple[str, float | None]]:
    """By a name that may stand in a header with these names, as "object_vx_mm_s": the field, and
    the size of its unit if it has one."""
    known = fields_of(names)
    sized = [(name, *unit) for name in known for unit in UNITS.get(_kind(name), {}).items()]
    found: dict[str, tuple[str, float | None]] = {name: (name, None) for name in known}
    for name, unit, size in sized:
        found[f"{name}_{unit}{'_s' * name.endswith(RATES)}"] = (name, size)
    return found


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
        _require_keys("columns", self.columns)
        _require_keys("units", self.units, UNITS)
        for kind, unit in self.units.items():
            one_of(f"the unit of {kind}", unit, list(UNITS[kind]))
        places = [column for column in self.columns.values() if type(column) is not float]
        for name, column in self.columns.items():
            right = isinstance(column, str) or (type(column) is int and column >= 0)
            right &= places.count(column) == 1
            if type(column) is float:
                right = math.isfinite(column) and name not in ("frame", "time")
            if not right:
                raise ValueError(
                    f"columns has {column!r} for {name!r}, expected a name or a number from 0 on "
                    "that no other field has; or a float, the value in each row"
                )
        if not (isinstance(self.delimiter, str) and re.fullmatch('[^\n\r"]', self.delimiter)):
            raise ValueError(f"delimiter is {self.delimiter!r}, expected one character")
        if self.header not in (None, True, False):
            raise ValueError(f"header is {self.header!r}, expected true or false")
        if self.columns:
            require_whole("columns", self.columns)
        require_origin(self.origin)

    @classmethod
    def of(cls, given: Columns | Mapping[str, Any] | AnyPath | None) -> Columns:
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
        known = {} if self.columns else headers(first)
        for number, cell in enumerate(() if self.columns else first):
            if cell not in known:
                text = f"the header has {cell!r}, expected {', '.join(fields_of(first))}"
                text += ", each perhaps with its unit, as object_yaw_deg"
                raise ValueError(f"{text}; or say which column is what: columns=, --columns FILE")
            name, size = known[cell]
            if name in found:
                raise ValueError(f"the header has {name!r} more than once")
            found[name] = (number, size or self._size(name))
        require_whole("the header", {*found, *self.constants})
        return found

    @property
    def constants(self) -> dict[str, float]:
        """By field that has one, its value in each row, in SI units."""
        given = self.columns.items()
        return {name: own * self._size(name) for name, own in given if isinstance(own, float)}

    def _number(self, field: str, given: str | int, first: Sequence[str]) -> int:
        """The number of a field's column, from 0 on."""
        if isinstance(given, int):
            if given >= len(first):
                text = f"there is no column {given} ({field}), expected 0 to {len(first) - 1}"
                raise ValueError(text)
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
    path: AnyPath,
    columns: Columns | Mapping[str, Any] | AnyPath | None = None,
    **rules: Unpack[LooseRules],
) -> Recording:
    """The recording in a CSV file: a row a frame, with the poses of bodies in a plane or in space.

    Missing frames, frames in which a body was not seen, and outliers are interpolated.
    `docs/formats/recordings.md` has the rules. Needs the extra [recordings].

    Args:
        path: the CSV file.
        columns: which column is what, and the units: Columns, or a JSON file of them. None: the
            header is frame,time,object_x,object_y,object_yaw,object_vx,object_vy,object_yaw_rate,
            and the same of the effector, or of bodies of any other names [m, rad, s]; frame and
            velocities may be missing. Poses in space are BODY_x, BODY_y, BODY_z, BODY_qx, BODY_qy,
            BODY_qz, BODY_qw, their velocities BODY_vx, ..., BODY_wz.
        rules: the fields of Rules by name, as repair=False, longest_gap=0.2, least_jump=0.01,
            least_turn=0.2, smoothing=0.03, smooth_poses=False, causal=True or
            origin=(0.1, 0.0, 1.57).

    Raises OSError, ImportError without the extra, and ValueError that names the file, the line and
    what was expected there.
    """
    require_recording(Path(path))
    layout, source = Columns.of(columns), FileSource(Path(path))
    checked = Rules(**rules).in_frame(layout.origin)
    return cleaned(_table(source, layout), source, checked)


def from_table(table: pd.DataFrame, name: str = "table", **rules: Unpack[LooseRules]) -> Recording:
    """The recording in a pandas table in SI units, a row a frame, whose columns have the names of
    a CSV file's header. Needs the extra [recordings].

    Args:
        table: its index counts the rows in errors.
        name: of the recording, as labels know it.
        rules: as of `read_csv`.

    Raises ValueError as `read_csv`.
    """
    require_whole("the table", table.columns)
    return cleaned(table, FileSource(Path(name), "row"), Rules(**rules))


def _require_keys(what: str, given: Any, known: Collection[str] = ()) -> None:
    """Raises ValueError unless it is a mapping of some of these keys; by default of fields."""
    right = isinstance(given, Mapping) and all(isinstance(key, str) for key in given)
    known = known or fields_of(given if right else ())
    if not (right and set(given) <= set(known)):
        raise ValueError(f"{what} is {given!r}, expected an object with {', '.join(known)}")


def read_cells(source: FileSource, delimiter: str = ",") -> dict[int, list[str]]:
    """The cells of a CSV file as text, by their line; no empty lines.

    Raises OSError, and ValueError on a file that is not text in UTF-8, is empty, or has rows of
    several lengths.
    """
    lines = {}
    try:
        with source.path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, delimiter=delimiter)
            for row in reader:
                lines[reader.line_num] = [cell.strip() for cell in row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise source.error(f"{error}; expected a CSV file in UTF-8") from error
    lines = {line: row for line, row in lines.items() if any(row)}
    if not lines:
        raise source.error("is empty; expected a CSV file")
    width = len(next(iter(lines.values())))
    for line, row in lines.items():
        if len(row) != width:
            raise source.error(f"has {len(row)} cells, expected {width}", line)
    return lines


def _table(source: FileSource, columns: Columns) -> pd.DataFrame:
    """The table in a recording's file.

    Raises as `read_cells`, and ValueError with the line of a header or cell that is none of those
    expected.
    """
    with needs_extra("a CSV file of recordings", "recordings"):
        import pandas as pd
    lines = read_cells(source, columns.delimiter)
    top = next(iter(lines))
    try:
        places = columns.places(lines[top])
    except ValueError as error:
        raise source.error(str(error), top) from None
    rows = {line: row for line, row in lines.items() if line > top or not columns.has_header}
    cells = pd.DataFrame(list(rows.values()), list(rows), range(len(lines[top])), dtype=object)
    numbers = {name: _numbers(source, name, cells[k]) * size for name, (k, size) in places.items()}
    return pd.DataFrame(numbers, index=cells.index).assign(**columns.constants)


def _numbers(source: FileSource, name: str, cells: pd.Series[Any]) -> Floats:
    """The numbers of a column of texts; NaN where a body was not seen."""
    import pandas as pd

    values = pd.to_numeric(cells, errors="coerce").to_numpy(float)
    needed = name in ("frame", "time")
    wrong = ~np.isfinite(values)
    if not needed:
        wrong &= ~cells.isin(NOT_SEEN).to_numpy()
    if name == "frame":
        wrong |= (values != np.round(values)) | (np.abs(values) >= LARGEST_NUMBER)
    if (row := first(wrong)) is not None:
        expected = f"a {'whole ' * (name == 'frame')}number{' in each row' * needed}"
        raise source.error(f"{name} is {cells.iloc[row]!r}, expected {expected}", cells.index[row])
    return values


def read_labels(path: AnyPath) -> dict[str, bool]:
    """Whether each recording succeeded, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, and ValueError with the line that is something else or names a recording again.
    """
    return {name: label for (name,), label in _labelled(path, ("recording", "success")).items()}


def read_frame_labels(path: AnyPath) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    labels: dict[str, dict[int, bool]] = {}
    for (name, number), label in _labelled(path, ("recording", "frame", "captured")).items():
        labels.setdefault(name, {})[int(number)] = label
    return labels


def _labelled(path: AnyPath, header: tuple[str, ...]) -> dict[tuple[str, ...], bool]:
    """The labels of a file with this header, by what comes before them in their rows."""
    source = FileSource(Path(path))
    (first, names), *rows = read_cells(source).items()
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    labels: dict[tuple[str, ...], bool] = {}
    for line, (*key, word) in rows:
        known = key[0] and all(map(FRAME.fullmatch, key[1:])) and word.lower() in WORDS
        if not known or tuple(key) in labels:
            raise source.error(
                f"has {','.join([*key, word])!r}, expected {','.join(header)}: the name of a "
                f"recording's file, a frame's number, one of {', '.join(WORDS)}; each once",
                line,
            )
        labels[tuple(key)] = WORDS[word.lower()]
    if not labels:
        raise source.error("has no labels")
    return labels
