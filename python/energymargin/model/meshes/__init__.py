"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from energymargin.model.meshes.files import mesh
from energymargin.model.meshes.settings import MAX_POINTS, THRESHOLD

__all__ = ["MAX_POINTS", "THRESHOLD", "mesh"]
