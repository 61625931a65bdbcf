"""Grasps of an object: where the hand is, how far it is open, and what became of each.

`Content` is what a file of them says, in its own frames and units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_shape, shown
from energymargin.base.reprs import Record

Column = NDArray[Any]

FARTHEST = 5.0  # m from the object's frame, in the median; a hand is farther in another unit alone
WIDEST = 0.5  # m; the widest parallel grippers open by 0.3 m
ROUNDED = 2e-3  # error of a rotation or the norm of a quaternion that rounding to 3 digits makes
UNKNOWN = np.empty(0)
LAST_ROW = (0.0, 0.0, 0.0, 1.0)  # of a pose


@dataclass(frozen=True)
class ObjectFacts:
    """What a file says of its object. None: nothing."""

    mesh: Path | None = None
    """Its mesh file; as the file has it if there is none beside the file of grasps."""
    scale: float = 1.0
    """What makes metres of the mesh's numbers."""
    mass: float | None = None
    """[kg]"""
    com: tuple[float, ...] | None = None
    """Centre of mass in the object's frame [m], shape (3,)."""
    inertia: tuple[tuple[float, ...], ...] | None = None
    """As the file has it, shape (3, 3) [kg m^2]; that of ACRONYM is about the centre of mass."""
    friction: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Source(Record):
    """The file that grasps are from: what `write` needs to make such a file again."""

    path: Path
    format: str
    frame: NDArray[np.float64]
    """The grasp frame in the file's frame of the hand, shape (4, 4)."""
    scale: float = 1.0
    """What makes metres of the file's lengths."""
    label: str = ""
    """The column of the labels; "" if there is none."""
    opening: str = ""
    """The column of the openings; "" if there is none."""
    header: Mapping[str, Any] = field(default_factory=dict)
    """What is not of a row."""


@dataclass(frozen=True, eq=False, repr=False)
class GraspSet(Record):
    """n grasps of a hand with two fingers.

    Its length is n; a number, a mask, numbers or a slice in [] give a GraspSet of those rows.
    Raises ValueError that names the first row that is no grasp.
    """

    poses: Floats
    """The grasp frame in the object's frame, shape (n, 4, 4) [m]. Its origin is midway between the
    centres of the fingertips' pads, z is the approach, x the way in which the fingers open."""
    openings: NDArray[np.float64] = field(default_factory=UNKNOWN.copy)
    """Between the pads before the hand closes [m], shape (n,); NaN where it is not known."""
    labels: NDArray[np.float64] = field(default_factory=UNKNOWN.copy)
    """0 (lost) to 1 (held) as recorded, shape (n,); NaN where it is not known."""
    names: tuple[str, ...] = ()
    """Of the rows; their numbers in the file if it has no names."""
    object: ObjectFacts | None = None
    columns: dict[str, Column] = field(default_factory=dict)
    """What else a row has, by name, each of shape (n,)."""
    object_poses: Floats = field(default_factory=UNKNOWN.copy)
    """The object's frame in the world's, as a board's, shape (n, 4, 4); the identity unless
    `read` was given `object`."""
    source: Source | None = field(default=None, repr=False)
    """None of grasps that are from no file."""

    def __post_init__(self) -> None:
        """Fills in what is not known, and checks every row."""
        n = len(self.poses)
        unknown: dict[str, Any] = {"openings": np.nan, "labels": np.nan}
        for name, value in {"poses": (), "object_poses": np.eye(4), **unknown}.items():
            array = np.asarray(getattr(self, name), float)
            shape = (n, 4, 4) if name.endswith("poses") else (n,)
            array = np.broadcast_to(value, shape) if name != "poses" and not array.size else array
            check_shape(name, array, shape)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "names", self.names or tuple(map(str, range(n))))
        for name, column in {"names": self.names, **self.columns}.items():
            if len(column) != n:
                raise ValueError(f"{name} has {len(column)} entries, expected one for each of {n}")
        check_poses("the pose", self.poses, self.names)
        check_poses("the pose of the object", self.object_poses, self.names)
        way = "lengths are in m: a file in mm needs scale=0.001"
        far = float(np.median(np.linalg.norm(self.poses[:, :3, 3], axis=1)))
        if far > FARTHEST:
            said = f"the hand is {far:.4g} m from the object's frame in the median"
            way = f"{way}; poses in another frame need object="
            raise ValueError(f"{said}, expected at most {FARTHEST:g} m; {way}")
        ranges = {"the opening": (self.openings, WIDEST, f"0 to {WIDEST:g} m; {way}")}
        ranges["the label"] = (self.labels, 1.0, "0 (lost) to 1 (held)")
        for what, (column, most, expected) in ranges.items():
            _require(what, ~((column < 0) | (column > most)), column, self.names, expected)

    def __len__(self) -> int:
        """n."""
        return len(self.poses)

    def __getitem__(self, rows: Any) -> GraspSet:
        """The grasps of a number, a mask, numbers or a slice."""
        chosen = np.atleast_1d(np.arange(len(self))[rows])
        arrays = ("poses", "openings", "labels", "object_poses")
        parts: dict[str, Any] = {name: getattr(self, name)[chosen] for name in arrays}
        parts["columns"] = {name: column[chosen] for name, column in self.columns.items()}
        return replace(self, names=tuple(self.names[k] for k in chosen), **parts)


def check_poses(what: str, poses: Floats, names: Sequence[str]) -> None:
    """Raises ValueError that names the first row whose matrix is no pose."""
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise ValueError(f"{what}s have the shape {poses.shape}, expected (n, 4, 4)")
    if len(poses) == 0:
        raise ValueError("there are no grasps, expected one at least")
    sums = poses.sum((1, 2))
    _require(what, np.isfinite(sums), sums, names, "finite numbers")
    last = np.abs(poses[:, 3] - LAST_ROW).max(1) <= ROUNDED
    transposed = np.abs(poses[:, :3, 3]).max() == 0 and bool(last.sum() < len(last))
    way = "; the matrices are transposed, as row vectors need them" if transposed else ""
    _require(f"the last row of {what}", last, poses[:, 3], names, f"0, 0, 0, 1{way}")
    turns, what = poses[:, :3, :3], f"the determinant of {what}"
    sizes, way = np.linalg.det(turns), "a rotation, whose determinant is 1"
    left_handed = f"{way}: its frame is left-handed, turn one axis around"
    _require(what, np.abs(sizes + 1) > 0.01, sizes, names, left_handed)
    right = np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max((1, 2)) <= ROUNDED
    skew = f"{way}: its axes are no unit vectors at right angles; a scale belongs to scale="
    _require(what, right, sizes, names, skew)


def _require(what: str, right: Any, values: Any, names: Sequence[str], expected: str) -> None:
    """Raises ValueError with the first row that is not right, and how many are not."""
    if not right.all():
        k = int(np.argmin(right))
        others = f" (as are {(~right).sum() - 1} more)" if (~right).sum() > 1 else ""
        value = shown(values[k].tolist())
        raise ValueError(f"{what} of grasp {names[k]!r} is {value}{others}, expected {expected}")


@dataclass(frozen=True, eq=False)
class Content:
    """n rows, and what is not of a row."""

    format: str
    poses: Floats
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
