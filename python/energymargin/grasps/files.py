"""Reads and writes files of grasps; their format is known by what is in them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type, numbers_of, positive_number, shown
from energymargin.base.replacing import replaced
from energymargin.grasps import files_csv, files_hdf5, files_json, files_yaml, grasp_set
from energymargin.grasps.frames import grasp_frame, pose
from energymargin.grasps.grasp_set import Column, Content, GraspSet, ObjectFacts, Source

WRITERS: dict[str, Any] = {".h5": files_hdf5, ".hdf5": files_hdf5, ".json": files_json}
WRITERS |= {".yaml": files_yaml, ".yml": files_yaml}
WRITERS |= {".csv": files_csv, ".txt": files_csv, ".tsv": files_csv}
"""By the end of a file's name."""
SUFFIXES = tuple(WRITERS)
"""Ends of names that `write` takes."""
UNREAD = {
    b"\x93NUMPY": "a file of numpy",
    b"PK\x03\x04": "a ZIP file, as numpy's .npz or a spreadsheet",
    b"\x80": "a pickle, which can run code",
    b"PAR1": "a Parquet file",
    b"SQLite format 3": "a database of SQLite",
    b"MATLAB 5.0": "a file of Matlab",
}
"""By their first bytes, formats that are named."""
PACKED = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ")
"""First bytes of files of gzip, bzip2 and xz."""
YAML = re.compile(rb"(\s|#.*\n|---)*(- +[\w\"']+ *:|[\w\"']+ *:\s*[\w\"'\[{-])")
"""The start of a YAML file: an entry of a list or of a mapping."""
OURS, SCORE, RECORDED = "energymargin/", "probability", "energymargin/recorded"


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
            open) in the file's frame of the hand: a name of `em.grasps.FRAMES`, a distance along z
            [m], or a pose. None where a format has always the same; GraspGen's and isaac_grasp
            have not.
        object: the pose of the object in the frame of the file's poses, if that is a board's or
            the world's; or a CSV file of poses with columns that tell whose they are, as
            layout,object. None: the file's poses are in the object's frame.
        where: values, or lists of values, by column: other rows are left out.
        scale: what makes metres of the file's lengths.

    A pose is a matrix (4, 4), or x, y, z [m] and a unit quaternion x, y, z, w.

    Raises FileNotFoundError, ImportError without the extra, and ValueError that names the file and
    the row or argument that is wrong.
    """
    path, where = Path(path), {} if where is None else where
    check_type("where", where, Mapping, 'values by column, as {"object": "mug"}')
    with _errors_of(path):
        return _grasps(path, _chosen(_content(path), where), frame, object, scale)


def read_poses(path: str | os.PathLike[str]) -> dict[str, Floats]:
    """Poses (4, 4) of anything, however far away, by name, from a file as of `read`, whose errors
    it raises; and ValueError on a name that is there twice."""
    path = Path(path)
    with _errors_of(path):
        rows = _chosen(_content(path), {})
        grasp_set.check_poses("the pose", rows.poses, rows.names)
        found = dict(zip(rows.names, rows.poses, strict=True))
        if len(found) < len(rows.names):
            raise ValueError("a name is there twice, expected different names")
        return found


@contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    """Errors name the file, which has to be there."""
    if not path.is_file():
        raise FileNotFoundError(f"path is {str(path)!r}, and there is no such file")
    try:
        yield
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

    In the format that the grasps are from, the file has all that theirs had. Scores are added as
    energymargin/NAME: in ACRONYM's beside flex/, else in each grasp or column. GraspGen's
    object_in_gripper (at least a half) and the confidence of isaac_grasp become "probability", or
    else the first of the scores; what they were is then energymargin/recorded.

    Args:
        path: the end of its name tells the format.
        grasps: the grasps.
        scores: values of shape (n,) by name, or those of "probability" alone.
        frame: as that of `read`. None: that which the grasps were read with in this format, or
            that of the format.
        overwrite: whether a file that is there is replaced.

    Raises ValueError that names the argument, ImportError without the extra [grasps] for YAML, and
    OSError if the file cannot be written.
    """
    path = Path(path)
    module = WRITERS.get(path.suffix.lower())
    if module is None:
        raise ValueError(f"path is {str(path)!r}, expected a name with {' or '.join(WRITERS)}")
    if os.path.lexists(path) and not overwrite:
        raise ValueError(f"{path} exists: choose another path, or give overwrite=True")
    source = grasps.source
    poses, said = grasps.poses, said_of(grasps.object)
    if source and source.format in (module.FORMAT, getattr(module, "GRASPA", None)):
        poses, said = grasps.object_poses @ poses, {}  # which is in the header
    else:
        hand = grasp_frame(module.FRAME if frame is None else frame, module.FORMAT)
        source = Source(path, module.FORMAT, hand)
    hand = source.frame if frame is None else grasp_frame(frame, module.FORMAT)
    columns = _columns(grasps, source, source.label or module.LABEL)
    columns |= _scores(scores, columns, len(grasps), module)
    poses = _scaled(poses @ np.linalg.inv(hand), 1.0 / source.scale)
    content = Content(source.format, poses, columns, grasps.names, said, source.header)
    with replaced(path) as file:
        module.write(file, content)


def _content(path: Path) -> Content:
    """The content of a file of any format."""
    with path.open("rb") as file:
        start = file.read(65536)
    if start.startswith(b"\x89HDF\r\n\x1a\n"):
        return files_hdf5.read(path)
    for magic, name in UNREAD.items():
        if start.startswith(magic):
            raise ValueError(f"is {name}, which is not read: {files_yaml.OF_POSES}")
    if start.startswith(PACKED) or start[257:262] == b"ustar" or path.suffix == ".tar":
        raise ValueError("is no text; if it is a packed or a tar file, unpack it (tar -xf)")
    if start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[")):
        return files_json.read(path)
    if re.search(rb"^(format|grasps)\s*:", start, re.MULTILINE):
        return files_yaml.read(path)
    if YAML.match(start):
        raise ValueError(files_yaml.OTHER)
    return files_csv.read(path)


def _chosen(content: Content, where: Mapping[str, Any]) -> Content:
    """The rows with these values, with names."""
    names = np.array(content.names or [str(k) for k in range(len(content.poses))], str)
    columns = {"name": names, **content.columns}
    rows = np.ones(len(names), bool)
    for key, value in where.items():
        if key not in columns:
            raise ValueError(f"where has {key!r}, expected a column: {', '.join(columns)}")
        wanted, column = np.atleast_1d(np.asarray(value)), columns[key]
        if {wanted.dtype.kind, column.dtype.kind} - set("biuf"):
            wanted, column = wanted.astype(str), column.astype(str)
        before, rows = rows, rows & np.isin(column, wanted)
        if not rows.any():
            some = f"it is one of {shown([*dict.fromkeys(column[before].tolist())])}"
            raise ValueError(f"where has {value!r} for {key!r}, and no such row; {some}")
    columns = {name: column[rows] for name, column in content.columns.items()}
    chosen = tuple(names[rows].tolist())
    return replace(content, poses=content.poses[rows], columns=columns, names=chosen)


def _grasps(path: Path, content: Content, frame: Any, object: Any, scale: float) -> GraspSet:
    """The content in the frames and units of a GraspSet."""
    positive_number("scale", scale)
    usual = content.frame if frame is None else frame
    told = content.header.get("gripper_frame", content.header.get("gripper_frame_link"))
    hand = grasp_frame(usual, content.format, told)
    stands, said = object_poses(object, content)
    grasp_set.check_poses("the pose", content.poses, content.names)
    columns = dict(content.columns)
    names, none = (content.label, content.opening), grasp_set.UNKNOWN
    labels, openings = (numbers_of(k, columns.pop(k)) if k else none for k in names)
    poses = np.linalg.inv(stands) @ _scaled(content.poses, scale) @ hand
    source = Source(path, content.format, hand, scale, *names, content.header)
    facts = facts_of(path, said)
    return GraspSet(poses, openings * scale, labels, content.names, facts, columns, stands, source)


def _columns(grasps: GraspSet, source: Source, label: str) -> dict[str, Column]:
    """All columns of a file, without new ones of which nothing is known."""
    labels = grasps.labels
    if np.isin(labels, (0.0, 1.0)).all():
        labels = labels.astype(np.int64)
    special = {source.opening or "opening": grasps.openings / source.scale, label: labels}
    had = (source.label, source.opening)
    known = {k: v for k, v in special.items() if k in had or not np.isnan(v).all()}
    return grasps.columns | known


def _scores(scores: Any, columns: Mapping[str, Column], n: int, module: Any) -> dict[str, Column]:
    """Columns of scores. One takes the place of the label where a format's tools read no other."""
    given = {} if scores is None else scores if isinstance(scores, Mapping) else {SCORE: scores}
    expected = f"finite numbers of shape ({n},)"
    values = {k: numbers_of(f"scores {k!r}", v, expected, (n,)) for k, v in given.items()}
    added: dict[str, Column] = {f"{OURS}{name}": value for name, value in values.items()}
    if values and module in (files_json, files_yaml):
        name = SCORE if SCORE in values else next(iter(values))
        if values[name].min() < 0 or values[name].max() > 1:
            wrong = shown(values[name].tolist())
            raise ValueError(f"scores {name!r} is {wrong}, expected 0 to 1 as {module.LABEL}")
        if module.LABEL in columns:
            added[RECORDED] = columns.get(RECORDED, columns[module.LABEL])
        added[module.LABEL] = values[name]
    return added


def _scaled(poses: Floats, scale: float) -> Floats:
    return np.concatenate([poses[..., :3], poses[..., 3:] * [[scale], [scale], [scale], [1.0]]], 2)


# The object of a file: where it stands, and what is said of it.


def object_poses(given: Any, content: Content) -> tuple[Floats, Mapping[str, Any]]:
    """The object's pose in the frame of each row, shape (n, 4, 4), and what is said of it.

    `given`: None, a pose, or a CSV file of poses, whose rows have the values of the grasps' rows in
    the columns of both. Raises ValueError.
    """
    n = len(content.poses)
    if given is None and content.format == files_csv.GRASPA:
        way = "expected the object's pose there, or a CSV file of them with the columns layout and"
        none = "object is None, and GRASPA has poses in the frame of a board"
        raise ValueError(f"{none}, {way} object")
    if not isinstance(given, (str, os.PathLike)):
        matrix = np.eye(4) if given is None else pose("object", given)
        return np.broadcast_to(matrix, (n, 4, 4)), content.object
    path = Path(given)
    if not path.is_file():
        raise ValueError(f"object is {str(given)!r}, and there is no such file")
    table = files_csv.read(path)
    shared = [name for name in table.columns if name in content.columns]
    keys = [_keys(each, shared) for each in (table, content)]
    rows = {key: k for k, key in enumerate(keys[0])}
    among = f"among {', '.join(shared) or 'no columns'}, which both files have"
    if len(rows) < len(table.poses):
        raise ValueError(f"object is {str(given)!r}, where two rows are alike {among}")
    if missing := [key for key in keys[1] if key not in rows]:
        raise ValueError(f"object is {str(given)!r}, where no row has {missing[0]} {among}")
    places = [rows[key] for key in keys[1]]
    meshes = {table.columns["mesh"][k] for k in places} if "mesh" in table.columns else set()
    said = {"file": _mesh(path, Path(meshes.pop()))} if len(meshes) == 1 else content.object
    return table.poses[places], said


def facts_of(path: Path, said: Mapping[str, Any]) -> ObjectFacts | None:
    """What a file says of its object; None if that is nothing. Raises ValueError."""
    facts: dict[str, Any] = {}
    for name in ("scale", "mass", "friction"):
        if said.get(name) is not None:
            facts[name] = float(positive_number(f"object {name}", said[name]))
    if said.get("com") is not None:
        facts["com"] = tuple(numbers_of("object com", said["com"], "3 numbers", (3,)).tolist())
    if said.get("inertia") is not None:
        rows = numbers_of("object inertia", said["inertia"], "numbers of shape (3, 3)", (3, 3))
        facts["inertia"] = tuple(map(tuple, rows.tolist()))
    if said.get("file"):
        facts["mesh"] = _mesh(path, Path(said["file"]))
    return ObjectFacts(**facts) if facts else None


def said_of(facts: ObjectFacts | None) -> dict[str, Any]:
    """What `facts_of` reads."""
    known = {name: value for name, value in vars(facts).items() if value} if facts else {}
    return {"file" if k == "mesh" else k: str(v) if k == "mesh" else v for k, v in known.items()}


def _keys(content: Content, names: list[str]) -> list[tuple[str, ...]]:
    columns = [content.columns[name].astype(str).tolist() for name in names]
    return [tuple(column[k] for column in columns) for k in range(len(content.poses))]


def _mesh(path: Path, mesh: Path) -> Path:
    """Where a mesh is: as told from the folder of the grasps or one above, or beside them by its
    name or by theirs."""
    folders = [path.parent, *path.resolve().parents[1:4]]
    beside = [path.parent / mesh.name, path.parent / "meshes" / mesh.name]
    tried = [*(folder / mesh for folder in folders), *beside, path.with_suffix(mesh.suffix)]
    return next((each for each in tried if each.is_file()), mesh)
