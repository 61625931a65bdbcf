"""Recordings, placed into a task's scene: CSV files, bags of ROS, datasets of LeRobot."""

from energymargin.records.recordings import *  # noqa: F403
from energymargin.records.recordings import __all__ as __all__  # noqa: PLC0414
