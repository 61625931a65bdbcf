"""Tables of poses as text: a header that names the columns, or rows of 16 numbers of a matrix."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from energymargin.grasps.content import Column, Content, poses_of, quaternions_of, without_nan

FORMAT, GRASPA = "CSV", "GRASPA"
LABEL, OPENING, NAME = "label", "opening", "name"
OF_GRASPA = {"planner", "layout", "object", "grasped", "stability"}
"""Columns of the grasps of GRASPA-test, whose hand's frame is that of a Panda's tool."""

POSITION, QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
MATRIX = tuple(f"m{row}{column}" for row in range(4) for column in range(4))
SPELLINGS: dict[str, tuple[str, ...]] = {
    **{k: (k, f"p{k}", f"pos{k}", f"position{k}", f"t{k}", f"translation{k}") for k in POSITION},
    **{k: (k, f"quat{k[1]}", f"quaternion{k[1]}", f"orientation{k[1]}") for k in QUATERNION},
    **{k: (k, f"t{k[1:]}", f"r{k[1:]}") for k in MATRIX},
    OPENING: (OPENING, "gripperopening", "width", "gripperwidth", "graspwidth", "aperture"),
    LABEL: (LABEL, "success", "grasped", "held", "objectingripper", "confidence"),
    NAME: (NAME, "id", "graspid", "graspname"),
}
"""By what a column holds: its names in lower case without signs, the one that counts first."""

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
UNIT = re.compile(r"^(.+?)(?:[ _]*[\[(](mm|cm|m)[\])]|[ _](mm|cm|m))?$")
WORDS = {"true": "1", "yes": "1", "false": "0", "no": "0", "": "nan"}
EXPECTED = (
    "x, y, z [m] with qx, qy, qz, qw, or m00 to m33 of a matrix, and opening, label, name if there "
    "are any"
)


@dataclass(frozen=True)
class Layout:
    """Which column of a table is what."""

    cells: tuple[str, ...]
    """The header."""
    places: dict[str, int]
    """By a key of SPELLINGS: the number of its column."""
    units: dict[str, float]
    """The same, of lengths: the size of its unit [m]."""
    delimiter: str = ","
    header: bool = True


def read(path: Path) -> Content:
    """The rows of a table. Raises ValueError that names the line of a cell that is no number."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"is no text in UTF-8: {error}") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        raise ValueError(f"is empty, expected {EXPECTED}")
    delimiter = next((sign for sign in ",;\t" if sign in lines[0]), " ")
    text = "\n".join(lines if delimiter != " " else (" ".join(line.split()) for line in lines))
    rows = [[c.strip() for c in row] for row in csv.reader(io.StringIO(text), delimiter=delimiter)]
    layout = _layout(rows[0], delimiter)
    rows = rows[layout.header :]
    width = len(layout.cells)
    for number, row in enumerate(rows, 1):
        if len(row) != width:
            raise ValueError(f"row {number} has {len(row)} cells, expected {width}")
    table = dict(zip(layout.cells, zip(*rows, strict=True), strict=True)) if rows else {}
    if not table:
        raise ValueError("has a header and no rows, expected a grasp at least")
    return _content(table, layout)


def write(path: Path, content: Content) -> None:
    """A table with the columns that the content was read with, and then all others."""
    layout = content.header.get("layout") or _layout(
        [NAME, *POSITION, *QUATERNION, *([content.opening] * bool(content.opening))], ","
    )
    cells = [*layout.cells, *(name for name in content.columns if name not in layout.cells)]
    values = {
        **{key: content.poses[:, k, 3] for k, key in enumerate(POSITION)},
        **dict(zip(QUATERNION, quaternions_of(content.poses).T, strict=True)),
        **{key: content.poses[:, int(key[1]), int(key[2])] for key in MATRIX},
        NAME: np.array(content.names),
    }
    table: dict[str, Column] = dict(content.columns)
    for key, number in layout.places.items():
        column = table.get(layout.cells[number], values.get(key))
        if column is not None:
            size = layout.units.get(key, 1.0)
            table[layout.cells[number]] = column if size == 1.0 else column / size
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, delimiter=layout.delimiter, lineterminator="\n")
        if layout.header or len(cells) > len(layout.cells):
            writer.writerow(cells)
        blank = [_texts(table[cell]) for cell in cells]
        writer.writerows(zip(*blank, strict=True))


def _layout(first: Sequence[str], delimiter: str) -> Layout:
    """From the first line; raises ValueError if that is no header of poses, nor 16 numbers."""
    try:
        numbers = len([float(cell) for cell in first])
    except ValueError:
        numbers = 0
    if numbers == len(MATRIX):
        return Layout(MATRIX, {key: k for k, key in enumerate(MATRIX)}, {}, delimiter, False)
    if numbers:
        raise ValueError(
            f"has {numbers} numbers in its first line, which do not say what they are; give it a "
            "first line of names, as x,y,z,qx,qy,qz,qw, or x,y,z,qw,qx,qy,qz"
        )
    if len(set(first)) < len(first):
        raise ValueError(f"the header is {', '.join(first)}, expected names that differ")
    known: dict[str, list[int]] = {}
    sizes: dict[int, float] = {}
    for number, cell in enumerate(first):
        base, *unit = UNIT.match(cell).groups() if cell else ("", None, None)  # type: ignore[union-attr]
        sizes[number] = UNITS[unit[0] or unit[1] or "m"]
        plain = re.sub("[^a-z0-9]", "", base.lower()).removeprefix("pose")
        known.setdefault(plain, []).append(number)
    places: dict[str, int] = {}
    for key, spellings in SPELLINGS.items():
        found = [number for name in spellings for number in known.get(name, ())]
        if len(found) > 1 and key not in (LABEL, OPENING, NAME):
            twice = " and ".join(repr(first[number]) for number in found)
            raise ValueError(f"the header has {twice} for {key}, expected one of them")
        places |= {key: found[0]} if found else {}
    turned = [f"m{row}{column}" for row in range(3) for column in range(3)]
    moved = set(POSITION) <= set(places) or {"m03", "m13", "m23"} <= set(places)
    if not moved or not (set(QUATERNION) <= set(places) or set(turned) <= set(places)):
        raise ValueError(
            f"the header is {', '.join(first)}, expected {EXPECTED}; angles such as roll, pitch, "
            "yaw are not read"
        )
    lengths = (*POSITION, "m03", "m13", "m23", OPENING)
    units = {key: sizes[number] for key, number in places.items() if key in lengths}
    return Layout(tuple(first), places, units, delimiter)


def _content(table: dict[str, tuple[str, ...]], layout: Layout) -> Content:
    of_pose = {layout.cells[k] for key, k in layout.places.items() if key not in (LABEL, OPENING)}
    size = len(next(iter(table.values())))

    def numbers(key: str) -> NDArray[np.float64]:
        name = layout.cells[layout.places[key]]
        return _numbers(name, table[name]) * layout.units.get(key, 1.0)

    moved = POSITION if "x" in layout.places else ("m03", "m13", "m23")
    positions = np.stack([numbers(key) for key in moved], axis=1)
    if "qx" in layout.places:
        poses = poses_of(positions, np.stack([numbers(key) for key in QUATERNION], axis=1))
    else:
        poses = np.broadcast_to(np.eye(4), (size, 4, 4)).copy()
        for key in MATRIX:
            if key in layout.places:
                poses[:, int(key[1]), int(key[2])] = numbers(key)
        poses[:, :3, 3] = positions
    columns = {name: _column(cells) for name, cells in table.items() if name not in of_pose}
    named = {key: layout.cells[k] for key, k in layout.places.items() if key in (LABEL, OPENING)}
    for key, name in named.items():
        columns[name] = numbers(key)
    return Content(
        GRASPA if set(layout.cells) >= OF_GRASPA else FORMAT,
        poses,
        columns,
        table[layout.cells[layout.places[NAME]]] if NAME in layout.places else (),
        header={"layout": layout},
        label=named.get(LABEL, ""),
        opening=named.get(OPENING, ""),
    )


def _numbers(name: str, cells: Sequence[str]) -> NDArray[np.float64]:
    """The numbers of a column; NaN of an empty cell."""
    try:
        return np.array(cells).astype(float)
    except ValueError:
        texts = [WORDS.get(cell.lower(), cell) for cell in cells]
    for number, text in enumerate(texts, 1):
        try:
            float(text)
        except ValueError:
            raise ValueError(f"{name} is {text!r} in row {number}, expected a number") from None
    return np.array(texts).astype(float)


def _column(cells: Sequence[str]) -> Column:
    """Whole numbers, numbers or text."""
    texts = np.array(cells)
    for kind in (np.int64, np.float64):
        try:
            return np.asarray(texts.astype(kind))
        except (ValueError, OverflowError):
            continue
    return texts


def _texts(column: Column) -> list[object]:
    """Cells, nothing for NaN."""
    return ["" if value is None else value for value in without_nan(column).tolist()]
