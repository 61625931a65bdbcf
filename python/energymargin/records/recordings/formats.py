"""Files of motions in formats that are not read, by their names."""

from __future__ import annotations

from pathlib import Path

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


def require_recording(path: Path) -> None:
    """Raises ValueError on a file or folder in a format that is not read, with the way out."""
    for what, marks in UNREAD.items():
        name = f"{path.name.lower()}-"  # shards are a.tfrecord-00000-of-00010
        if any(f"{mark}-" in name or (path / mark).is_file() for mark in marks):
            raise ValueError(f"{path} is {what}, which is not read: {WAY}")
