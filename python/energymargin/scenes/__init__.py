"""Scenes from files, and states that were measured."""

from energymargin.doors import check_doors
from energymargin.scenes.additions import NotSimulatedError
from energymargin.scenes.files import data_file
from energymargin.scenes.mjcf import from_mjcf
from energymargin.scenes.overlaps import moved_apart
from energymargin.scenes.reports import SceneReport
from energymargin.scenes.urdf import from_urdf

__all__ = ["NotSimulatedError", "SceneReport", "data_file", "from_mjcf", "from_urdf", "moved_apart"]

check_doors(globals(), __all__)
