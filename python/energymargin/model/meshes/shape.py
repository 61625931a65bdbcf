"""What a mesh file becomes: a compound that knows how it differs from the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import numpy as np

from energymargin._core import Compound, ConvexHull, MassProperties, mass_properties
from energymargin.model.meshes.convex import cached
from energymargin.model.meshes.deviation import Deviation, deviation, solid_of
from energymargin.model.meshes.solids import Points, Solid, triangles


class MeshShape(Compound):
    """Convex parts of a mesh, which move as one, and how they differ from it."""

    def __init__(
        self,
        parts: Sequence[Points],
        solid: MassProperties | None,
        bodies: Sequence[Solid],
        *,
        recenter: bool,
    ) -> None:
        """Parts (k, 3), and the bodies that they stand for, in the frame of the file."""
        self._parts, self._bodies = parts, bodies
        self._origin = np.zeros(3)
        if recenter:
            of = solid or mass_properties(Compound([ConvexHull(part) for part in parts]))
            self._origin = np.array(of.center)
        if recenter and solid is not None:
            solid = MassProperties(solid.volume, np.zeros(3), solid.moments, solid.axes)
        super().__init__([ConvexHull(part - self._origin) for part in parts], solid=solid)

    def __reduce__(self) -> tuple[type[Compound], tuple[Any, ...]]:
        """In another process, and in digests, it is its parts alone."""
        return Compound, (self.parts, self.solid)

    @property
    def origin(self) -> Points:
        """Where the body's frame is in that of the file, shape (3,) [m]: 0, or the centre of mass
        with `recenter`."""
        return self._origin.copy()

    @property
    def deviation(self) -> Deviation | None:
        """How the parts differ from the mesh; None if that has holes, and so no inside."""
        if not self._bodies:
            return None
        figures = cached(
            ["deviation", *triangles(self._bodies), *self._parts],
            lambda: [np.array(astuple(deviation(solid_of(self._bodies), self._parts)))],
        )
        return Deviation(*figures[0].tolist())
