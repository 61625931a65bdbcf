"""Paths of recordings: their kind by the name, formats that are not read, and folders, which may be
a stranger's: all files that are read lie in them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from energymargin.base.aliases import AnyPath

UNREAD = {
    "arrays of numpy": (".npy", ".npz"),
    "HDF5, as of robomimic": (".h5", ".hdf5"),
    "TFRecord, as of RLDS": (".tfrecord", "features.json"),
    "zarr": (".zarr", "zarr.json", ".zgroup", ".zarray"),
    "Parquet": (".parquet",),
    "a pickle, which can run code": (".pkl", ".pickle"),
}
"""Ends of names of files and folders, or files that such a folder has."""
WAY = (
    "em.recordings.from_table takes a pandas table of any source with columns such as time, cup_x, "
    "cup_y, cup_z, cup_qx, cup_qy, cup_qz, cup_qw, in SI units; read are CSV files, bags of ROS "
    "and folders of LeRobot"
)
BAG_SUFFIXES = (".mcap", ".db3", ".bag")
INFO = Path("meta", "info.json")  # of a LeRobot dataset
Kind = Literal["csv", "bag", "lerobot"]
MOST_FILES = 1_000_000


def require_recording(path: Path) -> None:
    """Raises ValueError on a file or folder in a format that is not read, with the way out."""
    for what, marks in UNREAD.items():
        name = f"{path.name.lower()}-"  # shards are a.tfrecord-00000-of-00010
        if any(f"{mark}-" in name or (path / mark).is_file() for mark in marks):
            raise ValueError(f"{path} is {what}, which is not read: {WAY}")


def is_bag(path: Path) -> bool:
    """Whether a file has a bag's suffix."""
    return path.suffix.lower() in BAG_SUFFIXES


def kind_of(path: AnyPath) -> Kind:
    """Who reads it: `read_lerobot` the folder of a LeRobot dataset, `read_bag` any other folder and
    what has a bag's suffix, `read_csv` the rest."""
    if (Path(path) / INFO).is_file():
        return "lerobot"
    return "bag" if is_bag(Path(path)) or Path(path).is_dir() else "csv"


def require_own_files(folder: Path) -> None:
    """Raises ValueError that names a link which leads out of a folder, and on too many files.

    A folder of Hugging Face's cache (snapshots/REVISION) may have links into the blobs beside it.
    """
    top, count = folder.resolve(), 0
    own = [top, *([top.parents[1] / "blobs"] if top.parent.name == "snapshots" else [])]
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(place, name)
            if path.is_symlink() and not any(path.resolve().is_relative_to(one) for one in own):
                raise ValueError(
                    f"{path} is a link to {os.readlink(path)!r}, which is not in {folder}: "
                    "expected a folder that is whole by itself; `cp -RL` makes one, if you trust it"
                )
            if not (path.is_file() or path.is_dir()):
                raise ValueError(f"{path} is neither a file nor a folder, expected one")
        count += len(files)
        if count > MOST_FILES:
            raise ValueError(f"{folder} has more than {MOST_FILES} files, expected a recording's")
