"""JSON files of GraspGen."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from energymargin.base.checks import numbers_of
from energymargin.grasps.grasp_set import Content, column_of, flat, nested, plain

FORMAT, FRAME = "GraspGen", None
LABEL = "object_in_gripper"
EXPECTED = '{"object": {"file", "scale"}, "grasps": {"transforms", "object_in_gripper"}}'


def read(path: Path) -> Content:
    """The grasps of a JSON file. Raises ValueError if it holds something else."""
    try:
        whole = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is no whole JSON file: {error}") from error
    grasps = whole.get("grasps") if isinstance(whole, dict) else None
    if not isinstance(grasps, dict) or "transforms" not in grasps:
        raise ValueError(f"is a JSON file of something else, expected GraspGen's: {EXPECTED}")
    poses = numbers_of("grasps.transforms", grasps.pop("transforms"), "poses (n, 4, 4)")
    entries = flat(grasps)
    rows = [k for k, v in entries.items() if isinstance(v, list) and len(v) == len(poses)]
    columns = {name: column_of(entries.pop(name)) for name in rows}
    if LABEL in entries:
        raise ValueError(f"grasps.{LABEL} is not a list of {len(poses)} values, as transforms is")
    said = whole["object"] if isinstance(whole.get("object"), dict) else {}
    header, label = {**whole, "grasps": nested(entries)}, LABEL if LABEL in columns else ""
    return Content(FORMAT, poses, columns, (), said, header, label)


def write(path: Path, content: Content) -> None:
    """A file as GraspGen's; its success field has true and false."""
    columns = dict(content.columns)
    if LABEL in columns:
        held = columns[LABEL].astype(float)
        if np.isnan(held).any():
            said = "the label of some grasps is not known, expected true or false for GraspGen"
            raise ValueError(f"{said}; write grasps[~np.isnan(grasps.labels)], or give scores")
        columns[LABEL] = held >= 0.5
    grasps = {"transforms": content.poses.tolist()}
    grasps |= nested({name: plain(column) for name, column in columns.items()})
    whole = {"object": dict(content.object), **content.header}
    whole["grasps"] = {**whole.get("grasps", {}), **grasps}
    path.write_text(json.dumps(whole), encoding="utf-8")
