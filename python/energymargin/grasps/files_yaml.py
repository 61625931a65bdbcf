"""YAML files of the format isaac_grasp 1.0."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from energymargin.base.checks import numbers_of, shown
from energymargin.base.errors import needs_extra
from energymargin.grasps.frames import poses_of, quaternions_of
from energymargin.grasps.grasp_set import Content, column_of, flat, nested, plain

FORMAT, FRAME = "isaac_grasp", None
LABEL = "confidence"
MOST_ENTRIES = 2e7  # of a file whose aliases are written out; a bomb has more
OF_POSES = (
    "em.grasps.GraspSet(poses) takes matrices of shape (n, 4, 4), and a table has x,y,z,qx,qy,qz,qw"
)
OTHER = (
    "is a YAML file of something else, as of MoveIt, expected isaac_grasp (format: isaac_grasp, "
    f"grasps:); {OF_POSES}"
)


def read(path: Path) -> Content:
    """The grasps of a file. Raises ValueError that names the grasp that is wrong."""
    with needs_extra("an isaac_grasp file", "grasps"):
        import yaml
    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        whole = yaml.load(path.read_bytes(), type("Loader", (loader,), {"flatten_mapping": _plain}))
        entries = _entries(whole, {})
    except (yaml.YAMLError, RecursionError, UnicodeDecodeError) as error:
        raise ValueError(f"is no whole YAML file: {error}") from error
    if entries > MOST_ENTRIES:
        raise ValueError("has aliases that stand for more than 20 million entries, expected grasps")
    grasps = whole.get("grasps") if isinstance(whole, dict) else None
    if not isinstance(grasps, dict) or whole.get("format", FORMAT) != FORMAT:
        raise ValueError(OTHER)
    if str(whole.get("format_version", "1.0")) not in ("1.0", "1"):
        raise ValueError(f"format_version is {whole['format_version']!r}, expected 1.0")
    rows = [flat(grasp) if isinstance(grasp, dict) else {} for grasp in grasps.values()]
    places = np.empty((len(rows), 7))
    for place, row, (name, grasp) in zip(places, rows, grasps.items(), strict=True):
        try:
            place[:3] = numbers_of("", row.pop("position"), shape=(3,))
            place[3:6] = numbers_of("", row.pop("orientation/xyz"), shape=(3,))
            place[6] = numbers_of("", row.pop("orientation/w"), shape=())
        except (KeyError, ValueError) as error:
            expected = "position: [x, y, z] and orientation: {w: w, xyz: [x, y, z]}"
            raise ValueError(f"grasp {name!r} is {shown(grasp)}, expected {expected}") from error
    keys = dict.fromkeys(key for row in rows for key in row)
    columns = {key: column_of([row.get(key) for row in rows]) for key in keys}
    header = {key: value for key, value in whole.items() if key != "grasps"}
    said = {k.removeprefix("object_"): v for k, v in header.items() if k.startswith("object_")}
    label, names = LABEL if LABEL in columns else "", tuple(map(str, grasps))
    poses = poses_of(places[:, :3], places[:, 3:])
    return Content(FORMAT, poses, columns, names, said, header, label)


def write(path: Path, content: Content) -> None:
    """A file as Isaac Sim's grasp editor writes it."""
    with needs_extra("an isaac_grasp file", "grasps"):
        import yaml
    said = {f"object_{k}": v for k, v in content.object.items() if k in ("file", "scale")}
    columns = {name: plain(column) for name, column in content.columns.items()}
    names = [f"grasp_{name}" if name.isdecimal() else name for name in content.names]
    grasps: dict[str, Any] = {}
    for k, (x, y, z, w) in enumerate(quaternions_of(content.poses).tolist()):
        row = {name: column[k] for name, column in columns.items() if column[k] is not None}
        first = {LABEL: row.pop(LABEL)} if LABEL in row else {}
        position = content.poses[k, :3, 3].tolist()
        place = {"position": position, "orientation": {"w": w, "xyz": [x, y, z]}}
        grasps[names[k]] = {**first, **place, **nested(row)}
    if len(grasps) < len(names):
        raise ValueError("two grasps have one name, expected names that differ in an isaac_grasp")
    whole = {"format": FORMAT, "format_version": 1.0, **said, **content.header, "grasps": grasps}
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text = yaml.dump(whole, Dumper=dumper, sort_keys=False, default_flow_style=None)
    path.write_text(text, encoding="utf-8")


def _plain(_loader: Any, node: Any) -> None:
    """Raises ValueError on a mapping that takes in others (<<): a few lines of them may be many."""
    if any(key.tag == "tag:yaml.org,2002:merge" for key, _ in node.value):
        raise ValueError("has a mapping with <<, expected its entries")


def _entries(value: Any, known: dict[int, float]) -> float:
    """Number of entries, what an alias stands for counted again; infinite if one has itself."""
    if not isinstance(value, (dict, list)):
        return 1.0
    if id(value) not in known:
        known[id(value)] = np.inf  # while it is counted
        parts = value.values() if isinstance(value, dict) else value
        known[id(value)] = 1.0 + sum(_entries(part, known) for part in parts)
    return known[id(value)]
