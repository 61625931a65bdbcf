"""HDF5 files as ACRONYM's: grasps/transforms, grasps/qualities/ENGINE/NAME, object/NAME."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from energymargin.base import hdf5
from energymargin.base.checks import numbers_of
from energymargin.grasps.grasp_set import Content, column_of

FORMAT, FRAME = "ACRONYM", "franka_panda"
LABEL = "flex/object_in_gripper"
TRANSFORMS, QUALITIES = "grasps/transforms", "grasps/qualities/"

MOST_BYTES = 2**30  # of a file's arrays: half a million grasps have 64 MB of poses


def read(path: Path) -> Content:
    """The grasps of a file. Raises ValueError if it is cut off, or holds something else."""
    try:
        with h5py.File(path, "r") as file:
            found = _entries(path, hdf5.checked(file))
    except (OSError, KeyError, RuntimeError) as error:  # as h5py says that bytes are missing
        raise ValueError(f"is damaged or cut off, expected a whole HDF5 file: {error}") from error
    if TRANSFORMS not in found:
        raise ValueError(f"has {', '.join(found) or 'nothing'}, expected {TRANSFORMS} (ACRONYM)")
    poses = numbers_of(TRANSFORMS, found.pop(TRANSFORMS), "poses (n, 4, 4)")
    columns = {}
    for name in [name for name in found if name.startswith("grasps/")]:
        if np.shape(found[name])[:1] == poses.shape[:1]:
            short = name.removeprefix(QUALITIES).removeprefix("grasps/")
            columns[short] = column_of(found.pop(name))
        elif name.startswith(QUALITIES):
            raise ValueError(f"{name} has not {len(poses)} rows, as {TRANSFORMS} has")
    said = {k.removeprefix("object/"): v for k, v in found.items() if k.startswith("object/")}
    labels = [name for name in columns if name.endswith("/object_in_gripper")]
    label = LABEL if LABEL in labels else "".join(labels[:1])
    return Content(FORMAT, poses, columns, (), said, found, label, frame=FRAME)


def _entries(path: Path, arrays: list[hdf5.Array]) -> dict[str, Any]:
    """The values of all arrays of a file. Raises ValueError on other than numbers and text."""
    size = sum(array.nbytes for _, array in arrays)
    if size > MOST_BYTES:
        raise ValueError(f"has {size} bytes of arrays, expected at most {MOST_BYTES}")
    found: dict[str, Any] = {}
    for name, array in arrays:
        if h5py.check_string_dtype(array.dtype):
            found[name] = hdf5.texts(array, path.stat().st_size)
        elif array.dtype.hasobject:
            raise ValueError(f"{name} holds {array.dtype}, expected numbers or text")
        else:
            found[name] = array[()]
    return found


def write(path: Path, content: Content) -> None:
    """A file as ACRONYM's. HDF5 writes to memory: where a disk is full it ends the process."""
    image = BytesIO()
    said = {f"object/{name}": value for name, value in content.object.items()}
    with h5py.File(image, "w") as file:
        for name, value in {**said, **content.header, TRANSFORMS: content.poses}.items():
            file[name] = value
        for name, column in content.columns.items():
            text = column.dtype.kind in "UO"
            place = f"{QUALITIES if '/' in name else 'grasps/'}{name}"
            data = ["" if value is None else str(value) for value in column] if text else column
            file.create_dataset(place, data=data, dtype=h5py.string_dtype() if text else None)
    path.write_bytes(image.getvalue())
