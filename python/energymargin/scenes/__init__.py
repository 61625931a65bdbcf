"""Scenes from files."""

from energymargin.scenes.files import data_file
from energymargin.scenes.urdf import from_urdf

__all__ = ["data_file", "from_urdf"]
