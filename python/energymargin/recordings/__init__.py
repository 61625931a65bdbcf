"""Recordings of a camera: read from CSV files, placed into a task's scene, scored frame by frame.

In the plane: of each of two bodies x, y and yaw. Poses in space are not read.
"""

from typing import TYPE_CHECKING

from energymargin.deprecations import moved_names
from energymargin.recordings.csv_files import Columns
from energymargin.recordings.reading import read_csv
from energymargin.recordings.recording import Motion, Placed, Recording, Repairs, placed
from energymargin.recordings.trajectories import (
    RecordedTask,
    dataset,
    read_frame_labels,
    read_labels,
)

__all__ = [
    "Columns",
    "Motion",
    "Placed",
    "RecordedTask",
    "Recording",
    "Repairs",
    "dataset",
    "placed",
    "read_csv",
    "read_frame_labels",
    "read_labels",
]

if not TYPE_CHECKING:
    __getattr__ = moved_names(__name__, {"Mended": f"{__name__}.Repairs"})
