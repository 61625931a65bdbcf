"""Recordings: read from CSV files, bags of ROS or datasets of LeRobot, placed into a task's scene,
scored by frame.

In the plane: of each of two bodies x, y and yaw.
"""

from energymargin.base.doors import check_doors
from energymargin.records.recordings.bags import bag_topics, read_bag
from energymargin.records.recordings.csv_files import Columns, read_csv
from energymargin.records.recordings.lerobot import read_lerobot
from energymargin.records.recordings.recording import Motion, Placed, Recording, Repairs, placed
from energymargin.records.recordings.trajectories import (
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
    "bag_topics",
    "dataset",
    "placed",
    "read_bag",
    "read_csv",
    "read_frame_labels",
    "read_labels",
    "read_lerobot",
]

check_doors(globals(), __all__)
