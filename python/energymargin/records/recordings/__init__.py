"""Recordings: read from CSV files, bags of ROS, datasets of LeRobot or tables of pandas, placed
into a task's scene, scored by frame.

Of any number of bodies, in the plane (x, y, yaw) or in space.
"""

from energymargin.base.doors import check_doors
from energymargin.records.recordings.bags import bag_topics, read_bag
from energymargin.records.recordings.cleaning import Rules
from energymargin.records.recordings.csv_files import (
    Columns,
    from_table,
    read_csv,
    read_frame_labels,
    read_labels,
)
from energymargin.records.recordings.formats import kind_of
from energymargin.records.recordings.lerobot import read_lerobot, read_successes
from energymargin.records.recordings.placing import Placed, RecordedTask, dataset, placed
from energymargin.records.recordings.recording import Motion, Recording, Repairs

__all__ = [
    "Columns",
    "Motion",
    "Placed",
    "RecordedTask",
    "Recording",
    "Repairs",
    "Rules",
    "bag_topics",
    "dataset",
    "from_table",
    "kind_of",
    "placed",
    "read_bag",
    "read_csv",
    "read_frame_labels",
    "read_labels",
    "read_lerobot",
    "read_successes",
]

check_doors(globals(), __all__)
