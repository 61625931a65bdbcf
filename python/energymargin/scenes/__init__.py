"""Scenes from files."""

from energymargin.scenes.urdf import add_urdf, data_file

__all__ = ["add_urdf", "data_file"]
