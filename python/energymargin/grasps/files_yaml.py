"""YAML files of the format isaac_grasp 1.0."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from energymargin.checks import shown
from energymargin.errors import needs_extra
from energymargin.grasps.content import (
    Content,
    as_numbers,
    column_of,
    nested,
    poses_of,
    quaternions_of,
    without_nan,
)

FORMAT = "isaac_grasp"
LABEL = "confidence"
MOST_NODES = 20_000_000  # of a file with its aliases written out: a bomb has more


def read(path: Path) -> Content:
    """The grasps of a file. Raises ValueError that names the grasp that is wrong."""
    with needs_extra("an isaac_grasp file", "grasps"):
        import yaml
    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        whole = yaml.load(path.read_bytes(), loader)
    except (yaml.YAMLError, RecursionError, UnicodeDecodeError) as error:
        raise ValueError(f"is no whole YAML file: {error}") from error
    if nodes(whole, {}) > MOST_NODES:
        raise ValueError("has aliases that stand for more than 20 million entries, expected grasps")
    grasps = whole.get("grasps") if isinstance(whole, dict) else None
    if not isinstance(grasps, dict) or whole.get("format", FORMAT) != FORMAT:
        raise ValueError("is a YAML file of something else, expected format: isaac_grasp, grasps:")
    if str(whole.get("format_version", 1.0)) not in ("1.0", "1"):
        raise ValueError(f"format_version is {whole['format_version']!r}, expected 1.0")
    positions, quaternions = np.empty((len(grasps), 3)), np.empty((len(grasps), 4))
    rows = []
    for k, (name, grasp) in enumerate(grasps.items()):
        row = dict(grasp) if isinstance(grasp, dict) else {}
        turn = row.pop("orientation", None)
        if not isinstance(turn, dict) or not {"w", "xyz"} <= set(turn) or "position" not in row:
            expected = "position: [x, y, z] and orientation: {w: w, xyz: [x, y, z]}"
            raise ValueError(f"grasp {name!r} is {shown(grasp)}, expected {expected}")
        positions[k] = as_numbers(f"position of {name!r}", row.pop("position"), (3,))
        quaternions[k, :3] = as_numbers(f"orientation xyz of {name!r}", turn["xyz"], (3,))
        quaternions[k, 3] = as_numbers(f"orientation w of {name!r}", turn["w"], ())
        rows.append(flat(row))
    keys = dict.fromkeys(key for row in rows for key in row)
    columns = {key: column_of([row.get(key) for row in rows]) for key in keys}
    header = {key: value for key, value in whole.items() if key != "grasps"}
    said = {k.removeprefix("object_"): v for k, v in header.items() if k.startswith("object_")}
    names = tuple(map(str, grasps))
    label = LABEL if LABEL in columns else ""
    return Content(*(FORMAT, poses_of(positions, quaternions), columns, names, said, header, label))


def write(path: Path, content: Content) -> None:
    """A file as Isaac Sim's grasp editor writes it."""
    with needs_extra("an isaac_grasp file", "grasps"):
        import yaml
    said = {f"object_{k}": v for k, v in content.object.items() if k in ("file", "scale")}
    columns = {name: without_nan(column) for name, column in content.columns.items()}
    names = content.names
    if len(set(names)) < len(names) or all(name.isdecimal() for name in names):
        names = tuple(f"grasp_{k}" for k in range(len(names)))
    grasps = {}
    quaternions = quaternions_of(content.poses).tolist()
    for k, (name, position) in enumerate(zip(names, content.poses[:, :3, 3].tolist(), strict=True)):
        row = nested(columns, k)
        *xyz, w = quaternions[k]
        first = {LABEL: row.pop(LABEL)} if LABEL in row else {}
        place = {"position": position, "orientation": {"w": w, "xyz": xyz}}
        grasps[name] = {**first, **place, **row}
    whole = {"format": FORMAT, "format_version": 1.0, **said, **content.header, "grasps": grasps}
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(whole, file, dumper, sort_keys=False, default_flow_style=None)


def flat(row: dict[Any, Any], prefix: str = "") -> dict[str, Any]:
    """Entries by name, b within a as "a/b"."""
    entries: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, dict):
            entries |= flat(value, f"{prefix}{key}/")
        else:
            entries[f"{prefix}{key}"] = value
    return entries


def nodes(value: Any, known: dict[int, float]) -> float:
    """The number of entries, those behind each alias counted again; infinite if one has itself."""
    if not isinstance(value, (dict, list)):
        return 1.0
    if id(value) not in known:
        known[id(value)] = np.inf  # while it is counted
        entries = value.values() if isinstance(value, dict) else value
        known[id(value)] = 1.0 + sum(nodes(entry, known) for entry in entries)
    return known[id(value)]
