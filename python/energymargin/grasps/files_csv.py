"""Tables of poses as text: a header that names the columns, or rows of 16 numbers of a matrix."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.grasps.frames import poses_of, quaternions_of
from energymargin.grasps.grasp_set import Column, Content, plain

FORMAT, FRAME, GRASPA = "CSV", "grasp", "GRASPA"
LABEL, OPENING, NAME = "label", "opening", "name"
OF_GRASPA = {"planner", "layout", "object", "grasped", "stability"}
"""Columns of the grasps of GRASPA-test, whose hand's frame is that of a Panda's tool."""

QUATERNION = ("qx", "qy", "qz", "qw")
MATRIX = {f"m{row}{column}": (row, column) for row in range(4) for column in range(4)}
POSITION = {"x": (0, 3), "y": (1, 3), "z": (2, 3)}
ENTRIES = {**MATRIX, **POSITION}
"""Entries of the matrix, by name: row and column."""
MOVES = ({"m03", "m13", "m23"}, {*POSITION})
TURNS = ({name for name in MATRIX if max(MATRIX[name]) < 3}, {*QUATERNION})
SPELLINGS: dict[str, tuple[str, ...]] = {
    **{k: (k, f"p{k}", f"pos{k}", f"position{k}", f"t{k}", f"translation{k}") for k in POSITION},
    **{k: (k, f"quat{k[1]}", f"quaternion{k[1]}", f"orientation{k[1]}") for k in QUATERNION},
    **{k: (k, f"t{k[1:]}", f"r{k[1:]}") for k in MATRIX},
    OPENING: (OPENING, "gripperopening", "width", "gripperwidth", "graspwidth", "aperture"),
    LABEL: (LABEL, "success", "grasped", "held", "objectingripper", "confidence"),
    NAME: (NAME, "id", "graspid", "graspname"),
}
"""By what a column holds: its names in lower case without signs, the one that counts first."""
WORDS = {"true": "1", "yes": "1", "false": "0", "no": "0", "": "nan"}
EXPECTED = (
    "a table whose first line names x, y, z with qx, qy, qz, qw or m00 to m33, and opening, label, "
    "name if there are any, or else HDF5 of ACRONYM, JSON of GraspGen or YAML of isaac_grasp; "
    "angles such as roll, pitch, yaw are not read. em.grasps.GraspSet(poses) takes matrices "
    "(n, 4, 4) of any source"
)


@dataclass(frozen=True, eq=False)
class CsvLayout:
    """Which column of a table is what."""

    cells: tuple[str, ...]
    """The header, or the names of columns that have none."""
    places: dict[str, str]
    """By a key of SPELLINGS, the cell of its column."""
    delimiter: str = ","
    header: bool = True


def read(path: Path) -> Content:
    """The rows of a table. Raises ValueError that names the row and cell that is no number."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"is no text in UTF-8, expected {EXPECTED}") from error
    lines = [line for line in lines if line.strip() and not line.startswith("#")]
    delimiter = next((sign for sign in ",;\t" if sign in "".join(lines[:1])), " ")
    if delimiter == " ":
        lines = [" ".join(line.split()) for line in lines]
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
    layout = _layout(rows[0] if rows else [], delimiter)
    rows = rows[layout.header :]
    for number, row in enumerate(rows, 1):
        if len(row) != len(layout.cells):
            raise ValueError(f"row {number} has {len(row)} cells, expected {len(layout.cells)}")
    cells = dict(zip(layout.cells, zip(*rows, strict=True), strict=bool(rows)))
    return _content(cells, layout)


def write(path: Path, content: Content) -> None:
    """A table with the columns that the content was read with, and then all others."""
    cells = (NAME, *POSITION, *QUATERNION)
    layout = content.header.get("layout") or CsvLayout(cells, {cell: cell for cell in cells})
    values = {key: content.poses[:, row, column] for key, (row, column) in ENTRIES.items()}
    values |= dict(zip(QUATERNION, quaternions_of(content.poses).T, strict=True))
    values[NAME] = np.array(content.names)
    table: dict[str, Column] = dict(content.columns)
    table |= {cell: values[key] for key, cell in layout.places.items() if key in values}
    cells = (*layout.cells, *(name for name in table if name not in layout.cells))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, delimiter=layout.delimiter, lineterminator="\n")
        if layout.header or cells != layout.cells:
            writer.writerow(cells)
        writer.writerows(zip(*(plain(table[cell]) for cell in cells), strict=True))


def _layout(first: Sequence[str], delimiter: str) -> CsvLayout:
    """From the first line; raises ValueError if that is no header of poses, nor 16 numbers."""
    numbers = all(re.fullmatch(r"[-+.\d]+(e[-+]?\d+)?", cell, re.IGNORECASE) for cell in first)
    if numbers and len(first) == len(MATRIX):
        return CsvLayout(tuple(MATRIX), {name: name for name in MATRIX}, delimiter, header=False)
    if numbers and first:
        said = f"has {len(first)} numbers in its first line, which do not say what they are"
        way = "give it a first line of names, as x,y,z,qx,qy,qz,qw, or x,y,z,qw,qx,qy,qz"
        raise ValueError(f"{said}; {way}")
    bare = [re.sub("[^a-z0-9]", "", cell.lower()).removeprefix("pose") for cell in first]
    if twice := [cell for cell in first if first.count(cell) > 1]:
        said = f"the header has {twice[0]!r} {len(twice)} times"
        raise ValueError(f"{said}, expected names that differ")
    places: dict[str, str] = {}
    for key, spellings in SPELLINGS.items():
        found = [first[k] for name in spellings for k, word in enumerate(bare) if word == name]
        if len(found) > 1 and key not in (LABEL, OPENING, NAME):
            raise ValueError(f"the header has {found[0]!r} and {found[1]!r}, expected one {key}")
        places |= {key: found[0]} if found else {}
    if not all(any(names <= {*places} for names in each) for each in (MOVES, TURNS)):
        line = ", ".join(first) or "missing"
        raise ValueError(f"the first line is {line[:80]}, expected {EXPECTED}")
    return CsvLayout(tuple(first), places, delimiter)


def _content(cells: dict[str, tuple[str, ...]], layout: CsvLayout) -> Content:
    places = layout.places
    named = {key: cell for key, cell in places.items() if key != NAME}
    numbers = {key: _numbers(cell, cells.get(cell, ())) for key, cell in named.items()}
    poses = np.tile(np.eye(4), (len(next(iter(numbers.values()))), 1, 1))
    for key, (row, column) in ENTRIES.items():
        if key in numbers:
            poses[:, row, column] = numbers[key]
    if "qx" in places:
        poses = poses_of(poses[:, :3, 3], np.stack([numbers[key] for key in QUATERNION], axis=1))
    columns = {name: _column(cells[name]) for name in cells if name not in places.values()}
    columns |= {places[key]: numbers[key] for key in (LABEL, OPENING) if key in places}
    names = cells.get(places.get(NAME, ""), ())
    special = (places.get(LABEL, ""), places.get(OPENING, ""))
    format, frame = (GRASPA, "panda_tcp") if {*cells} >= OF_GRASPA else (FORMAT, FRAME)
    return Content(format, poses, columns, names, {}, {"layout": layout}, *special, frame)


def _numbers(name: str, cells: Sequence[str]) -> NDArray[np.float64]:
    """The numbers of a column; NaN of an empty cell."""
    numbers = np.empty(len(cells))
    for k, cell in enumerate(cells):
        try:
            numbers[k] = float(WORDS.get(cell.lower(), cell))
        except ValueError:
            said = f"{name} is {cell!r} in row {k + 1}"
            raise ValueError(f"{said}, expected a number, as 0.05") from None
    return numbers


def _column(cells: Sequence[str]) -> Column:
    """Whole numbers, numbers or text."""
    for kind in (np.int64, np.float64):
        try:
            return np.array(cells).astype(kind)
        except (ValueError, OverflowError):
            continue
    return np.array(cells)
