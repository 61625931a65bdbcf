"""Shapes from mesh files: convex parts that move as one, with the mass properties of the mesh."""

from energymargin.meshes.mesh import THRESHOLD, Mesh, needs_extra

__all__ = ["THRESHOLD", "Mesh", "needs_extra"]
