"""The object of a file of grasps: where it stands, and what is said of it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.checks import numbers_of, positive_number
from energymargin.grasps import files_csv
from energymargin.grasps.content import Column, Content
from energymargin.grasps.frames import pose
from energymargin.grasps.grasp_set import ObjectFacts


def object_poses(given: Any, content: Content) -> tuple[NDArray[np.float64], Mapping[str, Any]]:
    """The object's pose in the frame of each row, shape (n, 4, 4), and what is said of it."""
    n = len(content.poses)
    if given is None:
        return np.broadcast_to(np.eye(4), (n, 4, 4)), content.object
    if not isinstance(given, (str, os.PathLike)):
        return np.broadcast_to(pose("object", given), (n, 4, 4)), content.object
    path = Path(given)
    if not path.is_file():
        raise FileNotFoundError(f"object is {str(given)!r}, and there is no such file")
    table = files_csv.read(path)
    keys = [name for name in table.columns if name in content.columns]
    rows = {key: k for k, key in enumerate(_keys(table.columns, keys, len(table.poses)))}
    if len(rows) < len(table.poses):
        raise ValueError(
            f"object is {str(given)!r}, whose rows are not told apart by {', '.join(keys) or 'any'}"
            f" column of both files; expected one row for each object"
        )
    wanted = _keys(content.columns, keys, n)
    missing = next((key for key in wanted if key not in rows), None)
    if missing is not None:
        raise ValueError(
            f"object is {str(given)!r}, which has no row of {', '.join(keys)} {missing}"
        )
    places = np.array([rows[key] for key in wanted], int)
    meshes = (
        {str(path.parent / str(table.columns["mesh"][k])) for k in set(places.tolist())}
        if "mesh" in table.columns
        else set()
    )
    return table.poses[places], {"file": meshes.pop()} if len(meshes) == 1 else content.object


def _keys(columns: Mapping[str, Column], names: list[str], n: int) -> list[tuple[str, ...]]:
    return (
        list(zip(*(columns[name].astype(str).tolist() for name in names), strict=True)) or [()] * n
    )


def facts_of(path: Path, said: Mapping[str, Any]) -> ObjectFacts | None:
    """What a file says of its object; None if that is nothing. Raises ValueError."""
    facts: dict[str, Any] = {}
    for key in ("scale", "mass", "friction"):
        if said.get(key) is not None:
            number = numbers_of(f"object {key}", said[key], "a number", ())
            facts[key] = positive_number(f"object {key}", number.item())
    if said.get("com") is not None:
        facts["com"] = tuple(numbers_of("object com", said["com"], "3 numbers", (3,)).tolist())
    if said.get("inertia") is not None:
        rows = numbers_of("object inertia", said["inertia"], "numbers (3, 3)", (3, 3)).tolist()
        facts["inertia"] = tuple(map(tuple, rows))
    if said.get("file"):
        facts["mesh"] = _mesh(path, Path(str(said["file"])))
    return ObjectFacts(**facts) if facts else None


def said_of(facts: ObjectFacts) -> dict[str, Any]:
    """What `facts_of` reads."""
    names = ("scale", "mass", "com", "inertia", "friction")
    said = {name: getattr(facts, name) for name in names if getattr(facts, name) is not None}
    return said | ({"file": str(facts.mesh)} if facts.mesh else {})


def _mesh(path: Path, mesh: Path) -> Path:
    """Where a mesh is: as told from the folder of the grasps or one above, or beside them by its
    name or by theirs."""
    folders = [path.parent, *path.resolve().parents[1:4]]
    beside = [path.parent / mesh.name, path.parent / "meshes" / mesh.name]
    tried = [*(folder / mesh for folder in folders), *beside, path.with_suffix(mesh.suffix)]
    return next((each for each in tried if each.is_file()), mesh)
