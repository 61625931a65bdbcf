"""Reads and writes files of grasps; their format is known by what is in them."""

from __future__ import annotations

import os
import re
import tarfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.checks import numbers_of, positive_number, shown
from energymargin.grasps import files_csv, files_hdf5, files_json, files_yaml
from energymargin.grasps.content import Column, Content
from energymargin.grasps.frames import grasp_frame
from energymargin.grasps.grasp_set import UNKNOWN, GraspSet, Source, check_poses
from energymargin.grasps.objects import facts_of, object_poses, said_of
from energymargin.replacing import replaced

FORMATS = (
    "ACRONYM's or GraspGen's HDF5, GraspGen's JSON or a tar file of it, isaac_grasp YAML, or a "
    f"table (CSV) with {files_csv.EXPECTED}"
)
OF_FORMAT = {
    files_hdf5.ACRONYM: "franka_panda",
    files_csv.GRASPA: "panda_tcp",
    files_csv.FORMAT: "grasp",
}
"""The frame of the hand in files that have always the same."""

WRITERS: dict[str, tuple[Any, str, str]] = {
    **dict.fromkeys((".h5", ".hdf5"), (files_hdf5, files_hdf5.ACRONYM, files_hdf5.LABEL)),
    ".json": (files_json, files_json.FORMAT, files_json.LABEL),
    **dict.fromkeys((".yaml", ".yml"), (files_yaml, files_yaml.FORMAT, files_yaml.LABEL)),
    **dict.fromkeys((".csv", ".txt", ".tsv"), (files_csv, files_csv.FORMAT, files_csv.LABEL)),
}
"""By the end of a file's name: its module, its format, and its column of labels."""
REPLACED = (files_json.FORMAT, files_yaml.FORMAT)
"""Formats whose label becomes the score, as their tools read no other."""
OURS, SCORE, RECORDED = "energymargin/", "probability", "recorded"


def read(
    path: str | os.PathLike[str],
    *,
    frame: ArrayLike | str | None = None,
    object: ArrayLike | str | os.PathLike[str] | None = None,
    where: Mapping[str, Any] | None = None,
    scale: float = 1.0,
) -> GraspSet:
    """The grasps in a file of ACRONYM, GraspGen, GRASPA or Isaac Sim, or in a table of poses.

    `docs/formats/grasps.md` has the formats and their frames. An isaac_grasp file needs the extra
    [grasps].

    Args:
        path: the file; what is in it tells the format.
        frame: the grasp frame (midway between the pads, z the approach, x the way the fingers
            open) in the file's frame of the hand: a name of `FRAMES`, a distance along z [m], or a
            pose. None where the format has always the same; GraspGen and isaac_grasp have not.
        object: the pose of the object in the frame of the file's poses, if that is a board's or
            the world's; or a CSV file of poses with columns that tell whose they are, as
            layout,object. None: the file's poses are in the object's frame.
        where: values, or lists of values, by column: other rows are left out. Chooses the object
            of a file of several.
        scale: what makes metres of the file's lengths.

    A pose is a matrix (4, 4), or x, y, z [m] and a unit quaternion x, y, z, w.

    Raises FileNotFoundError, ImportError without the extra, and ValueError that names the file and
    the row or argument that is wrong.
    """
    path, where = Path(path), dict(where or {})
    if not path.is_file():
        raise FileNotFoundError(f"path is {str(path)!r}, and there is no such file")
    positive_number("scale", scale)
    try:
        content = _chosen(_content(path, where), where)
        usual = OF_FORMAT.get(content.format)
        hand = grasp_frame(frame, content.format, usual, content.header)
        stands, facts = object_poses(object, content)
        poses = _scaled(content.poses, scale)
        check_poses("the pose", poses, content.names)
        labels, openings = (content.columns.get(n) for n in (content.label, content.opening))
        return GraspSet(
            poses=np.linalg.inv(stands) @ poses @ hand if object is not None else poses @ hand,
            openings=UNKNOWN if openings is None else _floats(content.opening, openings) * scale,
            labels=UNKNOWN if labels is None else _floats(content.label, labels),
            names=content.names,
            object=facts_of(path, facts),
            columns={
                name: column
                for name, column in content.columns.items()
                if name not in (content.label, content.opening)
            },
            object_poses=stands,
            source=Source(
                *(path, content.format, hand, float(scale)),
                *(content.label, content.opening, content.header),
            ),
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def write(
    path: str | os.PathLike[str],
    grasps: GraspSet,
    scores: Mapping[str, ArrayLike] | ArrayLike | None = None,
    *,
    frame: ArrayLike | str | None = None,
    overwrite: bool = False,
) -> None:
    """Writes grasps, with scores, as ACRONYM (.h5), GraspGen (.json), isaac_grasp (.yaml) or CSV.

    A file of the format that the grasps are from has all of that file again. The scores are added:
    in ACRONYM as grasps/qualities/energymargin/NAME, in the others as energymargin/NAME of each
    grasp. GraspGen's object_in_gripper (at least a half) and the confidence of isaac_grasp become
    "probability" or else the first of the scores; labels of the file are then
    energymargin/recorded.

    Args:
        path: the end of its name tells the format.
        grasps: the grasps.
        scores: values of shape (n,) by name, or those of "probability" alone.
        frame: as that of `read`; None: the frame that the grasps were read with, or that of the
            format.
        overwrite: whether a file that is there is replaced.

    Raises ValueError that names the argument, ImportError without the extra [grasps] for YAML, and
    OSError if the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise ValueError(f"path is {str(path)!r}, expected a name with {' or '.join(WRITERS)}")
    if os.path.lexists(path) and not overwrite:
        raise ValueError(f"{path} exists: choose another path, or give overwrite=True")
    module, format, label = WRITERS[path.suffix.lower()]
    source = grasps.source
    same = source is not None and module is _module(source.format)
    kept = source if same else None
    label = (kept and kept.label) or label
    opening = (kept and kept.opening) or ("" if np.isnan(grasps.openings).all() else "opening")
    poses, scale = grasps.poses, 1.0
    if kept:
        poses, scale = grasps.object_poses @ poses, 1.0 / kept.scale
    usual = OF_FORMAT.get(format)
    hand = kept.frame if kept and frame is None else grasp_frame(frame, format, usual, {})
    columns = dict(grasps.columns)
    if opening:
        columns[opening] = grasps.openings * scale
    if not np.isnan(grasps.labels).all():
        columns[label] = _whole(grasps.labels)
    if scores is not None:
        columns |= _scores(scores, grasps, columns, label if format in REPLACED else "")
    facts = {} if kept or grasps.object is None else said_of(grasps.object)
    content = Content(
        *(format, _scaled(poses @ np.linalg.inv(hand), scale), columns, grasps.names, facts),
        header=kept.header if kept else {},
        label=label,
        opening=opening,
    )
    with replaced(path) as file:
        module.write(file, content)


def _content(path: Path, where: Mapping[str, Any]) -> Content:
    """The content of a file of any format."""
    with path.open("rb") as file:
        start = file.read(65536)
    if start.startswith(b"\x89HDF\r\n\x1a\n"):
        return files_hdf5.read(path, where)
    if tarfile.is_tarfile(path):
        return files_json.read_shard(path, where)
    if start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[")):
        return files_json.read(path)
    if re.search(rb"^(format|grasps)\s*:", start, re.MULTILINE):
        return files_yaml.read(path)
    try:
        return files_csv.read(path)
    except ValueError as error:
        raise ValueError(f"{error}. Files that are read: {FORMATS}") from error


def _module(format: str) -> Any:
    """The module that writes a format; None of one that is read alone."""
    format = files_csv.FORMAT if format == files_csv.GRASPA else format
    return next((module for module, known, _ in WRITERS.values() if known == format), None)


def _chosen(content: Content, where: Mapping[str, Any]) -> Content:
    """The rows with these values."""
    n = len(content.poses)
    names = content.names or tuple(map(str, range(n)))
    columns = {**content.columns, "name": np.array(names)}
    rows = np.ones(n, bool)
    for key, value in where.items():
        if key not in columns:
            raise ValueError(f"where has {key!r}, expected a column: {', '.join(columns)}")
        column = columns[key]
        found = np.isin(column.astype(str), np.atleast_1d(np.asarray(value)).astype(str))
        if not found.any():
            some = list(dict.fromkeys(column.tolist()))[:8]
            raise ValueError(f"where has {key!r}: {value!r}, and no row has; it is {some} there")
        rows &= found
    if where and not rows.any():
        raise ValueError(f"where is {dict(where)!r}, and no row has all of that")
    return Content(
        content.format,
        content.poses[rows],
        {name: column[rows] for name, column in content.columns.items()},
        tuple(name for name, row in zip(names, rows, strict=True) if row),
        *(content.object, content.header, content.label, content.opening),
    )


def _scores(
    scores: Any, grasps: GraspSet, columns: Mapping[str, Column], label: str
) -> dict[str, Column]:
    """Columns of scores; with a label, that is the first of them."""
    given = scores if isinstance(scores, Mapping) else {SCORE: scores}
    n = len(grasps)
    values = {
        name: numbers_of(f"scores {name!r}", value, f"finite numbers of shape ({n},)", (n,))
        for name, value in given.items()
    }
    added: dict[str, Column] = {f"{OURS}{name}": value for name, value in values.items()}
    if label and values:
        if label in columns:
            added[f"{OURS}{RECORDED}"] = columns.get(f"{OURS}{RECORDED}", columns[label])
        main = values.get(SCORE, next(iter(values.values())))
        if ((main < 0) | (main > 1)).any():
            raise ValueError(f"scores are {shown(main.tolist())}, expected 0 to 1 for {label}")
        added[label] = main
    return added


def _scaled(poses: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    scaled = poses.copy()
    scaled[:, :3, 3] *= scale
    return scaled


def _floats(name: str, column: Column) -> NDArray[np.float64]:
    try:
        return np.asarray(column, float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is {shown(column.tolist())}, expected numbers") from error


def _whole(labels: NDArray[np.float64]) -> Column:
    """As whole numbers if all are."""
    return labels.astype(np.int64) if np.isin(labels, (0.0, 1.0)).all() else labels
