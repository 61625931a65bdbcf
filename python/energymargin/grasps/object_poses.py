"""The object of a file of grasps: where it stands, and what is said of it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.checks import numbers_of, positive_number
from energymargin.grasps import files_csv
from energymargin.grasps.content import Content
from energymargin.grasps.frames import pose
from energymargin.grasps.grasp_set import ObjectFacts, Poses


def object_poses(given: Any, content: Content) -> tuple[Poses, Mapping[str, Any]]:
    """The object's pose in the frame of each row, shape (n, 4, 4), and what is said of it.

    `given`: None, a pose, or a CSV file of poses, whose rows have the values of the grasps' rows in
    the columns of both. Raises ValueError.
    """
    n = len(content.poses)
    if given is None and content.format == files_csv.GRASPA:
        raise ValueError(
            "object is None, and GRASPA has poses in the frame of a board, expected the object's "
            "pose there, or a CSV file of them with the columns layout and object"
        )
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
