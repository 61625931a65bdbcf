"""Recordings of a camera: read from CSV files, placed into a task's scene, scored frame by frame.

In the plane: of each of two bodies x, y and yaw. Poses in space are not read.
"""

from energymargin.recordings.columns import Columns
from energymargin.recordings.reading import read_csv
from energymargin.recordings.recording import Mended, Motion, Placed, Recording, placed
from energymargin.recordings.table import read_frame_labels, read_labels
from energymargin.recordings.trajectories import RecordedTask, dataset

__all__ = [
    "Columns",
    "Mended",
    "Motion",
    "Placed",
    "RecordedTask",
    "Recording",
    "dataset",
    "placed",
    "read_csv",
    "read_frame_labels",
    "read_labels",
]
