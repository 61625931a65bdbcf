"""Scenes from files, and states that were measured."""

from energymargin.scenes.files import data_file
from energymargin.scenes.overlaps import moved_apart
from energymargin.scenes.urdf import from_urdf

__all__ = ["data_file", "from_urdf", "moved_apart"]
