"""JSON files of GraspGen, alone or as the members of a tar file (a shard of a webdataset)."""

from __future__ import annotations

import json
import tarfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.grasps.content import Column, Content, as_numbers, column_of, nested, without_nan
from energymargin.grasps.files_hdf5 import one_object

FORMAT = "GraspGen"
LABEL = "object_in_gripper"
MEMBER = ".grasps.json"


def read(path: Path) -> Content:
    """The grasps of a JSON file."""
    return _content(path.read_bytes())


def read_shard(path: Path, where: Mapping[str, Any]) -> Content:
    """The grasps of one object of a tar file."""
    try:
        with tarfile.open(path, "r:") as file:
            members = {m.name.removesuffix(MEMBER): m for m in file if m.name.endswith(MEMBER)}
            name = one_object(list(members), where)
            member = file.extractfile(members[name])
            content = _content(member.read() if member else b"")
    except (tarfile.TarError, EOFError) as error:
        raise ValueError(f"is damaged or cut off, expected a whole tar file: {error}") from error
    content.columns["object"] = np.full(len(content.poses), name)
    return content


def write(path: Path, content: Content) -> None:
    """A file as GraspGen's; its success field has true and false."""
    columns = dict(content.columns)
    if LABEL in columns:
        columns[LABEL] = columns[LABEL].astype(float) >= 0.5
    whole = {**nested({name: _as_row(column) for name, column in columns.items()}, 0)}
    header = dict(content.header)
    of_grasps = header.pop("grasps", {})
    said = {name: _plain(value) for name, value in content.object.items()}
    text = {
        "object": said,
        **header,
        "grasps": {**of_grasps, "transforms": content.poses.tolist(), **whole},
    }
    with path.open("w", encoding="utf-8") as file:
        json.dump(text, file)


def _content(text: bytes) -> Content:
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is no whole JSON file: {error}") from error
    grasps = whole.get("grasps") if isinstance(whole, dict) else None
    if not isinstance(grasps, dict) or "transforms" not in grasps:
        raise ValueError(
            'is a JSON file of something else, expected GraspGen\'s: {"object": {"file": ..., '
            '"scale": ...}, "grasps": {"transforms": [...], "object_in_gripper": [...]}}'
        )
    poses = as_numbers("grasps.transforms", grasps.pop("transforms"), (-1, 4, 4))
    columns: dict[str, Column] = {}
    rest = _sort(grasps, len(poses), columns, "")
    header = {key: value for key, value in whole.items() if key != "grasps"} | {"grasps": rest}
    said = whole.get("object")
    return Content(
        *(FORMAT, poses, columns),
        object=said if isinstance(said, dict) else {},
        header=header,
        label=LABEL if LABEL in columns else "",
    )


def _sort(
    grasps: Mapping[str, Any], n: int, columns: dict[str, Column], prefix: str
) -> dict[str, Any]:
    """Puts what has n entries into `columns`; returns all else."""
    rest: dict[str, Any] = {}
    for key, value in grasps.items():
        if isinstance(value, list) and len(value) == n:
            columns[prefix + key] = column_of(value)
        elif isinstance(value, dict):
            inner = _sort(value, n, columns, f"{prefix}{key}/")
            rest |= {key: inner} if inner else {}
        else:
            rest[key] = value
    return rest


def _as_row(column: Column) -> Column:
    """A column as the one entry of a column of columns."""
    row = np.empty(1, object)
    row[0] = without_nan(column).tolist()
    return row


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
