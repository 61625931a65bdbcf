"""HDF5 files: ACRONYM's, and the rollouts that GraspGen records."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from energymargin.grasps.content import Content, as_numbers, column_of

ACRONYM, ROLLOUTS = "ACRONYM", "GraspGen rollouts"
TRANSFORMS, QUALITIES = "grasps/transforms", "grasps/qualities/"
LABEL = "flex/object_in_gripper"
LARGEST = 2**20  # bytes of a dataset that is of no row; larger ones, as images, are left alone


def read(path: Path, where: Mapping[str, Any]) -> Content:
    """The grasps of a file; `where` chooses the object of several rollouts."""
    try:
        with h5py.File(path) as file:
            if TRANSFORMS in file:
                return _acronym(file)
            if isinstance(file.get("objects"), h5py.Group):
                return _rollouts(file["objects"], where)
            keys = ", ".join(file)
    except (OSError, KeyError, RuntimeError) as error:  # as h5py says that bytes are missing
        raise ValueError(f"is damaged or cut off, expected a whole HDF5 file: {error}") from error
    raise ValueError(f"has {keys}, expected {TRANSFORMS} (ACRONYM) or objects/*/pred_grasps")


def write(path: Path, content: Content) -> None:
    """A file as ACRONYM's."""
    with h5py.File(path, "w") as file:
        said = {f"object/{name}": value for name, value in content.object.items()}
        for name, value in {"gripper/type": "panda", **said, **content.header}.items():
            file[name] = value
        file[TRANSFORMS] = content.poses
        for name, column in content.columns.items():
            text = column.dtype.kind in "UO"
            place = f"{QUALITIES if '/' in name else 'grasps/'}{name}"
            data = [str(value) for value in column] if text else column
            file.create_dataset(place, data=data, dtype=h5py.string_dtype() if text else None)


def _acronym(file: h5py.File) -> Content:
    poses = as_numbers(TRANSFORMS, file[TRANSFORMS][()], (-1, 4, 4))
    columns, header = {}, {}

    def sort(name: str, thing: Any) -> None:
        if not isinstance(thing, h5py.Dataset) or name == TRANSFORMS:
            return
        if name.startswith("grasps/") and thing.shape[:1] == poses.shape[:1]:
            short = name.removeprefix(QUALITIES).removeprefix("grasps/")
            values = thing.asstr()[()] if h5py.check_string_dtype(thing.dtype) else thing[()]
            columns[short] = column_of(values)
        elif thing.nbytes <= LARGEST:
            header[name] = thing[()]

    file.visititems(sort)
    labels = [name for name in columns if name.endswith("/object_in_gripper")]
    said = {
        name.removeprefix("object/"): _plain(value)
        for name, value in header.items()
        if name.startswith("object/")
    }
    label = LABEL if LABEL in labels else (labels or [""])[0]
    return Content(ACRONYM, poses, columns, object=said, header=header, label=label)


def _rollouts(objects: h5py.Group, where: Mapping[str, Any]) -> Content:
    name = one_object(list(objects), where)
    group = objects[name]
    poses = as_numbers("pred_grasps", group["pred_grasps"][()], (-1, 4, 4))
    columns = {key: group[key][()] for key in ("confidence", "collision") if key in group} | {
        "object": np.full(len(poses), name)
    }
    said = {"file": _plain(group["asset_path"][()])} if "asset_path" in group else {}
    return Content(ROLLOUTS, poses, columns, object=said)


def one_object(names: list[str], where: Mapping[str, Any]) -> str:
    """The object of a file of several: the only one, or that of `where`."""
    if where.get("object", names[0] if len(names) == 1 else None) in names:
        return str(where.get("object", names[0]))
    some = ", ".join(map(repr, names[:3])) + (" ..." if len(names) > 3 else "")
    raise ValueError(
        f"has {len(names)} objects ({some}), and where has {where.get('object')!r}; expected one, "
        f'as where={{"object": {(names or ["mug"])[0]!r}}}'
    )


def _plain(value: Any) -> Any:
    return value.decode() if isinstance(value, bytes) else value
