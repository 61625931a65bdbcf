"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from energymargin.model.meshes.files import MAX_POINTS, THRESHOLD, mesh

__all__ = ["MAX_POINTS", "THRESHOLD", "mesh"]
