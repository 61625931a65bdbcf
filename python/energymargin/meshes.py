"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from energymargin.model.meshes import *  # noqa: F403
from energymargin.model.meshes import __all__ as __all__  # noqa: PLC0414
