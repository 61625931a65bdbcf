"""What is gripped: its shape, mass and friction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import mass_properties
from energymargin.checks import not_negative_number, positive_number
from energymargin.grasps.shapes import shape_digest
from energymargin.scenes.corners import shape_parts

HEAVY = 50.0  # kg; what no hand lifts


@dataclass(frozen=True)
class GraspObject:
    """What is gripped.

    Args:
        shape: of `em.mesh`, or a primitive, in the frame in which the grasps are given.
        mass: [kg]
        friction: coefficient; that of a contact is its product with the hand's.

    Raises ValueError on numbers that cannot be.
    """

    shape: Any
    mass: float
    friction: float = 0.5

    def __post_init__(self) -> None:
        """Checks all of it."""
        positive_number("mass", self.mass)
        not_negative_number("friction", self.friction)
        if self.mass > HEAVY:
            raise ValueError(
                f"mass is {self.mass:g} kg, expected at most {HEAVY:g} kg: grams take 0.001"
            )

    @staticmethod
    def load(
        path: str | Path,
        *,
        mass: float | None = None,
        density: float | None = None,
        friction: float = 0.5,
        scale: float = 1.0,
        **options: Any,
    ) -> GraspObject:
        """An object from a mesh file, whose frame is that of the grasps.

        Args:
            path: of the mesh.
            mass: [kg]
            density: in place of the mass [kg/m^3].
            friction: coefficient.
            scale: what makes metres of the file's numbers.
            options: of `em.mesh`, as accuracy.

        Raises ValueError unless it has either a mass or a density, and OSError on the file.
        """
        from energymargin.meshes import mesh

        if (mass is None) == (density is None):
            raise ValueError(
                f"mass is {mass} and density is {density}, expected one of them: [kg], [kg/m^3]"
            )
        shape = mesh(path, scale=scale, **options)
        if mass is None:
            mass = positive_number("density", density or 0.0) * mass_properties(shape).volume
        return GraspObject(shape, mass, friction)

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Centre of mass in its frame [m], (3,)."""
        return np.array(mass_properties(self.shape).center)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Points whose hull holds the object, in its frame [m], (k, 3)."""
        return np.concatenate(shape_parts(self.shape))

    @property
    def text(self) -> dict[str, Any]:
        """What it is, as JSON."""
        return {"shape": shape_digest(self.shape), "mass": self.mass, "friction": self.friction}
