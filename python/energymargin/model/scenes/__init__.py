"""Scenes from files, and states that were measured."""

from energymargin.base.doors import check_doors
from energymargin.model.scenes.additions import NotSimulatedError
from energymargin.model.scenes.corners import shape_parts
from energymargin.model.scenes.files import data_file
from energymargin.model.scenes.mjcf import from_mjcf
from energymargin.model.scenes.mjcf_drives import Actuator, actuators
from energymargin.model.scenes.overlaps import moved_apart
from energymargin.model.scenes.poses import body_poses, pose
from energymargin.model.scenes.reports import SceneReport
from energymargin.model.scenes.urdf import from_urdf

__all__ = [
    "Actuator",
    "NotSimulatedError",
    "SceneReport",
    "actuators",
    "body_poses",
    "data_file",
    "from_mjcf",
    "from_urdf",
    "moved_apart",
    "pose",
    "shape_parts",
]

check_doors(globals(), __all__)
