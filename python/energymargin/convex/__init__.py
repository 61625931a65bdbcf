"""Convex parts of solids that are not convex."""

from energymargin.convex.decomposition import decomposed
from energymargin.convex.hulls import corners, hull_volume, inside

__all__ = ["corners", "decomposed", "hull_volume", "inside"]
